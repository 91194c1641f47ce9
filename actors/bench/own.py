"""callboard as a contender."""

from __future__ import annotations

import sys
from importlib.metadata import version
from typing import TYPE_CHECKING, Final, Literal

from actors.bench.contender import SCRATCH, Contender
from actors.bench.roles import ABILITIES, ROLES

if TYPE_CHECKING:
    from pathlib import Path

Loop = Literal["uvloop", "asyncio"]
Transport = Literal["tcp", "unix"]

_SOCKET: Final = "broker.sock"


def callboard(*, loop: Loop = "uvloop", transport: Transport = "tcp") -> Contender:
    """Return callboard, with its broker and roles on `loop`, linked by `transport`."""
    variant = [word for word in (loop, transport) if word not in {"uvloop", "tcp"}]
    python = (sys.executable, "-m", *(("actors.bench.plain_loop",) if loop == "asyncio" else ()))

    def command(port: int, scratch: Path) -> list[str]:
        place = ["--unix", str(scratch / _SOCKET)] if transport == "unix" else ["--port", str(port)]
        return [*python, "broker", *place, "--log-level", "warning"]

    def url(port: int) -> str:
        return (
            f"callboard+unix://{SCRATCH}/{_SOCKET}"
            if transport == "unix"
            else f"callboard://127.0.0.1:{port}"
        )

    return Contender(
        name=f"callboard ({', '.join(variant)})" if variant else "callboard",
        version=version("callboard"),
        brokered=True,
        role_command=(*python, "actors.bench"),
        server_command=command,
        server_url=url,
        roles=ABILITIES | ROLES.keys(),
        socket_name=_SOCKET if transport == "unix" else None,
    )

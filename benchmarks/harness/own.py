"""callboard as a contender."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path
from typing import Final, Literal

from actors.cli.bench.setup import Setup
from benchmarks.harness.contender import SCRATCH, Contender
from benchmarks.harness.roles import ABILITIES, ROLES

Loop = Literal["uvloop", "asyncio"]
Transport = Literal["auto", "tcp", "tls"]

ROOT: Final = Path(__file__).resolve().parents[2]
"""Where `python -m` finds the roles, wherever the benchmark was started."""


def callboard(
    *, loop: Loop = "uvloop", transport: Transport = "auto", rules: int = 0, shared_memory: bool = True
) -> Contender:
    """Return callboard, with its broker and roles on `loop`, linked by `transport`.

    Args:
        loop: The event loop.
        transport: What connects broker and roles; "auto" is what nodes on the broker's machine choose.
        rules: How many access rules the broker has; 0 for a broker without access rules.
        shared_memory: Whether large messages pass through shared memory.
    """
    setup = Setup(loop=loop, transport=transport, rules=rules, shared_memory=shared_memory)

    def command(port: int, scratch: Path) -> list[str]:
        return setup.command("broker", *setup.broker_options(port, scratch))

    def url(port: int) -> str:
        scheme = "callboards" if transport == "tls" else "callboard"
        return f"{scheme}://127.0.0.1:{port}"

    return Contender(
        name=str(setup),
        version=version("callboard"),
        brokered=True,
        role_command=tuple(setup.command("benchmarks.harness")),
        server_command=command,
        server_url=url,
        roles=ABILITIES | ROLES.keys(),
        variables={"PYTHONPATH": str(ROOT), **setup.variables(SCRATCH)},
    )

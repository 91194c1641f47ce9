"""callboard as a contender."""

from __future__ import annotations

import sys
from importlib.metadata import version
from importlib.util import find_spec
from typing import TYPE_CHECKING, Final, Literal

from actors.bench.contender import SCRATCH, Contender
from actors.bench.roles import ABILITIES, ROLES
from proto.errors import CallboardError

if TYPE_CHECKING:
    from pathlib import Path

Loop = Literal["uvloop", "asyncio"]
Transport = Literal["auto", "tcp", "tls"]

_CA: Final = "ca.pem"
_MISSING: Final = "Measuring TLS needs trustme: pip install 'callboard[bench]'"


def callboard(
    *, loop: Loop = "uvloop", transport: Transport = "auto", rules: int = 0, shared_memory: bool = True
) -> Contender:
    """Return callboard, with its broker and roles on `loop`, linked by `transport`.

    Args:
        loop: The event loop.
        transport: What connects broker and roles; "auto" is what nodes on the broker's machine choose.
        rules: How many access rules the broker has; 0 for a broker without access rules.
        shared_memory: Whether large messages pass through shared memory.

    Raises:
        CallboardError: TLS needs a package that is not installed.
    """
    if transport == "tls" and find_spec("trustme") is None:
        raise CallboardError(_MISSING)
    variant: list[str] = [word for word in (loop, transport) if word not in {"uvloop", "auto"}]
    if rules:
        variant.append(f"{rules:,} rules")
    if not shared_memory:
        variant.append("bytes")
    python = (sys.executable, "-m", *(("actors.bench.plain_loop",) if loop == "asyncio" else ()))

    def command(port: int, scratch: Path) -> list[str]:
        place = ["--port", str(port)]
        if transport == "tcp":
            place.append("--no-local-socket")
        if transport == "tls":
            place += _certificate(scratch)
        if rules:
            place += ["--auth", str(_write_rules(scratch / "access.toml", rules))]
        return [*python, "broker", *place, "--log-level", "warning"]

    def url(port: int) -> str:
        scheme = "callboards" if transport == "tls" else "callboard"
        return f"{scheme}://127.0.0.1:{port}"

    return Contender(
        name=f"callboard ({', '.join(variant)})" if variant else "callboard",
        version=version("callboard"),
        brokered=True,
        role_command=(*python, "actors.bench"),
        server_command=command,
        server_url=url,
        roles=ABILITIES | ROLES.keys(),
        variables={
            "CALLBOARD_SHARED_MEMORY": str(int(shared_memory)),
            **({"CALLBOARD_CA": f"{SCRATCH}/{_CA}"} if transport == "tls" else {}),
        },
    )


def _write_rules(file: Path, count: int) -> Path:
    """Write access rules that allow programs on this machine everything, by the last rule for each action."""
    actions = ("node", "publish", "subscribe", "serve", "call", "see", "administer")
    others = [f"/robot{number}/**" for number in range(-(-count // len(actions)) - 1)]
    rules = "".join(f"allow.{action} = {[*others, '/**']}\n" for action in actions)
    file.write_text(f'[local]\nuser = "bench"\n[users.bench]\nroles = ["all"]\n[roles.all]\n{rules}')
    return file


def _certificate(folder: Path) -> list[str]:
    """Make a certificate of an authority of its own; return the options of the broker that has it."""
    import trustme  # noqa: PLC0415 - an extra

    authority = trustme.CA()
    issued = authority.issue_cert("127.0.0.1")
    certificate, key = folder / "broker.pem", folder / "broker.key"
    authority.cert_pem.write_to_path(folder / _CA)
    issued.cert_chain_pems[0].write_to_path(certificate)
    issued.private_key_pem.write_to_path(key)
    return ["--tls-cert", str(certificate), "--tls-key", str(key)]

"""How broker and roles of a measurement are run: the event loop, the transport, the access rules."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from importlib.util import find_spec
from typing import TYPE_CHECKING, Final, Literal

from actors.cli.errors import CommandError
from proto.extras import install_command

if TYPE_CHECKING:
    from pathlib import Path

_CA: Final = "ca.pem"
_ACTIONS: Final = ("node", "publish", "subscribe", "serve", "call", "see", "administer")
_WITHOUT_UVLOOP: Final = (
    "import runpy, sys; sys.modules['uvloop'] = None; del sys.argv[0];"
    " runpy.run_module(sys.argv[0], run_name='__main__', alter_sys=True)"
)
"""Runs a module as on a platform without uvloop, by the same path as there."""


@dataclass(frozen=True, kw_only=True)
class Setup:
    """How broker and roles are run.

    Attributes:
        loop: Their event loop.
        transport: What connects them; "auto" is what nodes on the broker's machine choose.
        rules: How many access rules the broker has; 0 for a broker without access rules.
        shared_memory: Whether large messages pass through shared memory.

    Raises:
        CommandError: TLS needs a package that is not installed.
    """

    loop: Literal["uvloop", "asyncio"] = "uvloop"
    transport: Literal["auto", "tcp", "tls"] = "auto"
    rules: int = 0
    shared_memory: bool = True

    def __post_init__(self) -> None:
        if self.transport == "tls" and find_spec("trustme") is None:
            raise CommandError(f"Measuring TLS needs trustme: {install_command('bench', 'trustme')}")

    def __str__(self) -> str:
        words: list[str] = [word for word in (self.loop, self.transport) if word not in {"uvloop", "auto"}]
        if self.rules:
            words.append(f"{self.rules:,} rules")
        if not self.shared_memory:
            words.append("bytes")
        return f"callboard ({', '.join(words)})" if words else "callboard"

    def command(self, module: str, *arguments: str) -> list[str]:
        """Return the command that runs a module on the loop."""
        way = ["-c", _WITHOUT_UVLOOP] if self.loop == "asyncio" else ["-m"]
        return [sys.executable, *way, module, *arguments]

    def broker_options(self, port: int, folder: Path) -> list[str]:
        """Return the options of the broker, and write the files that they name."""
        options = ["--port", str(port), "--log-level", "warning"]
        if self.transport == "tcp":
            options.append("--no-local-socket")
        if self.transport == "tls":
            options += _certificate(folder)
        if self.rules:
            options += ["--auth", str(_write_rules(folder / "access.toml", self.rules))]
        return options

    def variables(self, folder: Path | str) -> dict[str, str]:
        """Return the environment variables of programs that connect to that broker."""
        authority = {"CALLBOARD_CA": f"{folder}/{_CA}"} if self.transport == "tls" else {}
        return {"CALLBOARD_SHARED_MEMORY": str(int(self.shared_memory)), **authority}


def _write_rules(file: Path, count: int) -> Path:
    """Write access rules that allow programs on this machine everything, by the last rule for each action."""
    others = [f"/robot{number}/**" for number in range(-(-count // len(_ACTIONS)) - 1)]
    rules = "".join(f"allow.{action} = {[*others, '/**']}\n" for action in _ACTIONS)
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

"""Zenoh with a router and shared memory, as the library has it by default where all are on one machine.

Payloads of 3 KiB and more are written once, into shared memory, and only references to them pass through the
router's sockets. A system that moves the bytes themselves cannot be as cheap with large messages, and neither
can this one as soon as its ends are on two machines: that is why zenoh_router.py goes without, and this is a
contender of its own. It plays only where memory is shared: it has no calls and no idle connections.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from benchmarks.peers import zenoh_roles, zenoh_router
from benchmarks.peers.roles import command

if TYPE_CHECKING:
    from pathlib import Path

    from benchmarks.harness.contender import Contender
    from benchmarks.peers.roles import Parameters


def open_session(parameters: Parameters) -> Any:
    """A client of the router that shares memory."""
    return zenoh_router.open_session(parameters, shared_memory=True)


def serve(url: str) -> None:
    """Be the router, which has to take part in sharing."""
    zenoh_router.serve(url, shared_memory=True)


_ALL = zenoh_roles.roles(open_session)
ROLES = {name: _ALL[name] for name in ("publisher", "subscriber")}


def server_command(port: int, _: Path) -> list[str]:
    """Start a router that has shared memory on, too."""
    return [*command("zenoh_shared_memory"), "serve", f"tcp/127.0.0.1:{port}"]


def find() -> Contender | str:
    """The contender, or why there is none."""
    router = zenoh_router.find()
    if isinstance(router, str):
        return router
    return replace(
        router,
        name="zenoh (router, shared memory)",
        role_command=command("zenoh_shared_memory"),
        server_command=server_command,
        roles=frozenset(ROLES),
    )

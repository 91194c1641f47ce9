"""Zenoh from peer to peer: the publisher (of calls: the server) listens. See zenoh_roles.py.

Shared memory is off, so that every byte passes through TCP.
"""

from __future__ import annotations

from importlib import metadata
from typing import Any

from benchmarks.harness.contender import Contender
from benchmarks.peers import zenoh_roles
from benchmarks.peers.roles import Parameters, command, library


def open_session(parameters: Parameters) -> Any:
    """A peer that listens, or one that tries to connect until the listener is there."""
    listens = parameters.role in {"publisher", "server"}
    config = zenoh_roles.configuration(
        "peer",
        listen__endpoints=[parameters.url] if listens else [],
        connect__endpoints=[] if listens else [parameters.url],
        connect__timeout_ms=-1,
        connect__exit_on_failure=False,
        connect__retry=zenoh_roles.RETRY,
    )
    return library("zenoh").open(config)


ROLES = zenoh_roles.roles(open_session)


def find() -> Contender | str:
    """The contender, or why there is none."""
    try:
        version = metadata.version("eclipse-zenoh")
    except metadata.PackageNotFoundError:
        return "eclipse-zenoh is not installed (PyPI: eclipse-zenoh)"
    return Contender(
        name="zenoh (direct)",
        version=f"eclipse-zenoh {version} (native, blocking)",
        brokered=False,
        role_command=command("zenoh_direct"),
        server_command=None,
        server_url=lambda port: f"tcp/127.0.0.1:{port}",
        roles=frozenset(ROLES),
    )

"""Zenoh with a router: every role is a client of one process that routes. See zenoh_roles.py.

Shared memory is off, in the router as in its clients, so that every byte passes through TCP and the router.
"""

from __future__ import annotations

import contextlib
import signal
from importlib import metadata
from typing import Any

from benchmarks.harness.contender import Contender
from benchmarks.peers import idle as idle_sockets
from benchmarks.peers import zenoh_roles
from benchmarks.peers.roles import Parameters, Parent, command, library


def open_session(parameters: Parameters, *, shared_memory: bool = False) -> Any:
    """A client of the router."""
    config = zenoh_roles.configuration(
        "client", connect__endpoints=[parameters.url], shared_memory=shared_memory
    )
    return library("zenoh").open(config)


def serve(url: str, *others: str, shared_memory: bool = False) -> None:
    """Be the router until SIGTERM: what zenohd is made of, in a Python process that sleeps.

    It connects to the `others`, which are routers, too.
    """
    config = zenoh_roles.configuration(
        "router",
        listen__endpoints=[url],
        connect__endpoints=others,
        transport__unicast__max_sessions=100_000,
        shared_memory=shared_memory,
    )
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM, signal.SIGINT})
    with library("zenoh").open(config):
        signal.sigwait({signal.SIGTERM, signal.SIGINT})


def idle(parent: Parent, parameters: Parameters) -> None:
    """Hold real sessions, cheap as they are (with shared memory they would end at 350)."""
    idle_sockets.allow_files(parameters.connections)
    with contextlib.ExitStack() as stack:
        for _ in range(parameters.connections):
            stack.enter_context(open_session(parameters))
        parent.ready()
        parent.closed.result()
        parent.done(messages=0, connections=parameters.connections)


ROLES = {**zenoh_roles.roles(open_session), "idle": idle}


def find() -> Contender | str:
    """The contender, or why there is none."""
    try:
        version = metadata.version("eclipse-zenoh")
    except metadata.PackageNotFoundError:
        return "eclipse-zenoh is not installed (PyPI: eclipse-zenoh)"
    program = command("zenoh_router")
    return Contender(
        name="zenoh (router)",
        version=f"eclipse-zenoh {version} (native, blocking)",
        brokered=True,
        role_command=program,
        server_command=lambda port, _: [*program, "serve", f"tcp/127.0.0.1:{port}"],
        server_url=lambda port: f"tcp/127.0.0.1:{port}",
        roles=frozenset(ROLES),
    )

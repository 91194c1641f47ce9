"""ZeroMQ without a proxy: the publisher (of calls: the server) binds. See zmq_roles.py."""

from __future__ import annotations

from importlib import metadata

from benchmarks.harness.contender import Contender
from benchmarks.peers import zmq_roles
from benchmarks.peers.roles import command


def endpoints(url: str) -> zmq_roles.Endpoints:
    """Everybody meets at the one endpoint."""
    return zmq_roles.Endpoints(publisher=url, subscriber=url, server=url, requester=url, proxied=False)


ROLES = zmq_roles.roles(endpoints)


def find() -> Contender | str:
    """The contender, or why there is none."""
    try:
        version = metadata.version("pyzmq")
    except metadata.PackageNotFoundError:
        return "pyzmq is not installed (PyPI: pyzmq)"
    return Contender(
        name="pyzmq (direct)",
        version=f"pyzmq {version} (native, blocking)",
        brokered=False,
        role_command=command("pyzmq_direct"),
        server_command=None,
        server_url=lambda port: f"tcp://127.0.0.1:{port}",
        roles=frozenset(ROLES),
    )

"""ZeroMQ through a proxy: one process with libzmq's own proxy twice. See zmq_roles.py.

XSUB to XPUB for the stream (with XPUB_NODROP, so that a slow subscriber holds the publisher up) and ROUTER to
DEALER for calls, each `zmq.proxy` in a thread that libzmq keeps in C. Only the subscribers' port is known
beforehand; a role asks for the others there.
"""

from __future__ import annotations

import dataclasses
import threading
from importlib import metadata
from typing import TYPE_CHECKING

from benchmarks.harness.contender import Contender
from benchmarks.peers import idle, zmq_roles
from benchmarks.peers.roles import MATCHING_S, Parameters, Parent, command, library

if TYPE_CHECKING:
    import asyncio

GREETING_BYTES = 64
ANY_PORT = "tcp://127.0.0.1:*"


def serve(url: str) -> None:
    """Proxy until killed; answer at `url` who asks where the endpoints are."""
    zmq = library("zmq")
    context = zmq.Context()
    publishers, subscribers = context.socket(zmq.XSUB), context.socket(zmq.XPUB)
    requesters, servers = context.socket(zmq.ROUTER), context.socket(zmq.DEALER)
    subscribers.xpub_nodrop = True
    endpoints = {}
    for name, socket in (
        ("publisher", publishers),
        ("subscriber", subscribers),
        ("requester", requesters),
        ("server", servers),
    ):
        socket.bind(ANY_PORT)
        endpoints[name] = socket.last_endpoint.decode()
    for pair in ((publishers, subscribers), (requesters, servers)):
        threading.Thread(target=zmq.proxy, args=pair, daemon=True).start()
    directory = context.socket(zmq.REP)
    directory.bind(url)
    while True:
        directory.recv()
        directory.send_json(endpoints)


def endpoints(url: str) -> zmq_roles.Endpoints:
    """Ask the proxy."""
    zmq = library("zmq")
    with zmq.Context() as context, context.socket(zmq.REQ) as directory:
        directory.linger = 0
        directory.rcvtimeo = MATCHING_S * 1000
        directory.connect(url)
        directory.send(b"")
        return zmq_roles.Endpoints(**directory.recv_json(), proxied=True)


async def handshake(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """ZMTP 3.0 without security: greetings, then each side's READY, which says what socket it is."""
    writer.write(b"\xff" + bytes(8) + b"\x7f\x03\x00NULL".ljust(55, b"\0"))
    ready = b"\x05READY\x0bSocket-Type" + (3).to_bytes(4, "big") + b"SUB"
    writer.write(b"\x04" + bytes([len(ready)]) + ready)
    await reader.readexactly(GREETING_BYTES)
    if b"READY" not in await reader.readuntil(b"XPUB"):
        raise ConnectionError("the proxy did not say READY")


async def idle_connections(parent: Parent, parameters: Parameters) -> None:
    """Hold connections of subscribers."""
    place = dataclasses.replace(parameters, url=endpoints(parameters.url).subscriber)
    await idle.hold_connections(parent, place, handshake)


ROLES = {**zmq_roles.roles(endpoints), "idle": idle_connections}


def find() -> Contender | str:
    """The contender, or why there is none."""
    try:
        version = metadata.version("pyzmq")
    except metadata.PackageNotFoundError:
        return "pyzmq is not installed (PyPI: pyzmq)"
    program = command("pyzmq_proxy")
    return Contender(
        name="pyzmq (proxy)",
        version=f"pyzmq {version} (native, blocking)",
        brokered=True,
        role_command=program,
        server_command=lambda port, _: [*program, "serve", f"tcp://127.0.0.1:{port}"],
        server_url=lambda port: f"tcp://127.0.0.1:{port}",
        roles=frozenset(ROLES),
    )

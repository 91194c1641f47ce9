"""ZeroMQ's roles, the same through a proxy and without.

pyzmq on blocking sockets: libzmq does its I/O in a thread of its own, and `zmq.asyncio` adds a poll of the
socket and a future to each message, several times the cost of a blocking `recv` (pyzmq_asyncio.py measures
that). The stream goes from an XPUB to XSUB sockets (what PUB and SUB are made of), whose reverse direction
carries the acknowledgements. XPUB_NODROP makes a full queue hold the sender up where PUB would drop, and the
queues are bounded by bytes as well as by messages. From 64 KiB on messages are sent and received without a
copy, as pyzmq advises. Calls go from a DEALER to a ROUTER.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from benchmarks.peers import calls, stream
from benchmarks.peers.roles import Parameters, Parent, library

if TYPE_CHECKING:
    from collections.abc import Callable, Generator

QUEUE_BYTES = 16 << 20
QUEUE_MESSAGES = 10_000
NO_COPY_BYTES = 65536
SUBSCRIBE_TO_ALL = b"\x01"
CLOSED_INTERVAL_MS = 100
"""How often an idle server looks whether its parent has closed its stdin."""
UPSTREAM = b"\x02"
"""Prefix of what an XSUB sends that is not a subscription."""


@dataclass(frozen=True, kw_only=True)
class Endpoints:
    """Where the roles meet; each is bound by one side and connected to by the other.

    Attributes:
        publisher: the publisher's endpoint.
        subscriber: the subscribers'.
        server: the server's endpoint.
        requester: the requester's.
        proxied: whether a proxy binds them all; else the publisher and the server do.
    """

    publisher: str
    subscriber: str
    server: str
    requester: str
    proxied: bool


def queue_messages(size: int) -> int:
    """How many messages of a size a queue holds."""
    return max(4, min(QUEUE_MESSAGES, QUEUE_BYTES // size))


@contextlib.contextmanager
def open_socket(
    context: Any, kind: int, endpoint: str, *, bind: bool, queue: int = QUEUE_MESSAGES
) -> Generator[Any]:
    """A socket with queues for so many messages; 0 is without a limit."""
    with context.socket(kind) as socket:
        socket.set_hwm(queue)
        socket.linger = 1000
        if bind:
            socket.bind(endpoint)
        else:
            socket.connect(endpoint)
        yield socket


def publisher(parent: Parent, parameters: Parameters, endpoints: Endpoints) -> None:
    """Send until the queue is full, and wait there."""
    zmq = library("zmq")
    bind, size = not endpoints.proxied, parameters.size
    queue = queue_messages(size)
    readers = stream.Readers(parameters)
    with (
        zmq.Context() as context,
        open_socket(context, zmq.XPUB, endpoints.publisher, bind=bind, queue=queue) as socket,
    ):
        socket.xpub_nodrop = True

        def receive(timeout_s: float) -> bytes | None:
            if not socket.poll(timeout_s * 1000):
                return None
            message: bytes = socket.recv()
            return message.removeprefix(UPSTREAM) if message.startswith(UPSTREAM) else None

        parent.ready()
        parent.go.result()
        stream.match_readers(readers, partial(socket.send, stream.PROBE), receive)
        send = partial(socket.send, copy=size < NO_COPY_BYTES)
        sent = stream.publish_blocking(parent, parameters, send)
        stream.wait_for_end(readers, sent, receive)
        parent.done(messages=sent, sent=sent)


def subscriber(parent: Parent, parameters: Parameters, endpoints: Endpoints) -> None:
    """Receive on each subscription's socket until it has nothing more, then on the next."""
    zmq = library("zmq")
    tally = stream.Tally(parameters)
    probed: set[Any] = set()  # sockets connect in their own time: a probe is answered when all have had one
    copy, queue = parameters.size < NO_COPY_BYTES, queue_messages(parameters.size)
    with contextlib.ExitStack() as stack:
        context = stack.enter_context(zmq.Context())
        poller = zmq.Poller()
        for _ in range(parameters.subscriptions):
            opened = open_socket(context, zmq.XSUB, endpoints.subscriber, bind=False, queue=queue)
            socket = stack.enter_context(opened)
            socket.send(SUBSCRIBE_TO_ALL)
            poller.register(socket, zmq.POLLIN)
        parent.ready()
        while not tally.finished:
            for socket, _ in poller.poll():
                with contextlib.suppress(zmq.Again):
                    while True:
                        acknowledgement = tally.take(socket.recv(zmq.NOBLOCK, copy=copy))
                        if acknowledgement is not None:
                            probed.add(socket)
                            if len(probed) == parameters.subscriptions:
                                socket.send(UPSTREAM + acknowledgement)
        tally.report(parent)


def server(parent: Parent, parameters: Parameters, endpoints: Endpoints) -> None:  # noqa: ARG001
    """Answer whoever asks until the parent closes our stdin."""
    zmq = library("zmq")
    kind, bind = (zmq.DEALER, False) if endpoints.proxied else (zmq.ROUTER, True)
    served = 0
    with zmq.Context() as context, open_socket(context, kind, endpoints.server, bind=bind) as socket:
        socket.rcvtimeo = CLOSED_INTERVAL_MS
        parent.ready()
        while not parent.closed.done():
            with contextlib.suppress(zmq.Again):
                client, data = socket.recv_multipart()
                socket.send_multipart([client, calls.numbered_reply(data)])
                served += 1
        parent.done(messages=served, served=served)


def requester(parent: Parent, parameters: Parameters, endpoints: Endpoints) -> None:
    """Keep the requests in flight on one DEALER."""
    zmq = library("zmq")
    with (
        zmq.Context() as context,
        open_socket(context, zmq.DEALER, endpoints.requester, bind=False) as socket,
    ):
        turns = calls.Turns(parent, parameters, lambda number: socket.send(calls.numbered_request(number)))
        parent.ready()
        parent.go.result()
        turns.begin()
        while not turns.finished:
            turns.take(*calls.split_number(socket.recv()))
        turns.report()


def roles(find_endpoints: Callable[[str], Endpoints]) -> dict[str, Callable[[Parent, Parameters], None]]:
    """The roles, with the function that finds the endpoints."""

    def bind(
        role: Callable[[Parent, Parameters, Endpoints], None],
    ) -> Callable[[Parent, Parameters], None]:
        return lambda parent, parameters: role(parent, parameters, find_endpoints(parameters.url))

    return {role.__name__: bind(role) for role in (publisher, subscriber, server, requester)}

"""ZeroMQ without a proxy through `zmq.asyncio`, as an asyncio application would use it; on uvloop.

The sockets are those of zmq_roles.py, and so is who binds. What differs is what asyncio makes of them:

- Awaiting a `recv` costs several times what the message costs, so whoever has awaited one takes what else is
  there with `NOBLOCK`, which `zmq.asyncio` answers at once: twice the rate.
- XPUB_NODROP is no back-pressure here: libzmq calls an XPUB writable at all times, so `zmq.asyncio` tries a
  full one again at once and raises `Again`. The publisher keeps a window instead, and the stream's queues
  need no limit beside it. It receives acknowledgements only when the window is full: a pending `recv` would
  cost each `send` a look at the socket's state.
"""

from __future__ import annotations

import asyncio
import contextlib
from importlib import metadata
from typing import Any

from benchmarks.harness.contender import Contender
from benchmarks.peers import calls, stream, zmq_roles
from benchmarks.peers.roles import Parameters, Parent, command, library, until

TAKEN_AT_ONCE = 100
"""How many messages are received before the event loop gets its turn."""
NO_LIMIT = 0
"""As the high-water mark of a queue."""


class Readers(stream.Readers):
    """Subscriber processes whose acknowledgements come up the publisher's own socket."""

    def __init__(self, parameters: Parameters, socket: Any) -> None:
        super().__init__(parameters)
        self._socket = socket

    async def change(self) -> None:
        """Receive the next acknowledgement."""
        message: bytes = b""
        while not message.startswith(zmq_roles.UPSTREAM):
            message = await self._socket.recv()
        self.take(message.removeprefix(zmq_roles.UPSTREAM))


async def publisher(parent: Parent, parameters: Parameters) -> None:
    """Send in a window."""
    copy = parameters.size < zmq_roles.NO_COPY_BYTES
    kind = library("zmq").XPUB
    with (
        library("zmq.asyncio").Context() as context,
        zmq_roles.open_socket(context, kind, parameters.url, bind=True, queue=NO_LIMIT) as socket,
    ):

        async def send(payload: bytes, count: int) -> None:
            for _ in range(count):
                await socket.send(payload, copy=copy)

        parent.ready()
        await until(parent.go)
        await stream.publish_in_window(parent, parameters, Readers(parameters, socket), send)


async def subscriber(parent: Parent, parameters: Parameters) -> None:
    """Count in a task for each subscription's socket, and acknowledge."""
    zmq = library("zmq")
    tally = stream.Tally(parameters, windowed=True)
    probed: set[Any] = set()  # sockets connect in their own time: a probe is answered when all have had one
    copy = parameters.size < zmq_roles.NO_COPY_BYTES
    finished = asyncio.Event()

    async def take(socket: Any, data: Any) -> None:
        acknowledgement = tally.take(data)
        if acknowledgement is not None:
            probed.add(socket)
            if len(probed) == parameters.subscriptions:
                await socket.send(zmq_roles.UPSTREAM + acknowledgement)
                if tally.finished:
                    finished.set()

    async def listen(socket: Any) -> None:
        while True:
            await take(socket, await socket.recv(copy=copy))
            with contextlib.suppress(zmq.Again):
                for _ in range(TAKEN_AT_ONCE):
                    await take(socket, await socket.recv(zmq.NOBLOCK, copy=copy))
            await asyncio.sleep(0)

    with contextlib.ExitStack() as stack:
        context = stack.enter_context(library("zmq.asyncio").Context())
        sockets = [
            stack.enter_context(
                zmq_roles.open_socket(context, zmq.XSUB, parameters.url, bind=False, queue=NO_LIMIT)
            )
            for _ in range(parameters.subscriptions)
        ]
        async with asyncio.TaskGroup() as group:
            for socket in sockets:
                await socket.send(zmq_roles.SUBSCRIBE_TO_ALL)
            tasks = [group.create_task(listen(socket)) for socket in sockets]
            parent.ready()
            await finished.wait()
            tally.report(parent)
            for task in tasks:
                task.cancel()


async def server(parent: Parent, parameters: Parameters) -> None:
    """Answer whoever asks until the parent closes our stdin."""
    zmq = library("zmq")
    served = 0
    with (
        library("zmq.asyncio").Context() as context,
        zmq_roles.open_socket(context, zmq.ROUTER, parameters.url, bind=True) as socket,
    ):

        async def answer(client: bytes, data: bytes) -> None:
            nonlocal served
            await socket.send_multipart([client, calls.numbered_reply(data)])
            served += 1

        async def serve() -> None:
            while True:
                await answer(*await socket.recv_multipart())
                with contextlib.suppress(zmq.Again):
                    for _ in range(TAKEN_AT_ONCE):
                        await answer(*await socket.recv_multipart(zmq.NOBLOCK))
                await asyncio.sleep(0)

        async with asyncio.TaskGroup() as group:
            serving = group.create_task(serve())
            parent.ready()
            await until(parent.closed)
            parent.done(messages=served, served=served)
            serving.cancel()


async def requester(parent: Parent, parameters: Parameters) -> None:
    """Keep the requests in flight on one DEALER."""
    zmq = library("zmq")
    with (
        library("zmq.asyncio").Context() as context,
        zmq_roles.open_socket(context, zmq.DEALER, parameters.url, bind=False) as socket,
    ):
        turns = calls.Turns(parent, parameters, lambda number: socket.send(calls.numbered_request(number)))
        parent.ready()
        await until(parent.go)
        turns.begin()
        while not turns.finished:
            turns.take(*calls.split_number(await socket.recv()))
            if parameters.in_flight > 1:  # a single call's reply comes alone
                with contextlib.suppress(zmq.Again):
                    for _ in range(TAKEN_AT_ONCE):
                        turns.take(*calls.split_number(await socket.recv(zmq.NOBLOCK)))
        turns.report()


ROLES = {
    "publisher": publisher,
    "subscriber": subscriber,
    "server": server,
    "requester": requester,
}


def find() -> Contender | str:
    """The contender, or why there is none."""
    try:
        version = metadata.version("pyzmq")
    except metadata.PackageNotFoundError:
        return "pyzmq is not installed (PyPI: pyzmq)"
    return Contender(
        name="pyzmq (direct, asyncio)",
        version=f"pyzmq {version} (asyncio)",
        brokered=False,
        role_command=command("pyzmq_asyncio"),
        server_command=None,
        server_url=lambda port: f"tcp://127.0.0.1:{port}",
        roles=frozenset(ROLES),
    )

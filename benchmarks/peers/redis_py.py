"""Redis with redis-py: PUBLISH and SUBSCRIBE over redis.asyncio, parsed by hiredis, on uvloop.

A publisher sends its bursts as pipelines without a transaction, the only form that does not wait for the
server's answer to each PUBLISH. Each subscription is a PubSub (a connection) with `listen()`. Redis cuts off
a subscriber whose output grows beyond a limit; the limit is taken away and the publisher keeps a window. The
server persists nothing. Calls are two channels, requests and replies with a number to tell them apart: a list
with blocking pops takes a command more on each side. Requests and replies that come up together leave as one
pipeline.
"""

from __future__ import annotations

import asyncio
import contextlib
import shutil
import subprocess
from functools import partial
from importlib import metadata
from typing import TYPE_CHECKING, Any

from benchmarks.harness.contender import Contender
from benchmarks.peers import calls, idle, stream
from benchmarks.peers.roles import Parameters, Parent, command, library, until

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator
    from pathlib import Path

CHANNEL = "bench"
ACKNOWLEDGEMENTS = "bench.acknowledgements"
REQUESTS = "bench.requests"
REPLIES = "bench.replies"
READ_BYTES = 1 << 20
BURSTS = 4
"""A pipeline is waited for, so that a longer one is worth it."""


@contextlib.asynccontextmanager
async def connect(parameters: Parameters) -> AsyncGenerator[Any]:
    """A client; its connections read as much as is there.

    Protocol 2, because with 3 redis-py 8 formats each message for its debug log, even when there is none.
    """
    client = library("redis.asyncio").Redis(
        host=parameters.host, port=parameters.port, protocol=2, socket_read_size=READ_BYTES
    )
    async with client:
        yield client


@contextlib.asynccontextmanager
async def subscribe(client: Any, channel: str) -> AsyncGenerator[Any]:
    """A subscription that the server has confirmed. Its `listen()` ends when it is unsubscribed."""
    async with client.pubsub(ignore_subscribe_messages=True) as subscription:
        await subscription.subscribe(channel)
        await subscription.get_message(timeout=calls.CALL_S)
        yield subscription


class Batches:
    """Publishes to a channel in pipelines: what is added while one is under way makes the next."""

    def __init__(self, client: Any, channel: str) -> None:
        self._client = client
        self._channel = channel
        self._pending: list[bytes] = []
        self._added = asyncio.Event()

    def add(self, data: bytes) -> None:
        """Publish soon."""
        self._pending.append(data)
        self._added.set()

    async def run(self) -> None:
        """Publish until cancelled."""
        while True:
            await self._added.wait()
            self._added.clear()
            batch, self._pending = self._pending, []
            async with self._client.pipeline(transaction=False) as pipeline:
                for data in batch:
                    pipeline.publish(self._channel, data)
                await pipeline.execute()


async def publisher(parent: Parent, parameters: Parameters) -> None:
    """Publish in pipelines and in a window."""
    readers = stream.Readers(parameters)
    async with connect(parameters) as client, subscribe(client, ACKNOWLEDGEMENTS) as subscription:

        async def take_acknowledgements() -> None:
            async for message in subscription.listen():
                readers.take(message["data"])

        async def send(payload: bytes, count: int) -> None:
            async with client.pipeline(transaction=False) as pipeline:
                for _ in range(count):
                    pipeline.publish(CHANNEL, payload)
                await pipeline.execute()

        async with asyncio.TaskGroup() as group:
            group.create_task(take_acknowledgements())
            parent.ready()
            await until(parent.go)
            await stream.publish_in_window(parent, parameters, readers, send, bursts=BURSTS)
            await subscription.unsubscribe()


async def subscriber(parent: Parent, parameters: Parameters) -> None:
    """Listen on each of the subscriptions, and acknowledge."""
    tally = stream.Tally(parameters, windowed=True)

    async def listen(client: Any, subscription: Any) -> None:
        async for message in subscription.listen():
            acknowledgement = tally.take(message["data"])
            if acknowledgement is not None:
                await client.publish(ACKNOWLEDGEMENTS, acknowledgement)
                if tally.finished:
                    finished.set()

    finished = asyncio.Event()
    async with contextlib.AsyncExitStack() as stack:
        client = await stack.enter_async_context(connect(parameters))
        subscriptions = [
            await stack.enter_async_context(subscribe(client, CHANNEL))
            for _ in range(parameters.subscriptions)
        ]
        parent.ready()
        async with asyncio.TaskGroup() as group:
            for subscription in subscriptions:
                group.create_task(listen(client, subscription))
            await finished.wait()
            tally.report(parent)
            for subscription in subscriptions:
                await subscription.unsubscribe()


async def server(parent: Parent, parameters: Parameters) -> None:
    """Answer requests until the parent closes our stdin."""
    served = 0
    async with connect(parameters) as client, subscribe(client, REQUESTS) as subscription:
        replies = Batches(client, REPLIES)

        async def serve() -> None:
            nonlocal served
            async for message in subscription.listen():
                replies.add(calls.numbered_reply(message["data"]))
                served += 1

        async with asyncio.TaskGroup() as group:
            group.create_task(serve())
            publishing = group.create_task(replies.run())
            parent.ready()
            await until(parent.closed)
            parent.done(messages=served, served=served)
            publishing.cancel()
            await subscription.unsubscribe()


async def requester(parent: Parent, parameters: Parameters) -> None:
    """Publish requests and take replies from the channel of all replies."""
    async with connect(parameters) as client, subscribe(client, REPLIES) as subscription:
        requests = Batches(client, REQUESTS)
        finished = asyncio.Event()
        turns = calls.Turns(parent, parameters, lambda number: requests.add(calls.numbered_request(number)))

        async def take_replies() -> None:
            async for message in subscription.listen():
                turns.take(*calls.split_number(message["data"]))
                if turns.finished:
                    finished.set()

        async with asyncio.TaskGroup() as group:
            group.create_task(take_replies())
            publishing = group.create_task(requests.run())
            parent.ready()
            await until(parent.go)
            turns.begin()
            await finished.wait()
            turns.report()
            publishing.cancel()
            await subscription.unsubscribe()


async def handshake(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """PING, PONG."""
    writer.write(b"*1\r\n$4\r\nPING\r\n")
    if not (await reader.readline()).startswith(b"+PONG"):
        raise ConnectionError("Redis did not answer PING")


ROLES = {
    "publisher": publisher,
    "subscriber": subscriber,
    "server": server,
    "requester": requester,
    "idle": partial(idle.hold_connections, handshake=handshake),
}


def server_command(port: int, scratch: Path) -> list[str]:
    """A Redis that only passes messages on."""
    settings = {
        "bind": "127.0.0.1",
        "port": str(port),
        "dir": str(scratch),
        "save": "",
        "appendonly": "no",
        "maxclients": "100000",
        "client-output-buffer-limit": "pubsub 0 0 0",
    }
    return ["redis-server", *(word for name, value in settings.items() for word in (f"--{name}", value))]


def find() -> Contender | str:
    """The contender, or why there is none."""
    program = shutil.which("redis-server")
    if program is None:
        return "redis-server is not installed (Debian: redis-server)"
    try:
        version, parser = metadata.version("redis"), metadata.version("hiredis")
    except metadata.PackageNotFoundError as error:
        return f"{error.name} is not installed (PyPI: redis[hiredis])"
    output = subprocess.run([program, "--version"], capture_output=True, text=True, timeout=10, check=True)
    server_version = next(word[2:] for word in output.stdout.split() if word.startswith("v="))
    return Contender(
        name="redis-py",
        version=f"redis-py {version} with hiredis {parser}, redis-server {server_version} (asyncio)",
        brokered=True,
        role_command=command("redis_py"),
        server_command=server_command,
        server_url=lambda port: f"redis://127.0.0.1:{port}",
        roles=frozenset(ROLES),
    )

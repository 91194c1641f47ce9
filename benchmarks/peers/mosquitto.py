"""mosquitto with aiomqtt: MQTT 3.1.1 at QoS 0.

QoS 0 is the fastest, and MQTT has nothing that pushes back at it, so the publisher keeps a window and
mosquitto's queues have no limit. aiomqtt's documented way to receive is its message iterator, which costs a
task and a wait per message; here its public `queue_type` is a queue that hands each message on at once. What
limits it is paho below, which writes a packet and reads a packet with system calls of its own. (aiomqtt needs
`add_reader`, which uvloop has.) A client gets a message once, however often it subscribes, so each
subscription is a client. Calls are two topics, requests and replies with a number to tell them apart: the
response topic of MQTT 5 would only make packets longer.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
import re
import shutil
import subprocess
from functools import partial
from importlib import metadata
from typing import TYPE_CHECKING, Any

from benchmarks.harness.contender import Contender
from benchmarks.peers import calls, idle, stream
from benchmarks.peers.roles import Parameters, Parent, command, library, until

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator, Callable
    from pathlib import Path

TOPIC = "bench"
ACKNOWLEDGEMENTS = "bench/acknowledgements"
REQUESTS = "bench/requests"
REPLIES = "bench/replies"

CONFIGURATION = """
listener {port} 127.0.0.1
allow_anonymous true
persistence false
max_connections -1
max_queued_messages 0
max_queued_bytes 0
set_tcp_nodelay true
sys_interval 0
log_type error
"""


@contextlib.asynccontextmanager
async def connect(parameters: Parameters, topic: str, take: Callable[[bytes], None]) -> AsyncGenerator[Any]:
    """A client that hands on what comes for a topic."""

    class Direct(asyncio.Queue[Any]):
        def put_nowait(self, item: Any) -> None:
            take(item.payload)

    aiomqtt = library("aiomqtt")
    client = aiomqtt.Client(parameters.host, parameters.port, queue_type=Direct, timeout=calls.CALL_S)
    client.pending_calls_threshold = math.inf  # replies come up many at a time; that is no reason to warn
    async with client:
        await client.subscribe(topic)
        yield client


class Outbox:
    """Publishes what is added from callbacks, which cannot wait."""

    def __init__(self, topic: str) -> None:
        self._topic = topic
        self._pending: asyncio.Queue[bytes] = asyncio.Queue()
        self.add = self._pending.put_nowait
        self.sent = self._pending.join

    async def run(self, client: Any) -> None:
        """Publish until cancelled."""
        while True:
            await client.publish(self._topic, await self._pending.get())
            self._pending.task_done()


async def publisher(parent: Parent, parameters: Parameters) -> None:
    """Publish in a window."""
    readers = stream.Readers(parameters)
    async with connect(parameters, ACKNOWLEDGEMENTS, readers.take) as client:

        async def send(payload: bytes, count: int) -> None:
            for _ in range(count):
                await client.publish(TOPIC, payload)

        parent.ready()
        await until(parent.go)
        await stream.publish_in_window(parent, parameters, readers, send)


async def subscriber(parent: Parent, parameters: Parameters) -> None:
    """Count on each of the subscriptions, and acknowledge."""
    tally = stream.Tally(parameters, windowed=True)
    finished = asyncio.Event()
    outbox = Outbox(ACKNOWLEDGEMENTS)

    def take(payload: bytes) -> None:
        acknowledgement = tally.take(payload)
        if acknowledgement is not None:
            outbox.add(acknowledgement)
            if tally.finished:
                finished.set()

    async with contextlib.AsyncExitStack() as stack:
        clients = [
            await stack.enter_async_context(connect(parameters, TOPIC, take))
            for _ in range(parameters.subscriptions)
        ]
        async with asyncio.TaskGroup() as group:
            sending = group.create_task(outbox.run(clients[0]))
            parent.ready()
            await finished.wait()
            tally.report(parent)
            await outbox.sent()
            sending.cancel()


async def server(parent: Parent, parameters: Parameters) -> None:
    """Answer requests until the parent closes our stdin."""
    served = 0
    outbox = Outbox(REPLIES)

    def serve(payload: bytes) -> None:
        nonlocal served
        served += 1
        outbox.add(calls.numbered_reply(payload))

    async with connect(parameters, REQUESTS, serve) as client, asyncio.TaskGroup() as group:
        sending = group.create_task(outbox.run(client))
        parent.ready()
        await until(parent.closed)
        parent.done(messages=served, served=served)
        sending.cancel()


async def requester(parent: Parent, parameters: Parameters) -> None:
    """Publish requests and take replies from the topic of all replies."""
    finished = asyncio.Event()
    outbox = Outbox(REQUESTS)
    turns = calls.Turns(parent, parameters, lambda number: outbox.add(calls.numbered_request(number)))

    def take(payload: bytes) -> None:
        turns.take(*calls.split_number(payload))
        if turns.finished:
            finished.set()

    async with connect(parameters, REPLIES, take) as client, asyncio.TaskGroup() as group:
        sending = group.create_task(outbox.run(client))
        parent.ready()
        await until(parent.go)
        turns.begin()
        await finished.wait()
        turns.report()
        sending.cancel()


async def handshake(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """CONNECT with a clean session, no keep-alive and no name, CONNACK."""
    writer.write(b"\x10\x0c\x00\x04MQTT\x04\x02\x00\x00\x00\x00")
    if await reader.readexactly(4) != b"\x20\x02\x00\x00":
        raise ConnectionError("mosquitto did not accept the connection")


ROLES = {
    "publisher": publisher,
    "subscriber": subscriber,
    "server": server,
    "requester": requester,
    "idle": partial(idle.hold_connections, handshake=handshake),
}


def find_program() -> str | None:
    """mosquitto, which Debian keeps where only root looks."""
    return shutil.which("mosquitto") or shutil.which("mosquitto", path="/usr/sbin:/usr/local/sbin")


def server_command(port: int, scratch: Path) -> list[str]:
    """Write the configuration and return how to start mosquitto with it."""
    configuration = scratch / "mosquitto.conf"
    configuration.write_text(CONFIGURATION.format(port=port))
    return [find_program() or "mosquitto", "-c", str(configuration)]


def find() -> Contender | str:
    """The contender, or why there is none."""
    program = find_program()
    if program is None:
        return "mosquitto is not installed (Debian: mosquitto)"
    try:
        version = metadata.version("aiomqtt")
    except metadata.PackageNotFoundError:
        return "aiomqtt is not installed (PyPI: aiomqtt)"
    # It has no option that prints the version alone, and ends with 3 after its help.
    output = subprocess.run([program, "-h"], capture_output=True, text=True, timeout=10, check=False)
    found = re.search(r"version (\S+)", output.stdout)
    server_version = found[1] if found else "unknown"
    return Contender(
        name="aiomqtt",
        version=f"aiomqtt {version}, mosquitto {server_version} (asyncio)",
        brokered=True,
        role_command=command("mosquitto"),
        server_command=server_command,
        server_url=lambda port: f"mqtt://127.0.0.1:{port}",
        roles=frozenset(ROLES),
    )

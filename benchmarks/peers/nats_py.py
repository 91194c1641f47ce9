"""nats-server with nats-py: core NATS publish and subscribe, and its request.

The client runs on uvloop with a callback for each subscription (its iterator costs a task per message, twice
the time). `publish` only appends to a buffer that the client's flusher writes in one go, so the publisher
lets the loop turn once per burst. NATS cuts off or drops at a slow consumer; the publisher therefore keeps a
window, and the limits of the server (max_pending) and of each subscription (pending messages and bytes) are
raised above it. Calls are `request`, which has one inbox subscription for all calls; the server role
publishes to the reply subject.
"""

from __future__ import annotations

import asyncio
import json
import shutil
import subprocess
from functools import partial
from importlib import metadata
from typing import TYPE_CHECKING, Any

from benchmarks.harness.contender import Contender
from benchmarks.peers import calls, idle, stream
from benchmarks.peers.roles import Parameters, Parent, command, library, until

if TYPE_CHECKING:
    from pathlib import Path

SUBJECT = "bench"
ACKNOWLEDGEMENTS = "bench.acknowledgements"
ADD = "bench.add"
PENDING_BYTES = 4 << 20
"""What the client buffers before `publish` waits for the socket."""

CONFIGURATION = """
listen: "127.0.0.1:{port}"
max_payload: 8MB
max_pending: 256MB
max_connections: 100000
write_deadline: "30s"
debug: false
trace: false
log_file: "{log}"
"""


async def connect(url: str) -> Any:
    """Connect as every role does; a lost connection is an error, not something to wait out."""
    return await library("nats").connect(url, pending_size=PENDING_BYTES, allow_reconnect=False)


async def subscribe(client: Any, subject: str, callback: Any) -> None:
    """Subscribe without the client's own limits: the window bounds what is pending."""
    await client.subscribe(subject, cb=callback, pending_msgs_limit=-1, pending_bytes_limit=-1)


async def publisher(parent: Parent, parameters: Parameters) -> None:
    """Publish in a window."""
    client = await connect(parameters.url)
    readers = stream.Readers(parameters)

    async def on_acknowledgement(message: Any) -> None:
        readers.take(message.data)

    async def send(payload: bytes, count: int) -> None:
        for _ in range(count):
            await client.publish(SUBJECT, payload)

    await subscribe(client, ACKNOWLEDGEMENTS, on_acknowledgement)
    await client.flush()
    parent.ready()
    await until(parent.go)
    await stream.publish_in_window(parent, parameters, readers, send)
    await client.close()


async def subscriber(parent: Parent, parameters: Parameters) -> None:
    """Count on each of the subscriptions, and acknowledge."""
    client = await connect(parameters.url)
    tally = stream.Tally(parameters, windowed=True)
    finished = asyncio.Event()

    async def on_message(message: Any) -> None:
        acknowledgement = tally.take(message.data)
        if acknowledgement is not None:
            await client.publish(ACKNOWLEDGEMENTS, acknowledgement)
            if tally.finished:
                finished.set()

    for _ in range(parameters.subscriptions):
        await subscribe(client, SUBJECT, on_message)
    await client.flush()
    parent.ready()
    await finished.wait()
    tally.report(parent)
    await client.drain()


async def server(parent: Parent, parameters: Parameters) -> None:
    """Add until the parent closes our stdin."""
    client = await connect(parameters.url)
    served = 0

    async def on_request(message: Any) -> None:
        nonlocal served
        served += 1
        await client.publish(message.reply, calls.reply(message.data))

    await subscribe(client, ADD, on_request)
    await client.flush()
    parent.ready()
    await until(parent.closed)
    parent.done(messages=served, served=served)
    await client.close()


async def requester(parent: Parent, parameters: Parameters) -> None:
    """Call with `request`."""
    client = await connect(parameters.url)

    async def call(data: bytes) -> bytes:
        message = await client.request(ADD, data, timeout=calls.CALL_S)
        return message.data  # type: ignore[no-any-return]  # the library is not imported for the type check

    parent.ready()
    await until(parent.go)
    await calls.call_in_turns(parent, parameters, call)
    await client.close()


async def handshake(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """INFO, CONNECT and PING, PONG."""
    await reader.readline()
    options = json.dumps(
        {"verbose": False, "pedantic": False, "lang": "python", "version": "0", "protocol": 1}
    )
    writer.write(f"CONNECT {options}\r\nPING\r\n".encode())
    if not (await reader.readline()).startswith(b"PONG"):
        raise ConnectionError("nats-server did not answer PING")


ROLES = {
    "publisher": publisher,
    "subscriber": subscriber,
    "server": server,
    "requester": requester,
    "idle": partial(idle.hold_connections, handshake=handshake),
}


def server_command(port: int, scratch: Path) -> list[str]:
    """Write the configuration and return how to start nats-server with it."""
    configuration = scratch / "nats.conf"
    configuration.write_text(CONFIGURATION.format(port=port, log=scratch / "nats.log"))
    return ["nats-server", "--config", str(configuration)]


def find() -> Contender | str:
    """The contender, or why there is none."""
    program = shutil.which("nats-server")
    if program is None:
        return "nats-server is not installed (Debian: nats-server)"
    try:
        version = metadata.version("nats-py")
    except metadata.PackageNotFoundError:
        return "nats-py is not installed (PyPI: nats-py)"
    output = subprocess.run([program, "--version"], capture_output=True, text=True, timeout=10, check=True)
    return Contender(
        name="nats-py",
        version=f"nats-py {version}, nats-server {output.stdout.split()[-1].lstrip('v')} (asyncio)",
        brokered=True,
        role_command=command("nats_py"),
        server_command=server_command,
        server_url=lambda port: f"nats://127.0.0.1:{port}",
        roles=frozenset(ROLES),
    )

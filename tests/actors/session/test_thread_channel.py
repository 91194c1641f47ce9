"""Frames that other threads than the loop's write to a connection."""

from __future__ import annotations

import asyncio
import socket
import sys
import threading
from typing import TYPE_CHECKING

import pytest

from actors.session.thread_channel import MAX_BYTES, ThreadChannel
from proto.wire.codec import encode
from proto.wire.frames import Pong
from proto.wire.session import Role
from tests.proto.aio.bench import Recorder

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator

DEADLINE_SEC = 20.0
FRAME = encode(Pong(1))

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="elsewhere the loop writes all frames")


async def connected(sock: socket.socket) -> ThreadChannel:
    """Return a channel over a socket."""
    loop = asyncio.get_running_loop()
    channel = ThreadChannel(Role.CLIENT, Recorder(), loop=loop)
    sock.setblocking(False)
    await loop.create_connection(lambda: channel, sock=sock)
    return channel


@pytest.fixture
async def pair() -> AsyncGenerator[tuple[ThreadChannel, socket.socket]]:
    """A channel, and the other end of its connection."""
    own, other = socket.socketpair()
    with other:
        other.settimeout(DEADLINE_SEC)
        channel = await connected(own)
        yield channel, other
        channel.abort()
        await asyncio.sleep(0)


def written_in_thread(channel: ThreadChannel, raw: bytes) -> bool:
    """Write a frame in another thread, while the loop is blocked."""
    written = list[bool]()
    thread = threading.Thread(target=lambda: written.append(channel.write_now(raw)))
    thread.start()
    thread.join(DEADLINE_SEC)
    return written[0]


async def test_a_thread_writes_while_the_loop_is_blocked(pair: tuple[ThreadChannel, socket.socket]) -> None:
    """The frame leaves at once, and counts as a sign of life."""
    channel, other = pair
    assert written_in_thread(channel, FRAME)
    assert other.recv(100) == FRAME
    assert channel.bytes_sent == len(FRAME)


async def test_the_loop_writes_large_frames(pair: tuple[ThreadChannel, socket.socket]) -> None:
    """Linux might write a part of them."""
    channel, _ = pair
    assert written_in_thread(channel, bytes(MAX_BYTES))
    assert not written_in_thread(channel, bytes(MAX_BYTES + 1))


async def test_no_frame_gets_into_the_middle_of_another(pair: tuple[ThreadChannel, socket.socket]) -> None:
    """While the transport has a part of a frame, or the peer does not read, a thread writes nothing."""
    channel, other = pair
    channel.outbox.put_control(bytes(1_000_000))
    channel.flush()
    assert not written_in_thread(channel, FRAME)
    rest = 1_000_000
    while rest:
        rest -= len(await asyncio.to_thread(other.recv, rest))
    while not written_in_thread(channel, FRAME):  # the transport learns of it in a later turn
        await asyncio.sleep(0)
    assert other.recv(100) == FRAME


async def test_both_write_at_the_same_time(pair: tuple[ThreadChannel, socket.socket]) -> None:
    """Whole frames arrive, whoever writes them."""
    channel, other = pair
    large = encode(Pong(2)) * 10_000
    sent = list[bool]()
    writer = threading.Thread(target=lambda: sent.extend(channel.write_now(FRAME) for _ in range(200)))

    def read() -> bytes:
        received = bytearray()
        while data := other.recv(1_000_000):
            received += data
        return bytes(received)

    reading = asyncio.create_task(asyncio.to_thread(read))
    writer.start()
    for _ in range(20):
        channel.outbox.put_control(large)
        channel.flush()
        await asyncio.sleep(0)
    await asyncio.to_thread(writer.join)
    while channel.outbox.urgent_bytes:
        await asyncio.sleep(0)
    channel.close()
    received = await reading
    assert received.count(FRAME) == sum(sent)
    assert len(received) == sum(sent) * len(FRAME) + 20 * len(large)
    assert not received.replace(FRAME, b"").replace(encode(Pong(2)), b"")


async def test_the_end_of_a_connection(pair: tuple[ThreadChannel, socket.socket]) -> None:
    """The peer learns of it, as the channel keeps no descriptor; threads write nothing more."""
    channel, other = pair
    assert len(channel.descriptors()) == 2
    channel.close()
    assert not written_in_thread(channel, FRAME)
    assert await asyncio.to_thread(other.recv, 1) == b""
    assert channel.descriptors() == ()


async def test_the_loop_writes_to_other_machines() -> None:
    """TCP writes parts of frames, and there a change of threads matters less."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        channel = await connected(socket.create_connection(server.getsockname()))
        assert not written_in_thread(channel, FRAME)
        channel.abort()
        await asyncio.sleep(0)

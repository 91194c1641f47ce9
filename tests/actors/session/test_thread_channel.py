"""Frames that other threads than the loop's write to a connection."""

from __future__ import annotations

import asyncio
import errno
import os
import socket
import sys
import threading
from contextlib import asynccontextmanager
from functools import wraps
from typing import TYPE_CHECKING, Any

import pytest

from actors.session.thread_channel import MAX_BYTES, ThreadChannel
from proto.aio.process import new_event_loop
from proto.wire.codec import encode
from proto.wire.frames import Pong
from proto.wire.session import Role
from tests.proto.aio.bench import Recorder

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator, Callable, Coroutine

DEADLINE_SEC = 20.0
FRAME = encode(Pong(1))

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="elsewhere the loop writes all frames")


def in_a_loop_of_threads(test: Callable[[], Coroutine[Any, Any, None]]) -> Callable[[], None]:
    """Run a test in a loop as threads of nodes have it."""

    @wraps(test)
    def run() -> None:
        with asyncio.Runner(loop_factory=new_event_loop) as runner:
            runner.run(test())

    return run


async def connected(sock: socket.socket) -> ThreadChannel:
    """Return a channel over a socket."""
    loop = asyncio.get_running_loop()
    channel = ThreadChannel(Role.CLIENT, Recorder(), loop=loop)
    sock.setblocking(False)
    await loop.create_connection(lambda: channel, sock=sock)
    return channel


@asynccontextmanager
async def pair() -> AsyncGenerator[tuple[ThreadChannel, socket.socket]]:
    """Connect a channel; give it, and the other end of its connection."""
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


@in_a_loop_of_threads
async def test_a_thread_writes_while_the_loop_is_blocked() -> None:
    """The frame leaves at once, and counts as a sign of life."""
    async with pair() as (channel, other):
        assert written_in_thread(channel, FRAME)
        assert other.recv(100) == FRAME
        assert channel.bytes_sent == len(FRAME)


@in_a_loop_of_threads
async def test_the_loop_writes_large_frames() -> None:
    """Linux might write a part of them."""
    async with pair() as (channel, _):
        assert written_in_thread(channel, bytes(MAX_BYTES))
        assert not written_in_thread(channel, bytes(MAX_BYTES + 1))


@in_a_loop_of_threads
async def test_a_full_connection_is_left_to_the_loop_at_once() -> None:
    """Also in a program whose sockets wait by default: meanwhile the loop could not write."""
    default = socket.getdefaulttimeout()
    socket.setdefaulttimeout(100 * DEADLINE_SEC)
    try:
        own, reader = socket.socketpair()
        channel = await connected(own)
    finally:
        socket.setdefaulttimeout(default)
    full = threading.Event()

    def fill() -> None:
        while channel.write_now(bytes(MAX_BYTES)):
            pass
        full.set()

    threading.Thread(target=fill, daemon=True).start()
    try:
        assert await asyncio.to_thread(full.wait, DEADLINE_SEC)
    finally:
        reader.close()  # ends a wait
        channel.abort()
        await asyncio.sleep(0)


@in_a_loop_of_threads
async def test_without_a_free_descriptor_the_loop_writes() -> None:
    """The connection is made all the same."""
    own, other = socket.socketpair()

    def fail(descriptor: int) -> int:
        raise OSError(errno.EMFILE, "Too many open files", descriptor)

    with other, pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "dup", fail)
        channel = await connected(own)
        assert channel.connected
        assert not written_in_thread(channel, FRAME)
        assert not written_in_thread(channel, FRAME)
        channel.abort()
        await asyncio.sleep(0)


def test_the_loop_writes_with_transports_of_asyncio() -> None:
    """Since Python 3.12 their buffers are empty for a moment while a part of a frame is unsent."""
    own, other = socket.socketpair()

    async def write() -> bool:
        channel = await connected(own)
        written = written_in_thread(channel, FRAME)
        channel.abort()
        await asyncio.sleep(0)
        return written

    with other, asyncio.Runner(loop_factory=asyncio.new_event_loop) as runner:
        assert not runner.run(write())


@in_a_loop_of_threads
async def test_no_frame_gets_into_the_middle_of_another() -> None:
    """While the transport has a part of a frame, or the peer does not read, a thread writes nothing."""
    async with pair() as (channel, other):
        channel.outbox.put_control(bytes(1_000_000))
        channel.flush()
        assert not written_in_thread(channel, FRAME)
        rest = 1_000_000
        while rest:
            rest -= len(await asyncio.to_thread(other.recv, rest))
        while not written_in_thread(channel, FRAME):  # the transport learns of it in a later turn
            await asyncio.sleep(0)
        assert other.recv(100) == FRAME


@in_a_loop_of_threads
async def test_the_loop_writes_the_rest_of_a_frame() -> None:
    """A socket with little space takes a part; nothing gets into the middle."""
    frames = [bytes([number]) * MAX_BYTES for number in range(20)]
    own, other = socket.socketpair()
    own.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 1)
    other.setblocking(False)
    received = bytearray()

    async def read(size: int) -> None:
        async with asyncio.timeout(DEADLINE_SEC):
            received.extend(await asyncio.get_running_loop().sock_recv(other, size))

    with other:
        channel = await connected(own)
        for frame in frames:
            while not written_in_thread(channel, frame):
                await read(1000)
        while len(received) < len(frames) * MAX_BYTES:
            await read(MAX_BYTES)
        assert received == b"".join(frames)
        channel.abort()
        await asyncio.sleep(0)


@in_a_loop_of_threads
async def test_both_write_at_the_same_time() -> None:
    """Whole frames arrive, whoever writes them."""
    async with pair() as (channel, other):
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


@in_a_loop_of_threads
async def test_the_end_of_a_connection() -> None:
    """The peer learns of it, as the channel keeps no descriptor; threads write nothing more."""
    async with pair() as (channel, other):
        assert len(channel.descriptors()) == 2
        channel.close()
        assert not written_in_thread(channel, FRAME)
        assert await asyncio.to_thread(other.recv, 1) == b""
        assert channel.descriptors() == ()


@in_a_loop_of_threads
async def test_the_loop_writes_to_other_machines() -> None:
    """TCP writes parts of frames, and there a change of threads matters less."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        channel = await connected(socket.create_connection(server.getsockname()))
        assert not written_in_thread(channel, FRAME)
        channel.abort()
        await asyncio.sleep(0)

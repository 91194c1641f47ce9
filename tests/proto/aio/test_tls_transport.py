"""TLS between a socket's transport and a channel, on both event loops."""

from __future__ import annotations

import asyncio
import os
import ssl
from itertools import count
from typing import TYPE_CHECKING, Any

import pytest

from proto.aio.process import new_event_loop
from proto.aio.read_budget import ReadBudget
from proto.aio.tls import client_context, server_context
from proto.aio.tls_transport import SHARE_RECORDS, Cipher, TlsTransport
from tests.certificates import Authority
from tests.seams.protocol import encrypt_apart, raw_transport

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine
    from pathlib import Path

DEADLINE_SEC = 30


class End(asyncio.BufferedProtocol):
    """One end of a connection; keeps what it receives and what happens."""

    def __init__(self, buffer_bytes: int = 100_000) -> None:
        self.received = bytearray()
        self.sizes: list[int] = []
        self.pauses = 0
        self.ended = False
        self.lost: asyncio.Future[Exception | None] = asyncio.get_running_loop().create_future()
        self.changed = asyncio.Event()
        self.transport: Any = None
        self.buffer = bytearray(buffer_bytes)

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.transport = transport

    def get_buffer(self, sizehint: int) -> memoryview:
        return memoryview(self.buffer)

    def buffer_updated(self, nbytes: int) -> None:
        self.received += self.buffer[:nbytes]
        self.sizes.append(nbytes)
        self.changed.set()

    def eof_received(self) -> None:
        self.ended = True
        self.transport.close()

    def pause_writing(self) -> None:
        self.pauses += 1
        self.changed.set()

    def resume_writing(self) -> None:
        self.changed.set()

    def connection_lost(self, exc: Exception | None) -> None:
        self.lost.set_result(exc)

    async def until(self, true: Callable[[], object]) -> None:
        while not true():
            self.changed.clear()
            await self.changed.wait()


@pytest.fixture(params=[asyncio.new_event_loop, new_event_loop], ids=["asyncio", "uvloop"])
def run(request: pytest.FixtureRequest, tmp_path: Path) -> Callable[..., None]:
    """Run a test with two connected ends, client and server, on one kind of loop."""
    authority = Authority(tmp_path)
    pair = authority.issue("127.0.0.1")

    def run(test: Callable[[End, End], Coroutine[Any, Any, None]], *, client: bool = True) -> None:
        async def main() -> None:
            loop = asyncio.get_running_loop()
            accepted: asyncio.Future[End] = loop.create_future()
            context = server_context(pair.certificate, pair.key, None)

            def accept() -> TlsTransport:
                accepted.set_result(End())
                return TlsTransport(accepted.result(), context, loop=loop)

            async with asyncio.timeout(DEADLINE_SEC):
                server = await loop.create_server(accept, "127.0.0.1", 0)
                host, port = server.sockets[0].getsockname()
                near = End()

                def connect() -> asyncio.BufferedProtocol:
                    if not client:
                        return near
                    return TlsTransport(near, client_context(authority.files()), loop=loop, host=host)

                await loop.create_connection(connect, host, port)
                far = await accepted
                try:
                    await test(near, far)
                finally:
                    near.transport.abort()
                    far.transport.abort()
                    await asyncio.gather(near.lost, far.lost)
                    server.close()

        with asyncio.Runner(loop_factory=request.param) as runner:
            runner.run(main())

    return run


def test_bytes_arrive_in_order_both_ways(run: Callable[..., None]) -> None:
    """Also what is written before the handshake is over, and more than a read, a record and a buffer."""

    async def test(near: End, far: End) -> None:
        first, rest = os.urandom(1000), os.urandom(1_000_000)
        near.transport.write(first)
        near.transport.writelines([rest[:10], rest[10:]])
        far.transport.write(rest)
        await far.until(lambda: len(far.received) == 1_001_000)
        await near.until(lambda: len(near.received) == 1_000_000)
        assert far.received == first + rest
        assert near.received == rest
        assert near.transport.get_extra_info("ssl_object").version() == "TLSv1.3"
        assert near.transport.get_extra_info("socket").fileno() >= 0

    run(test)


def test_a_pause_holds_decrypted_bytes_back(run: Callable[..., None]) -> None:
    """After a pause in the middle of a read nothing comes until reading goes on, and then everything."""

    async def test(near: End, far: End) -> None:
        original = far.buffer_updated

        def pause_once(nbytes: int) -> None:
            far.buffer_updated = original  # type: ignore[method-assign]
            far.transport.pause_reading()
            original(nbytes)

        far.buffer = bytearray(1000)
        far.buffer_updated = pause_once  # type: ignore[method-assign]
        near.transport.write(bytes(300_000))
        await far.until(lambda: far.sizes)
        for _ in range(20):
            await asyncio.sleep(0)
        assert len(far.received) == 1000
        far.transport.resume_reading()
        await far.until(lambda: len(far.received) == 300_000)

    run(test)


def test_the_end_of_the_stream_waits_for_a_channel_that_has_paused(run: Callable[..., None]) -> None:
    """What a channel keeps when it pauses is not discarded because the goodbye came in the same read."""

    async def test(near: End, far: End) -> None:
        update = far.buffer_updated

        def update_and_pause(nbytes: int) -> None:
            update(nbytes)
            far.transport.pause_reading()

        far.buffer_updated = update_and_pause  # type: ignore[method-assign]
        near.transport.write(b"last words")
        near.transport.close()
        await far.until(lambda: far.received)
        assert not far.ended
        far.transport.resume_reading()
        await far.lost
        assert far.ended

    run(test)


def test_an_error_of_the_channel_ends_the_connection(run: Callable[..., None]) -> None:
    """Also if it is raised when a paused channel goes on, where no event loop would close the socket."""

    async def test(near: End, far: End) -> None:
        asyncio.get_running_loop().set_exception_handler(lambda _loop, _context: None)
        far.buffer = bytearray(1)

        def pause_and_break_down(nbytes: int) -> None:
            assert nbytes == 1
            far.transport.pause_reading()
            far.buffer_updated = break_down  # type: ignore[method-assign]
            far.changed.set()

        def break_down(nbytes: int) -> None:
            raise MemoryError(nbytes)

        far.buffer_updated = pause_and_break_down  # type: ignore[method-assign]
        near.transport.write(b"xy")
        await far.until(lambda: far.buffer_updated is break_down)
        far.transport.resume_reading()
        await far.lost

    run(test)


def test_a_full_socket_pauses_the_writer(run: Callable[..., None]) -> None:
    """Writing pauses while the peer does not read, and what waits is counted; it all arrives in the end."""

    async def test(near: End, far: End) -> None:
        near.transport.set_write_buffer_limits(high=65_536, low=1)
        near.transport.write(b"hello")
        await far.until(lambda: far.received)
        far.transport.pause_reading()
        sent = 5
        while not near.pauses:
            near.transport.write(bytes(200_000))
            sent += 200_000
            await asyncio.sleep(0)
        assert near.transport.get_write_buffer_size() > 65_536
        far.transport.resume_reading()
        await far.until(lambda: len(far.received) == sent)
        await near.until(lambda: not near.transport.get_write_buffer_size())

    run(test)


def test_tiny_records_wait_for_later_turns(run: Callable[..., None]) -> None:
    """Case 54: a read full of one-byte records is decrypted a share at a time; nothing of it is lost."""

    async def test(near: End, far: End) -> None:
        near.transport.write(b"hello")
        await far.until(lambda: far.received)
        loop, turns = asyncio.get_running_loop(), [0]

        def turn() -> None:
            turns.append(0)
            if not far.lost.done():
                loop.call_soon(turn)

        update = far.buffer_updated

        def count_and_update(nbytes: int) -> None:
            turns[-1] += nbytes
            update(nbytes)

        far.buffer_updated = count_and_update  # type: ignore[method-assign]
        text = os.urandom(5 * SHARE_RECORDS)
        records = encrypt_apart(near.transport, text)
        turn()
        raw_transport(near.transport).write(records)
        await far.until(lambda: len(far.received) == 5 + len(text))
        assert far.received == b"hello" + text
        assert max(turns) < 2 * SHARE_RECORDS  # a loop may read twice in a turn
        near.transport.close()
        await far.lost
        assert far.ended

    run(test)


def test_close_sends_everything_first(run: Callable[..., None]) -> None:
    """Also during the handshake; the peer sees an orderly end."""

    async def test(near: End, far: End) -> None:
        near.transport.write(bytes(500_000))
        near.transport.close()
        assert near.transport.is_closing()
        near.transport.write(b"too late")
        assert await far.lost is None
        assert len(far.received) == 500_000
        assert far.ended

    run(test)


def test_close_during_the_handshake_does_not_wait_for_it(run: Callable[..., None]) -> None:
    """If nothing was written there is nothing to send first: the peer here never answers."""

    async def test(near: End, far: End) -> None:
        far.transport.close()
        assert await far.lost is None
        assert not near.received

    run(test, client=False)


def test_a_handshake_that_fails_ends_the_connection_with_the_reason(run: Callable[..., None]) -> None:
    """The channel's connection is lost with the error of TLS, and the peer has got an alert."""

    async def test(near: End, far: End) -> None:
        near.transport.write(b"GET / HTTP/1.1\r\n\r\n")
        assert isinstance(await far.lost, ssl.SSLError)
        assert far.received == b""
        await near.lost

    run(test, client=False)


def test_corrupted_records_end_the_connection(run: Callable[..., None]) -> None:
    """Bytes that somebody has put into the stream are not passed on."""

    async def test(near: End, far: End) -> None:
        near.transport.write(b"hello")
        await far.until(lambda: far.received)
        raw_transport(near.transport).write(b"\x17\x03\x03\x00\x20" + bytes(32))
        assert isinstance(await far.lost, ssl.SSLError)
        assert isinstance(await near.lost, ssl.SSLError)  # the alert says so
        assert far.received == b"hello"

    run(test)


def test_a_part_of_a_record_is_no_input(tmp_path: Path) -> None:
    """Or a loop turn after the other would try to decrypt it until the rest is there."""
    authority = Authority(tmp_path)
    pair = authority.issue("127.0.0.1")
    ends = (
        Cipher(server_context(pair.certificate, pair.key, None), None, None, None),
        Cipher(client_context(authority.files()), "127.0.0.1", None, None),
    )
    server, client = ends
    for _ in range(3):
        for one, other in ((client, server), (server, client)):
            one.handshake()
            other.receive(memoryview(one.pop_output()))
    client.encrypt(b"text")
    record = client.pop_output()
    server.receive(memoryview(record[:-1]))
    buffer = memoryview(bytearray(100))
    assert server.has_input
    assert server.decrypt(buffer) == 0
    assert not server.has_input
    server.receive(memoryview(record[-1:]))
    assert server.decrypt(buffer) == 4


class Wire(asyncio.Transport):
    """The socket's transport of a broker's end: keeps what is written, and whether reading is paused."""

    def __init__(self) -> None:
        super().__init__()
        self.written = b""
        self.paused = False

    def write(self, data: Any) -> None:
        self.written += data

    def pause_reading(self) -> None:
        self.paused = True

    def resume_reading(self) -> None:
        self.paused = False

    def is_closing(self) -> bool:
        return False


async def test_handshakes_share_the_budget_of_a_loop_turn(tmp_path: Path) -> None:
    """Of ten at once that cost 3 ms each, four are answered in a loop turn; the others wait."""
    authority = Authority(tmp_path)
    pair = authority.issue("127.0.0.1")
    context = server_context(pair.certificate, pair.key, None)
    times = count(0.0, 0.003)
    loop = asyncio.get_running_loop()
    budget = ReadBudget(loop, lambda: next(times))
    hello = ssl.MemoryBIO()
    client = client_context(authority.files()).wrap_bio(ssl.MemoryBIO(), hello, server_hostname="127.0.0.1")
    with pytest.raises(ssl.SSLWantReadError):
        client.do_handshake()
    greeting = hello.read()
    wires: list[Wire] = []
    for _ in range(10):
        wire = Wire()
        wires.append(wire)
        transport = TlsTransport(End(), context, loop=loop, budget=budget)
        transport.connection_made(wire)
        transport.get_buffer(-1)[: len(greeting)] = greeting
        transport.buffer_updated(len(greeting))
    answered = []
    for _ in range(3):
        answered.append(sum(bool(wire.written) for wire in wires))
        assert sum(wire.paused for wire in wires) == 10 - answered[-1]
        await asyncio.sleep(0)
    assert answered == [4, 8, 10]

"""The in-memory network keeps bytes in order and breaks connections as kernels do."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, cast

import pytest

from tests.simulation.loop import SimulatedLoop, simulate
from tests.simulation.network import BROKER, LinkFaults, MemoryTransport, on_host

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

SEEDS = range(5)


class Recorder(asyncio.BufferedProtocol):
    """Keeps everything that a transport tells it."""

    def __init__(self) -> None:
        self.received = bytearray()
        self.reads: list[int] = []
        self.calls: list[str] = []
        self.lost: list[Exception | None] = []
        self._buffer = bytearray(100_000)
        self.transport: MemoryTransport

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.transport = cast("MemoryTransport", transport)

    def get_buffer(self, sizehint: int) -> bytearray:
        return self._buffer

    def buffer_updated(self, nbytes: int) -> None:
        self.reads.append(nbytes)
        self.received += self._buffer[:nbytes]

    def pause_writing(self) -> None:
        self.calls.append("pause")

    def resume_writing(self) -> None:
        self.calls.append("resume")

    def eof_received(self) -> bool:
        self.calls.append("eof")
        return False

    def connection_lost(self, exc: Exception | None) -> None:
        self.lost.append(exc)


def connected(body: Callable[[SimulatedLoop, Recorder, Recorder], Awaitable[None]], seed: int = 0) -> str:
    """Run `body(loop, client, server)` over one connection; return the history's hash."""

    async def main(loop: SimulatedLoop) -> str:
        server, client = Recorder(), Recorder()
        with on_host(BROKER):
            listener = await loop.create_server(lambda: server, "127.0.0.1", 7)
        with on_host("client"):
            await loop.create_connection(lambda: client, "127.0.0.1", 7)
        await asyncio.sleep(0)
        await body(loop, client, server)
        loop.network.heal()
        client.transport.abort()
        listener.close()
        await listener.wait_closed()
        assert not loop.network.open
        return loop.network.digest

    return simulate(main, seed)


@pytest.mark.parametrize("seed", SEEDS)
def test_bytes_arrive_in_order_however_they_are_cut(seed: int) -> None:
    """All bytes arrive, in segments of other sizes."""
    sent = bytes(range(256)) * 500

    async def body(loop: SimulatedLoop, client: Recorder, server: Recorder) -> None:
        for start in range(0, len(sent), 1000):
            client.transport.write(sent[start : start + 1000])
        await asyncio.sleep(10)
        assert server.received == sent
        assert set(server.reads) != {1000}

    connected(body, seed)


def test_the_same_seed_gives_the_same_history() -> None:
    """Histories differ with the seed only."""

    async def body(loop: SimulatedLoop, client: Recorder, server: Recorder) -> None:
        for _ in range(100):
            client.transport.write(b"x" * 100)
            await asyncio.sleep(0.0001)
        await asyncio.sleep(1)

    assert connected(body, 1) == connected(body, 1)
    assert connected(body, 1) != connected(body, 2)


def test_a_reader_that_does_not_read_pauses_the_writer() -> None:
    """Behind a full window the write buffer grows to its limit, and drains when the reader continues."""

    async def body(loop: SimulatedLoop, client: Recorder, server: Recorder) -> None:
        server.transport.pause_reading()
        client.transport.set_write_buffer_limits(high=1000, low=100)
        client.transport.write(b"x" * 500_000)
        await asyncio.sleep(5)
        assert client.calls == ["pause"]
        assert not server.received
        server.transport.resume_reading()
        await asyncio.sleep(5)
        assert client.calls == ["pause", "resume"]
        assert len(server.received) == 500_000

    connected(body)


def test_close_sends_what_is_buffered_first() -> None:
    """The peer reads everything and then the end; both sides are notified of the end once."""

    async def body(loop: SimulatedLoop, client: Recorder, server: Recorder) -> None:
        client.transport.write(b"x" * 500_000)
        client.transport.close()
        assert client.transport.is_closing()
        assert not client.lost
        await asyncio.sleep(5)
        assert len(server.received) == 500_000
        assert server.calls == ["eof"]
        assert client.lost == server.lost == [None]

    connected(body)


def test_abort_throws_the_buffer_away() -> None:
    """Bytes that the kernel had accepted still arrive, the others do not."""

    async def body(loop: SimulatedLoop, client: Recorder, server: Recorder) -> None:
        client.transport.write(b"x" * 500_000)
        client.transport.abort()
        await asyncio.sleep(5)
        assert 0 < len(server.received) < 500_000
        assert client.lost == server.lost == [None]

    connected(body)


def test_writing_to_a_closed_peer_is_answered_with_a_reset() -> None:
    """A half-closed connection ends as it does with a kernel."""

    async def body(loop: SimulatedLoop, client: Recorder, server: Recorder) -> None:
        loop.network.block(BROKER, "client")
        server.transport.close()
        client.transport.write(b"are you there?")
        await asyncio.sleep(5)
        assert not client.lost
        loop.network.heal()
        await asyncio.sleep(5)
        assert client.lost

    connected(body)


def test_a_black_hole_holds_one_direction() -> None:
    """Blocked bytes arrive in order after healing; the other direction is not affected."""

    async def body(loop: SimulatedLoop, client: Recorder, server: Recorder) -> None:
        loop.network.block("client", BROKER)
        client.transport.write(b"up")
        server.transport.write(b"down")
        await asyncio.sleep(60)
        assert (bytes(server.received), bytes(client.received)) == (b"", b"down")
        loop.network.heal()
        client.transport.write(b", late")
        await asyncio.sleep(1)
        assert server.received == b"up, late"

    connected(body)


def test_a_dropped_connection_is_reset_on_both_sides() -> None:
    """Both ends lose the connection with an error."""

    async def body(loop: SimulatedLoop, client: Recorder, server: Recorder) -> None:
        loop.network.drop("client")
        await asyncio.sleep(1)
        assert isinstance(client.lost[0], ConnectionResetError)
        assert isinstance(server.lost[0], ConnectionResetError)

    connected(body)


def test_a_dead_host_refuses_and_cannot_connect() -> None:
    """After a crash connections are refused until a process listens there again."""

    async def body(loop: SimulatedLoop, client: Recorder, server: Recorder) -> None:
        loop.network.crash(BROKER)
        with on_host("client"), pytest.raises(ConnectionRefusedError):
            await loop.create_connection(Recorder, "127.0.0.1", 7)
        with on_host(BROKER):
            again = await loop.create_server(Recorder, "127.0.0.1", 7)
        with on_host("client"):
            transport, _ = await loop.create_connection(Recorder, "127.0.0.1", 7)
        transport.abort()
        again.close()
        await asyncio.sleep(1)

    connected(body)


def test_a_partition_holds_new_connections_too() -> None:
    """Connecting through a partition waits until it is healed."""

    async def body(loop: SimulatedLoop, client: Recorder, server: Recorder) -> None:
        loop.network.partition("client")
        with on_host("client"), pytest.raises(TimeoutError):
            async with asyncio.timeout(5):
                await loop.create_connection(Recorder, "127.0.0.1", 7)

    connected(body)


def test_a_slow_reader_reads_at_its_pace() -> None:
    """Bytes arrive no faster than the reader takes them."""

    async def body(loop: SimulatedLoop, client: Recorder, server: Recorder) -> None:
        loop.network.slow_down(BROKER, read=100, pause=0.1)
        client.transport.write(b"x" * 10_000)
        await asyncio.sleep(1)
        assert len(server.received) <= 1200
        loop.network.heal()
        await asyncio.sleep(1)
        assert len(server.received) == 10_000

    connected(body)


def test_a_connection_that_nobody_accepts_is_reset_and_its_bytes_are_nobodys() -> None:
    """Its bytes have arrived at a frozen host whose listener closes when it continues."""

    async def main(loop: SimulatedLoop) -> None:
        server, client = Recorder(), Recorder()
        with on_host(BROKER):
            listener = await loop.create_server(lambda: server, "127.0.0.1", 7)
        loop.freeze(BROKER)
        with on_host("client"):
            await loop.create_connection(lambda: client, "127.0.0.1", 7)
        client.transport.write(b"early")
        await asyncio.sleep(5)
        listener.close()
        loop.thaw(BROKER)
        await asyncio.sleep(5)
        assert not server.received
        assert [type(error) for error in client.lost] == [ConnectionResetError]
        await listener.wait_closed()

    simulate(main, 0)


def test_bytes_may_be_cut_anywhere() -> None:
    """The simulated link decides the size of segments."""

    async def body(loop: SimulatedLoop, client: Recorder, server: Recorder) -> None:
        for pipe in loop.network.pipes:
            pipe.link_faults = LinkFaults(segment=3, read=2)
        client.transport.write(b"x" * 1000)
        await asyncio.sleep(5)
        assert len(server.received) == 1000
        assert max(server.reads) <= 2

    connected(body)

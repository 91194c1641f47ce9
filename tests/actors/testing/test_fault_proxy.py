"""Each fault against a plain echo server, and against a real broker with a node behind the proxy."""

from __future__ import annotations

import asyncio
import socket
import struct
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING

import pytest

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int64
from actors.testing import Direction, FaultProxy
from actors.testing.pipe import HELD_BYTES
from broker import Broker, BrokerOptions
from tests.actors.meeting import DEADLINE_SEC, matched, until
from tests.ports import held_port
from tests.seams.limits import set_limits

if TYPE_CHECKING:
    from collections.abc import AsyncIterator
    from pathlib import Path

    from tests.actors.meeting import Meeting

KEEP_ALL = actors.QoSProfile(history=actors.HistoryPolicy.KEEP_ALL)
LARGE = 16 * 1024 * 1024


class Echo:
    """A server that sends back what it gets, and remembers how its connections ended."""

    def __init__(self) -> None:
        self.received = 0
        self.ends: list[str] = []
        self.url = ""

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Echo until the end."""
        try:
            while data := await reader.read(65_536):
                self.received += len(data)
                writer.write(data)
                await writer.drain()
            self.ends.append("end")
        except ConnectionError:
            self.ends.append("reset")
        finally:
            writer.close()


@pytest.fixture
async def echo() -> AsyncIterator[Echo]:
    """A running echo server."""
    served = Echo()
    server = await asyncio.start_server(served.serve, "127.0.0.1", 0)
    async with server:
        served.url = f"callboard://127.0.0.1:{server.sockets[0].getsockname()[1]}"
        yield served


@pytest.fixture
async def proxy(echo: Echo) -> AsyncIterator[FaultProxy]:
    """A proxy before the echo server; no task is left when it and the ends of its connections have gone."""
    before = asyncio.all_tasks()
    async with FaultProxy(echo.url) as running:
        yield running
    await until(lambda: not asyncio.all_tasks() - before - {asyncio.current_task()})


@asynccontextmanager
async def dialled(proxy: FaultProxy) -> AsyncIterator[tuple[asyncio.StreamReader, asyncio.StreamWriter]]:
    """Connect through the proxy."""
    async with asyncio.timeout(DEADLINE_SEC):
        reader, writer = await asyncio.open_connection("127.0.0.1", int(proxy.url.rsplit(":", 1)[1]))
        try:
            yield reader, writer
        finally:
            writer.close()


async def test_it_passes_everything_on(echo: Echo, proxy: FaultProxy) -> None:
    """Without faults bytes come back as they were sent, and are counted each way."""
    sent = bytes(range(256)) * 1000
    async with dialled(proxy) as (reader, writer):
        writer.write(sent)
        assert await reader.readexactly(len(sent)) == sent
        await proxy.wait_until(lambda: proxy.forwarded_bytes() == 2 * len(sent))
        assert proxy.forwarded_bytes(Direction.TO_BROKER) == proxy.forwarded_bytes(Direction.TO_NODE)
        assert [each.number for each in proxy.connections] == [1]
        writer.write_eof()
        assert await reader.read() == b""
    await proxy.wait_until(lambda: not proxy.connections)
    assert echo.ends == ["end"]
    assert (proxy.accepted, proxy.refused, proxy.resets) == (1, 0, 0)
    assert proxy.forwarded_bytes() == 2 * len(sent)


async def test_a_delay_delays_and_keeps_the_order(proxy: FaultProxy) -> None:
    """Bytes come back no earlier than both directions' delays say, in order in spite of the jitter."""
    loop = asyncio.get_running_loop()
    proxy.delay(0.05, jitter_sec=0.05)
    async with dialled(proxy) as (reader, writer):
        start = loop.time()
        for i in range(100):
            writer.write(bytes([i]))
            await asyncio.sleep(0)
        assert await reader.readexactly(100) == bytes(range(100))
        assert loop.time() - start >= 0.099


async def test_a_healed_delay_lets_go_at_once_what_it_held(proxy: FaultProxy) -> None:
    """What waited for an hour arrives when the delay ends."""
    async with dialled(proxy) as (reader, writer):
        proxy.delay(3600, direction=Direction.TO_NODE)
        writer.write(b"held")
        await proxy.wait_until(lambda: proxy.forwarded_bytes(Direction.TO_BROKER) == 4)
        proxy.heal()
        assert await reader.readexactly(4) == b"held"


async def test_a_drip_lets_little_through_at_a_time(proxy: FaultProxy) -> None:
    """Five bytes, two at a time, need three drops: two pauses at least."""
    loop = asyncio.get_running_loop()
    proxy.drip(2, every_sec=0.05, direction=Direction.TO_NODE)
    async with dialled(proxy) as (reader, writer):
        start = loop.time()
        writer.write(b"hello")
        assert await reader.readexactly(5) == b"hello"
        assert loop.time() - start >= 0.099


async def test_a_black_hole_holds_little_and_loses_nothing(echo: Echo, proxy: FaultProxy) -> None:
    """The sender is pushed back, the proxy holds no more than it says, and healing brings everything."""
    sent = bytes(LARGE)
    async with dialled(proxy) as (reader, writer):
        writer.write(b"x")
        assert await reader.readexactly(1) == b"x"
        proxy.black_hole()
        writer.write(sent)
        drained = asyncio.create_task(writer.drain())
        (connection,) = proxy.connections
        await proxy_rests(proxy)
        assert not drained.done()
        assert connection.held_bytes(Direction.TO_BROKER) <= HELD_BYTES
        assert echo.received == 1
        proxy.heal()
        assert await reader.readexactly(LARGE) == sent
        await drained


async def proxy_rests(proxy: FaultProxy) -> None:
    """Let the loop turn until the proxy has read what it will."""
    for _ in range(50):
        await asyncio.sleep(0)


async def test_what_nobody_reads_is_held_within_the_limit(proxy: FaultProxy) -> None:
    """A delay, too, holds no more than the limit: the sender waits."""
    proxy.delay(3600)
    async with dialled(proxy) as (_, writer):
        writer.write(bytes(LARGE))
        await proxy.wait_until(lambda: proxy.connections and proxy.connections[0].held_bytes() == HELD_BYTES)
        await proxy_rests(proxy)
        assert proxy.connections[0].held_bytes() == HELD_BYTES


async def test_a_reset_reaches_both_sides(echo: Echo, proxy: FaultProxy) -> None:
    """Reading ends with the error of a reset, not with the end of the stream."""
    async with dialled(proxy) as (reader, writer):
        writer.write(b"x")
        await reader.readexactly(1)
        proxy.reset()
        with pytest.raises(ConnectionResetError):
            await reader.read(1)
    await until(lambda: echo.ends)
    assert echo.ends == ["reset"]
    assert proxy.resets == 1
    assert not proxy.connections


async def test_a_reset_of_a_connection_that_has_just_come(proxy: FaultProxy) -> None:
    """Cut before it is carried any further, it is closed all the same."""
    async with dialled(proxy) as (reader, _):
        await proxy.wait_until(lambda: proxy.connections)
        proxy.reset()
        with pytest.raises(ConnectionResetError):
            await reader.read(1)
    assert proxy.resets == 1


async def test_a_peer_s_own_reset_is_passed_on(echo: Echo, proxy: FaultProxy) -> None:
    """What one side breaks is broken for the other, and is not counted as the proxy's doing."""
    async with dialled(proxy) as (reader, writer):
        writer.write(b"x")
        await reader.readexactly(1)
        sock = writer.get_extra_info("socket")
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        writer.transport.abort()
        await until(lambda: echo.ends)
    assert echo.ends == ["reset"]
    await proxy.wait_until(lambda: not proxy.connections)
    assert proxy.resets == 0


async def test_more_connections_than_it_takes_are_refused(
    proxy: FaultProxy, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whom a black hole makes try again and again cannot use up the process's descriptors."""
    set_limits(monkeypatch, proxied_connections=1)
    async with dialled(proxy) as (reader, writer), dialled(proxy) as (refused, _):
        with pytest.raises(ConnectionResetError):
            await refused.read(1)
        writer.write(b"x")
        assert await reader.readexactly(1) == b"x"
    assert (proxy.accepted, proxy.refused) == (1, 1)


async def test_a_half_close_ends_one_direction_after_what_is_under_way(echo: Echo, proxy: FaultProxy) -> None:
    """The node reads what was held and then the end; what it sends still arrives."""
    async with dialled(proxy) as (reader, writer):
        proxy.delay(3600, direction=Direction.TO_NODE)
        writer.write(b"held")
        await proxy.wait_until(lambda: proxy.connections[0].held_bytes(Direction.TO_NODE) == 4)
        proxy.half_close(direction=Direction.TO_NODE)
        proxy.heal()
        assert await reader.read() == b"held"
        writer.write(b"more")
        await until(lambda: echo.received == 8)
        assert not echo.ends
        writer.write_eof()
        await proxy.wait_until(lambda: not proxy.connections)
    assert echo.ends == ["end"]


async def test_refused_connections_are_reset_and_the_others_stay(proxy: FaultProxy) -> None:
    """`refuse` is about new connections, until it is healed."""
    async with dialled(proxy) as (reader, writer):
        writer.write(b"x")
        await reader.readexactly(1)
        proxy.refuse()
        async with dialled(proxy) as (refused, _):
            with pytest.raises(ConnectionResetError):
                await refused.read(1)
        writer.write(b"y")
        assert await reader.readexactly(1) == b"y"
        proxy.heal()
        async with dialled(proxy) as (third, again):
            again.write(b"z")
            assert await third.readexactly(1) == b"z"
    assert (proxy.accepted, proxy.refused) == (2, 1)


async def test_without_a_broker_behind_it_connections_are_refused() -> None:
    """The target need not be there; who connects meanwhile is cut off, and counted."""
    with held_port() as port:
        async with FaultProxy(f"callboard://127.0.0.1:{port}") as proxy, dialled(proxy) as (reader, _):
            with pytest.raises(ConnectionResetError):
                await reader.read(1)
            await proxy.wait_until(lambda: not proxy.connections)
            assert (proxy.accepted, proxy.refused, proxy.resets) == (0, 1, 0)


async def test_one_connection_s_faults_are_its_own(proxy: FaultProxy) -> None:
    """What holds one connection up lets the other's bytes through."""
    async with dialled(proxy) as (stuck, first), dialled(proxy) as (reader, second):
        await proxy.wait_until(lambda: len(proxy.connections) == 2)
        proxy.connections[0].black_hole()
        first.write(b"held")
        second.write(b"x")
        assert await reader.readexactly(1) == b"x"
        assert proxy.connections[0].forwarded_bytes() == 0
        proxy.connections[0].heal()
        assert await stuck.readexactly(4) == b"held"


async def test_leaving_closes_what_is_open(echo: Echo) -> None:
    """Both sides see the end, also behind a black hole, and the place is free."""
    async with FaultProxy(echo.url) as proxy, dialled(proxy) as (reader, writer):
        url = proxy.url
        proxy.black_hole()
        writer.write(b"held")
        await proxy.wait_until(lambda: proxy.connections)
        await proxy.__aexit__(None, None, None)
        with pytest.raises((ConnectionResetError, asyncio.IncompleteReadError)):
            await reader.readexactly(1)
        with pytest.raises(ConnectionRefusedError):
            await asyncio.open_connection("127.0.0.1", int(url.rsplit(":", 1)[1]))
        with pytest.raises(RuntimeError, match="not listening"):
            _ = proxy.url
        await proxy.__aenter__()  # it can be used again


async def test_what_makes_no_sense_is_refused(proxy: FaultProxy) -> None:
    """Times and sizes are checked, and a proxy listens once at a time."""
    with pytest.raises(ValueError, match="negative"):
        proxy.delay(-1)
    with pytest.raises(ValueError, match="Cannot drip"):
        proxy.drip(0, every_sec=1)
    with pytest.raises(RuntimeError, match="already"):
        await proxy.__aenter__()
    with pytest.raises(actors.InvalidUrlError):
        FaultProxy("http://127.0.0.1")


async def test_a_condition_that_does_not_come_true_ends_the_wait(proxy: FaultProxy) -> None:
    """`wait_until` has a limit."""
    with pytest.raises(actors.WaitTimeout):
        await proxy.wait_until(lambda: False, timeout_sec=0.01)


# With a broker and nodes


@pytest.fixture
async def far(meeting: Meeting) -> AsyncIterator[FaultProxy]:
    """A proxy before the meeting's broker."""
    async with FaultProxy(meeting.url) as running:
        yield running


async def test_a_node_comes_back_after_a_reset(meeting: Meeting, far: FaultProxy) -> None:
    """Its call in flight fails at once, it connects again, and what it has is there again."""
    async with actors.Node("far", url=far.url) as node:
        client = node.create_client(AddTwoInts, "add")
        never = asyncio.Event()

        async def wait_for_ever(request: AddTwoInts.Request) -> AddTwoInts.Response:
            await never.wait()
            return AddTwoInts.Response(sum=request.a)

        server = await meeting.node("server")
        server.create_service(AddTwoInts, "add", wait_for_ever, concurrent=True)
        assert await client.wait_for_service(timeout_sec=DEADLINE_SEC)
        call = client.call_async(AddTwoInts.Request(a=1, b=2))
        await meeting.settled(server)
        far.reset()
        with pytest.raises(actors.ServiceUnavailable):
            await call
        never.set()
        assert await client.wait_for_service(timeout_sec=DEADLINE_SEC)
        assert (await client.call(AddTwoInts.Request(a=5, b=2))).sum == 5
    assert far.resets == 1
    assert far.accepted >= 2


async def test_a_black_hole_shorter_than_the_keepalive_loses_nothing(
    meeting: Meeting, far: FaultProxy
) -> None:
    """Everything published into it arrives when it heals, on the same connection."""
    await meeting.restart_broker(keepalive_sec=1000)  # longer than any stall of this machine
    received: list[int] = []
    async with actors.Node("far", url=far.url) as node:
        node.create_subscription(Int64, "numbers", lambda msg: received.append(msg.data), KEEP_ALL)
        talker = await meeting.node("talker")
        publisher = talker.create_publisher(Int64, "numbers", KEEP_ALL)
        await matched(publisher)
        far.black_hole()
        for i in range(1000):
            publisher.publish(Int64(data=i))
        await meeting.settled(talker)
        assert not received
        far.heal()
        await until(lambda: len(received) == 1000)
    assert received == list(range(1000))
    assert far.accepted == 1


async def test_frames_that_drip_in_are_put_together(meeting: Meeting, far: FaultProxy) -> None:
    """However the stream is torn, messages arrive whole and in order."""
    received: list[int] = []
    far.drip(7, every_sec=0)
    async with actors.Node("far", url=far.url) as node:
        node.create_subscription(Int64, "numbers", lambda msg: received.append(msg.data), KEEP_ALL)
        talker = await meeting.node("talker")
        publisher = talker.create_publisher(Int64, "numbers", KEEP_ALL)
        await matched(publisher)
        for i in range(200):
            publisher.publish(Int64(data=i))
        await until(lambda: len(received) == 200)
    assert received == list(range(200))


@pytest.mark.parametrize("direction", [Direction.TO_BROKER, Direction.TO_NODE])
async def test_a_half_closed_link_ends_and_is_made_again(
    meeting: Meeting, far: FaultProxy, direction: Direction
) -> None:
    """A link with one direction is of no use: whichever side reads the end, the node connects again."""
    async with actors.Node("far", url=far.url) as node:
        await until(lambda: node.connected)
        far.half_close(direction=direction)
        await far.wait_until(lambda: far.accepted == 2)
        await until(lambda: node.connected)
        assert "/far" in await node.get_fully_qualified_node_names()
        await far.wait_until(lambda: len(far.connections) == 1)


async def test_a_refused_node_tries_until_it_is_let_in(meeting: Meeting, far: FaultProxy) -> None:
    """It goes on trying, and is there when the proxy lets it through."""
    far.refuse()
    async with actors.Node("far", url=far.url) as node:
        await far.wait_until(lambda: far.refused >= 3)
        assert not node.connected
        far.heal()
        await until(lambda: node.connected)
    assert far.accepted == 1


async def test_a_silent_broker_is_left_for_a_new_link() -> None:
    """A black hole longer than the keepalive: the node gives the link up, and comes back when it heals."""
    async with (
        Broker(BrokerOptions(port=0, keepalive_sec=0.3)) as hub,
        FaultProxy(hub.url) as proxy,
        actors.Node("far", url=proxy.url) as node,
    ):
        client = node.create_client(AddTwoInts, "add")
        await until(lambda: node.connected)
        proxy.connections[0].black_hole()
        with pytest.raises(actors.ServiceUnavailable):
            await client.call(AddTwoInts.Request(), timeout_sec=60)
        await until(lambda: node.connected)
        assert proxy.accepted >= 2


async def test_a_broker_on_a_unix_socket(tmp_path: Path) -> None:
    """The proxy has a TCP port also before a unix socket; a reset reaches the node as one."""
    path = tmp_path / "broker"
    async with (
        Broker(BrokerOptions(unix=path)),
        FaultProxy(f"callboard+unix://{path}") as proxy,
        actors.Node("far", url=proxy.url) as node,
    ):
        await until(lambda: node.connected)
        proxy.reset()
        await proxy.wait_until(lambda: proxy.accepted == 2)
        await until(lambda: node.connected)
        assert await node.get_fully_qualified_node_names() == ["/far"]

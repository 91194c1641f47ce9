"""The broker over real sockets: listening, sessions, keepalive, limits, stopping."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from typing import TYPE_CHECKING, Any

import pytest

from broker import AddressInUseError, Broker, BrokerOptions, InvalidOptionError, ListenError
from broker.serving.periodic_check import PeriodicCheck
from proto import limits
from proto.errors import ErrorCode
from proto.loop_lag import LoopLag
from proto.wire import frames
from proto.wire.codec import encode
from proto.wire.identity import VERSION
from proto.wire.url import parse_url
from tests.broker import frame_makers as make
from tests.broker.rawclient import DEADLINE_SEC, RawClient, hello, link, read_error, stream, until

if TYPE_CHECKING:
    from collections.abc import AsyncIterator
    from pathlib import Path

    from broker.serving.link import Link

QUICK = BrokerOptions(port=0, keepalive_sec=0.3, idle_keepalive_sec=0.3, drain_timeout_sec=0.2)


@pytest.fixture
async def broker() -> AsyncIterator[Broker]:
    """A broker on a free port."""
    async with Broker(BrokerOptions(port=0, drain_timeout_sec=0.2)) as running:
        yield running


async def test_messages_and_calls_go_through(broker: Broker) -> None:
    """Declare, publish and receive; call and answer."""
    async with link(broker, "/a") as a, link(broker, "/b") as b:
        b.send(make.subscription(1), make.service(2))
        await b.synchronise()
        a.send(make.publisher(1), make.client(2))
        number = (await a.next(frames.Accepted)).number
        a.send(make.batch(number, 0, 3))
        assert (await b.next(frames.Batch)).length == 3
        a.send(make.request(2, 9))
        (entry,) = (await b.next(frames.Request)).entries
        b.send(make.reply(2, entry.call))
        assert (await a.next(frames.Reply)).entries[0].call == 9
        stats = broker.stats()
        assert (stats.connections, stats.copies, stats.delivered, stats.queued) == (2, 3, 3, 0)


async def test_welcome_says_who_and_how(broker: Broker) -> None:
    """The answer to HELLO has the broker's instance, a session number and the limits that hold."""
    async with RawClient().connected(broker) as one, RawClient().connected(broker) as two:
        one.send(hello(keepalive_ms=500))
        two.send(hello())
        first, second = await one.next(frames.Welcome), await two.next(frames.Welcome)
        assert first.options["broker"] == second.options["broker"]
        assert first.options["session"] != second.options["session"]
        assert first.options["max_message_bytes"] == limits.MAX_MESSAGE_BYTES
        assert type(first.options["keepalive_ms"]) is int
        assert first.options["agent"] == f"callboard-broker/{VERSION}"
        assert type(first.options["wall_time_ns"]) is int


async def test_domains_are_disjoint(broker: Broker) -> None:
    """The same node name and topic in two domains never meet."""
    async with link(broker, "/n", domain=1) as one, link(broker, "/n", domain=2) as two:
        one.send(make.subscription(1))
        await one.synchronise()
        two.send(make.publisher(1))
        number = (await two.next(frames.Accepted)).number
        two.send(make.batch(number, 0))
        await two.synchronise()
        await one.synchronise()
        assert broker.stats().unmatched == 1


async def test_a_reconnecting_client_takes_over(broker: Broker) -> None:
    """Case 24: the same instance and token closes the old link with a reason, and gets its name."""
    async with (
        link(broker, "/n", instance=b"i" * 16, token=b"t" * 16) as old,
        link(broker, "/n", instance=b"i" * 16, token=b"t" * 16),
    ):
        assert (await old.next(frames.Error)).code == ErrorCode.TAKEN_OVER
        await old.gone()


async def test_a_large_message_passes_in_fragments_and_holds_up_nobody(broker: Broker) -> None:
    """16 MiB go through whole, while a call overtakes them."""
    async with link(broker, "/a") as a, link(broker, "/b") as b:
        b.send(make.subscription(1))
        await b.synchronise()
        a.send(make.publisher(1))
        number = (await a.next(frames.Accepted)).number
        a.send(make.batch(number, 0, 1, size=2**24))
        await a.synchronise()
        batch = await b.next(frames.Batch)
        assert len(batch.payload) == 2**24 + 5


async def test_the_size_limit_is_exact_for_a_request() -> None:
    """A request of just the size that is allowed reaches its server or ends; the server's link stays."""
    most = 2 * limits.MAX_FRAME_BYTES
    async with Broker(BrokerOptions(port=0, max_message_bytes=most, drain_timeout_sec=0.2)) as small:
        server = RawClient(max_message_bytes=most)
        async with server.connected(small), link(small, "/asker") as asker:
            server.send(hello(), frames.Node(0, "/server"), make.service(1))
            await server.next(frames.Welcome)
            # The broker's id of a later call is longer than the caller's own.
            asker.send(make.client(1))
            await asker.next(frames.Matched)
            asker.send(make.request(1, *range(1000, 1200)))
            await asker.synchronise()
            await server.synchronise()
            overhead = len(encode(make.request(1, 127, body=bytes(most)))) - most
            server.waiting(frames.Request)
            asker.send(make.request(1, 127, body=bytes(most - overhead)))
            ends = [
                asyncio.ensure_future(end) for end in (server.next(frames.Request), asker.next(frames.Reply))
            ]
            await asyncio.wait(ends, return_when=asyncio.FIRST_COMPLETED)
            for waiting in ends:
                waiting.cancel()
            assert server.problem is None


async def test_a_silent_client_is_suspended_and_its_next_bytes_restore_it() -> None:
    """Case 35: it leaves the graph, its callers get an error, and it returns with its next bytes."""
    async with Broker(QUICK) as quick, link(quick, "/viewer") as viewer:
        beat = asyncio.create_task(keep_alive(viewer))
        async with link(quick, "/frozen") as frozen:
            frozen.stop_reading()
            viewer.send(frames.Watch(1, keep=True))
            while not any((await viewer.next(frames.Graph)).removed):
                pass
            frozen.go_on_reading()
            frozen.send(frames.Pong(0))
            while not [entry for entry in (await viewer.next(frames.Graph)).added if entry.node == "/frozen"]:
                pass
        beat.cancel()


async def test_a_ping_alone_restores_a_suspended_client() -> None:
    """Any bytes count as life, also those that the channel answers by itself."""
    async with Broker(QUICK) as quick, link(quick, "/viewer") as viewer:
        beat = asyncio.create_task(keep_alive(viewer))
        async with link(quick, "/frozen") as frozen:
            frozen.stop_reading()
            viewer.send(frames.Watch(1, keep=True))
            while not any((await viewer.next(frames.Graph)).removed):
                pass
            frozen.send(frames.Ping(5))
            async with asyncio.timeout(DEADLINE_SEC):
                while not (await viewer.next(frames.Graph)).added:
                    pass
        beat.cancel()


async def keep_alive(client: RawClient) -> None:
    """Speak now and then, as a client's ticker does."""
    while True:
        client.send(frames.Pong(0))
        await asyncio.sleep(0.05)


async def test_a_client_suspended_for_long_is_closed() -> None:
    """Case 35: after the second limit the link ends, and nothing of it is left."""
    options = BrokerOptions(
        port=0, keepalive_sec=0.1, idle_keepalive_sec=0.1, suspend_close_sec=0.1, drain_timeout_sec=0.2
    )
    async with Broker(options) as quick, link(quick, "/frozen") as frozen:
        frozen.stop_reading()
        await until(lambda: not quick.stats().connections)
        frozen.go_on_reading()
        await frozen.gone()


async def test_the_handshake_has_one_deadline_for_all_its_bytes() -> None:
    """Cases 1 and 2: a client that sends nothing, or too slowly, is closed with a reason."""
    options = BrokerOptions(port=0, handshake_timeout_sec=0.2, drain_timeout_sec=0.2)
    async with Broker(options) as quick, stream(quick) as (silent, _), stream(quick) as (dripping, writer):

        async def drip() -> None:
            for byte in b"\xc6\x00\x00\x0f\xff" + bytes(1000):
                writer.write(bytes([byte]))
                await asyncio.sleep(0.02)

        drops = asyncio.create_task(drip())
        for reader in (silent, dripping):
            error = await read_error(reader)
            assert error is not None
            assert error.code == ErrorCode.TIMEOUT
        drops.cancel()
        assert quick.stats().connections == 0


async def test_connections_are_limited() -> None:
    """Case 8: one more than allowed is refused with a reason; the others continue."""
    options = BrokerOptions(port=0, max_connections=1, drain_timeout_sec=0.2)
    async with Broker(options) as small, link(small, "/n") as first:
        async with stream(small) as (reader, _):
            error = await read_error(reader)
            assert error is not None
            assert error.code == ErrorCode.LIMIT
        await first.synchronise()


async def test_stopping_says_goodbye_and_leaves_nothing() -> None:
    """Clients hear GOODBYE and get what was queued; the port is free at once."""
    loop = asyncio.get_running_loop()
    async with Broker(BrokerOptions(port=0, drain_timeout_sec=5)) as running, link(running, "/n") as client:
        place = parse_url(running.url)
        stopping = loop.create_task(running.stop())
        await client.next(frames.Goodbye)
        with pytest.raises(ConnectionRefusedError):
            await asyncio.open_connection(place.host, place.port)
        client.channel.close()
        await client.gone()
        await stopping
    assert asyncio.all_tasks() == {asyncio.current_task()}


async def test_stopping_is_bounded_when_a_client_stays(broker: Broker) -> None:
    """A client that ignores GOODBYE does not keep the broker."""
    async with link(broker, "/n") as client:
        async with asyncio.timeout(DEADLINE_SEC):
            await broker.stop()
        await client.gone()


async def test_a_goodbye_takes_everything_along(broker: Broker) -> None:
    """A client that stops in good order is gone from the graph at once."""
    async with link(broker, "/viewer") as viewer, link(broker, "/n") as client:
        viewer.send(frames.Watch(1, keep=True))
        await viewer.next(frames.Graph)
        client.send(frames.Goodbye("done"))
        assert len((await viewer.next(frames.Graph)).removed) == 1
        await client.gone()


async def test_an_address_in_use_has_a_clear_error(broker: Broker) -> None:
    """The error names the address and what to do."""
    port = parse_url(broker.url).port
    with pytest.raises(AddressInUseError, match=rf"callboard://127\.0\.0\.1:{port}.*--port"):
        async with Broker(BrokerOptions(port=port)):
            pass


async def test_a_wrong_host_has_a_clear_error() -> None:
    """A wrong host is a ListenError, not a bare OS error."""
    with pytest.raises(ListenError):
        async with Broker(BrokerOptions(host="host.invalid", port=0)):
            pass


async def test_a_unix_socket_is_used_and_removed(tmp_path: Path) -> None:
    """It listens at the path, takes a dead broker's place, and leaves nothing behind."""
    path = tmp_path / "s"
    with socket.socket(socket.AF_UNIX) as dead:
        dead.bind(str(path))
    async with Broker(BrokerOptions(unix=path, drain_timeout_sec=0.2)) as local, link(local, "/n"):
        assert local.url == f"callboard+unix://{path}"
        with pytest.raises(AddressInUseError):
            async with Broker(BrokerOptions(unix=path)):
                pass
    assert not path.exists()


async def test_a_stop_that_is_cancelled_at_its_very_end_is_cancelled() -> None:
    """While it waits for its last task: nobody's cancellation is lost, and the task has ended."""
    before = asyncio.all_tasks()
    broker = Broker(QUICK)
    await broker.__aenter__()
    stopping = asyncio.create_task(broker.stop())
    with contextlib.suppress(RuntimeError):  # it does not listen any more
        while broker.url:
            await asyncio.sleep(0)
    assert not stopping.done()
    stopping.cancel()
    with pytest.raises(asyncio.CancelledError):
        await stopping
    assert asyncio.all_tasks() == before


async def test_a_broker_that_stops_leaves_its_successors_socket_alone(tmp_path: Path) -> None:
    """While one drains, the next may listen at the same path already."""
    path = tmp_path / "s"
    async with Broker(BrokerOptions(unix=path, drain_timeout_sec=0.2)) as old, link(old, "/n"):
        stopping = asyncio.create_task(old.stop())
        await asyncio.sleep(0)
        assert not stopping.done()
        async with Broker(BrokerOptions(unix=path, drain_timeout_sec=0.2)):
            await stopping
            assert path.is_socket()


async def test_a_file_in_the_sockets_place_is_left_alone(tmp_path: Path) -> None:
    """Only a dead socket is removed, never somebody's file."""
    path = tmp_path / "precious"
    path.write_text("data")
    with pytest.raises(ListenError):
        async with Broker(BrokerOptions(unix=path)):
            pass
    assert path.read_text() == "data"


@pytest.mark.parametrize(
    "options",
    [{"port": -1}, {"port": 70000}, {"keepalive_sec": 0}, {"max_endpoints": 0}, {"mesh_name": "a b"}],
)
def test_options_out_of_range_are_named(options: dict[str, Any]) -> None:
    """The error says which option, and what is allowed."""
    (name,) = options
    with pytest.raises(InvalidOptionError, match=name):
        BrokerOptions(**options)


async def test_ten_connections_that_only_say_hello_leave_nothing(broker: Broker) -> None:
    """Case 32: short connections are forgotten whole."""
    for _ in range(10):
        async with link(broker, "/n"):
            pass
        await until(lambda: not broker.stats().connections)
    stats = broker.stats()
    assert (stats.connections, stats.endpoints) == (0, 0)


async def test_many_brokers_live_in_one_loop() -> None:
    """Nothing is global: each has its own port and graph."""
    async with contextlib.AsyncExitStack() as stack:
        brokers = [await stack.enter_async_context(Broker(BrokerOptions(port=0))) for _ in range(3)]
        assert len({broker.url for broker in brokers}) == 3


@pytest.mark.parametrize("suspend_close_sec", [30.0, 0.2])
async def test_bytes_from_before_a_watch_do_not_show_that_a_peer_is_alive(
    caplog: pytest.LogCaptureFixture, suspend_close_sec: float
) -> None:
    """A peer that freezes just after it was heard is checked when another asks for the graph."""
    options = BrokerOptions(
        port=0, keepalive_sec=0.3, suspend_close_sec=suspend_close_sec, drain_timeout_sec=0.2
    )
    async with Broker(options) as quick, link(quick, "/sleeper") as sleeper, link(quick, "/asker") as asker:
        sleeper.stop_reading()
        asker.send(frames.Watch(1, keep=False))
        assert (await asker.next(frames.Graph)).added
        await until(lambda: "silent" in caplog.text)
        sleeper.go_on_reading()


async def test_a_broker_can_be_entered_again() -> None:
    """The second time calls and messages go through as well."""
    broker = Broker(BrokerOptions(port=0, drain_timeout_sec=0))
    for _ in range(2):
        async with broker:
            await test_messages_and_calls_go_through(broker)
            await until(lambda: broker.stats().connections == 0)
    async with broker, link(broker, "/stays") as one:
        await broker.stop()
        async with broker:
            await one.gone()
            assert broker.stats().endpoints == 0


async def test_a_peer_that_breaks_the_protocol_leaves_the_graph_at_once(broker: Broker) -> None:
    """Its calls end and it gets no new ones, however long it takes to read the reason."""
    async with link(broker, "/server") as server, link(broker, "/asker") as asker, link(broker, "/a") as a:
        server.send(make.service(1), make.subscription(2, qos={"depth": 1000}))
        a.send(make.publisher(1))
        number = (await a.next(frames.Accepted)).number
        await server.synchronise()
        server.stop_reading()
        a.send(*(make.batch(number, count, size=60_000) for count in range(200)))
        await a.synchronise()
        asker.send(make.client(1), make.request(1, 7))
        await asker.synchronise()
        server.send(frames.Node(0, "/again"))
        assert (await asker.next(frames.Reply)).entries[0].call == 7
        assert broker.stats().connections == 3
        asker.send(make.request(1, 8))
        (entry,) = (await asker.next(frames.Reply)).entries
        assert bytes(entry.body) == b"no server; wait for one with wait_for_service()"


async def test_the_periodic_check_goes_on_after_an_error(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """The error is logged; late handshakes are ended all the same."""
    errors = [RuntimeError("a bug")]
    record = LoopLag.record

    def fail_once(lag: LoopLag, now: float, late_sec: float) -> None:
        if errors:
            raise errors.pop()
        record(lag, now, late_sec)

    monkeypatch.setattr(LoopLag, "record", fail_once)
    options = BrokerOptions(port=0, handshake_timeout_sec=0.1, drain_timeout_sec=0)
    async with Broker(options) as quick, stream(quick) as (reader, _):
        error = await read_error(reader)
        assert error is not None
        assert error.code == ErrorCode.TIMEOUT
    assert "RuntimeError: a bug" in caplog.text


async def test_an_error_in_the_check_of_one_link_closes_that_one(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """The other links are still checked."""
    check_link = PeriodicCheck.check_link
    failing: list[Link] = []

    def fail_for_the_first(check: PeriodicCheck, link: Link, now: float, *, all_due: bool) -> None:
        if not failing:
            failing.append(link)
        if link is failing[0]:
            raise RuntimeError("a bug")
        check_link(check, link, now, all_due=all_due)

    monkeypatch.setattr(PeriodicCheck, "check_link", fail_for_the_first)
    options = BrokerOptions(port=0, handshake_timeout_sec=0.1, drain_timeout_sec=0)
    async with Broker(options) as quick, stream(quick) as (first, _), stream(quick) as (second, _):
        assert await read_error(first) is None
        error = await read_error(second)
        assert error is not None
        assert error.code == ErrorCode.TIMEOUT
    assert "RuntimeError: a bug" in caplog.text


async def test_a_running_broker_cannot_be_entered_again() -> None:
    """Its connections would be lost; when it has stopped, or could not listen, it can."""
    broker = Broker(BrokerOptions(port=0, drain_timeout_sec=0.2))
    for _ in range(2):
        async with broker:
            url = broker.url
            with pytest.raises(RuntimeError, match="running already"):
                await broker.__aenter__()
            assert broker.url == url
    async with Broker(BrokerOptions(port=0)) as other:
        late = Broker(BrokerOptions(port=int(other.url.rsplit(":", 1)[1])))
        for _ in range(2):
            with pytest.raises(AddressInUseError):
                await late.__aenter__()


async def test_a_log_line_names_a_few_nodes_of_a_link(caplog: pytest.LogCaptureFixture) -> None:
    """A link may have thousands."""
    async with Broker(BrokerOptions(port=0)) as broker, link(broker, "/n") as client:
        client.send(
            *(frames.Node(number, f"/n{number}") for number in range(1, 20)), frames.Node(1, "/again")
        )
        await client.ended
    assert "Closing link 1 [?] (/n, /n1, /n2, /n3, /n4, /n5, /n6, /n7, 12 more nodes, 127." in caplog.text

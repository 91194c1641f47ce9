"""A broker's numbers: they add up with real traffic, by topic and by link, and rates follow."""

from __future__ import annotations

import asyncio
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING

import pytest

from actors.interfaces.std_msgs.msg import String
from broker import Broker, BrokerOptions
from broker.serving.stats import answer
from proto import limits
from proto.queues.batches import held_bytes
from proto.queues.publisher_queue import PublisherQueue
from proto.wire import frames
from proto.wire.codec import encode
from proto.wire.stats import MAX_NODE_NAMES, BrokerStats, LinkStats, MeshBrokerStats, TopicStats
from proto.wire.type_hash import hash_of
from tests.broker import frame_makers as make
from tests.broker.rawclient import RawClient, hello, link, until
from tests.seams.brokers import dispatcher_of
from tests.seams.structure import memory
from tests.simulation.loop import simulate
from tests.simulation.stage import Stage, play

if TYPE_CHECKING:
    from collections.abc import AsyncIterator
    from pathlib import Path

    from tests.simulation.loop import SimulatedLoop


@pytest.fixture
async def broker() -> AsyncIterator[Broker]:
    """A broker on a free port."""
    async with Broker(BrokerOptions(port=0, drain_timeout_sec=0.2)) as running:
        yield running


def topics(broker: Broker) -> dict[tuple[int, str], TopicStats]:
    """Return the topics by domain and name."""
    return {(topic.domain, topic.name): topic for topic in broker.topic_stats()}


def links(broker: Broker) -> dict[str, LinkStats]:
    """Return the links by the name of their first node."""
    return {each.nodes[0]: each for each in broker.link_stats() if each.nodes}


async def publisher(client: RawClient, declaration: frames.Publisher) -> int:
    """Declare a publisher; return its broker-wide id."""
    client.send(declaration)
    accepted = await client.next(frames.Accepted)
    assert accepted.id == declaration.id
    return accepted.number


async def test_each_topic_and_each_link_has_its_own_numbers(broker: Broker) -> None:
    """Messages, bytes and copies are counted by topic, bytes by link."""
    async with link(broker, "/a") as a, link(broker, "/b") as b, link(broker, "/c") as c:
        for reader in (b, c):
            reader.send(make.subscription(1, "/x"))
            await reader.synchronise()
        x, y = await publisher(a, make.publisher(1, "/x")), await publisher(a, make.publisher(2, "/y"))
        a.send(make.batch(x, 0, 3, size=10), make.batch(y, 0, 5, size=20), make.batch(x, 1, 4, size=10))
        for each in (a, b, c):
            await each.synchronise()
        by_name = topics(broker)
        assert by_name[0, "/x"] == TopicStats(
            domain=0, name="/x", publishers=1, subscriptions=2, messages=5, bytes=50, delivered=10,
            dropped=0, abandoned=0, lost_on_break=0, leaving=0, queued=0, latched_dropped=0,
        )  # fmt: skip
        assert (by_name[0, "/y"].messages, by_name[0, "/y"].bytes, by_name[0, "/y"].delivered) == (5, 100, 0)
        stats = broker.stats()
        assert (stats.topics, stats.routed, stats.unmatched, stats.stale) == (2, 5, 5, 2)
        assert stats.delivered == sum(topic.delivered for topic in by_name.values())
        by_node = links(broker)
        for name, client in {"/a": a, "/b": b, "/c": c}.items():
            assert by_node[name].bytes_received == client.channel.bytes_sent
            assert by_node[name].bytes_sent == client.channel.bytes_received
        assert stats.bytes_received == sum(each.bytes_received for each in by_node.values())
        assert stats.bytes_sent == sum(each.bytes_sent for each in by_node.values())


async def test_a_slow_link_shows_what_waits_for_it_and_what_it_lost(broker: Broker) -> None:
    """Sent is delivered, dropped or queued; the drops and the queue are the slow link's."""
    async with link(broker, "/a") as a, link(broker, "/slow") as slow, link(broker, "/quick") as quick:
        for reader, depth in ((slow, 4), (quick, 1000)):
            reader.send(make.subscription(1, qos={"depth": depth}))
            await reader.synchronise()
        number = await publisher(a, make.publisher(1))
        slow.stop_reading()
        sent = 0
        while not links(broker)["/slow"].dropped:
            a.send(make.batch(number, sent, 1, size=100_000))
            sent += 1
            await quick.next(frames.Batch)
        (topic,) = broker.topic_stats()
        by_node, stats = links(broker), broker.stats()
        assert (topic.messages, topic.bytes) == (sent, 100_000 * sent)
        assert topic.delivered + topic.dropped + topic.queued + topic.leaving == 2 * sent == stats.copies
        assert by_node["/slow"].dropped == topic.dropped == stats.dropped
        assert by_node["/slow"].queued == topic.queued == stats.queued == 4
        assert by_node["/slow"].queued_bytes == 400_000 <= stats.queued_bytes
        assert (by_node["/quick"].dropped, by_node["/quick"].queued, by_node["/quick"].queued_bytes) == (
            0,
            0,
            0,
        )


async def test_calls_are_counted_by_caller_and_by_server(broker: Broker) -> None:
    """A hung server can be found: the calls that it owes are counted at its link."""
    async with link(broker, "/asker") as asker, link(broker, "/server") as server:
        server.send(make.service(1))
        await server.synchronise()
        asker.send(make.client(1), make.request(1, 7, 8, 9))
        entries = (await server.next(frames.Request)).entries
        by_node = links(broker)
        assert (by_node["/asker"].pending_calls, by_node["/asker"].owed_calls) == (3, 0)
        assert (by_node["/server"].pending_calls, by_node["/server"].owed_calls) == (0, 3)
        server.send(make.reply(1, *(entry.call for entry in entries)))
        await asker.next(frames.Reply)
        by_node = links(broker)
        assert (by_node["/asker"].pending_calls, by_node["/server"].owed_calls) == (0, 0)


async def test_links_have_an_identity(broker: Broker) -> None:
    """Session, agent, domain and the first of many nodes; before the handshake there is no link."""
    async with link(broker, agent="many", domain=3) as many, RawClient().connected(broker):
        many.send(*(frames.Node(number, f"/n{number}") for number in range(20)))
        await many.synchronise()
        (one,) = broker.link_stats()
        assert (one.session, one.agent, one.domain, one.endpoints, one.suspended) == (1, "many", 3, 20, False)
        assert one.nodes == tuple(f"/n{number}" for number in range(MAX_NODE_NAMES))
        assert broker.stats().connections == 2


async def test_latched_messages_and_definitions_are_counted_while_they_are_kept(broker: Broker) -> None:
    """What is kept for late joiners goes with its publisher, the definition of its type, too."""
    async with link(broker, "/a") as a:
        hashed = hash_of(b"definition")
        declared = make.publisher(1, qos={"durability": 1, "depth": 3}, type_hash=hashed)
        number = await publisher(a, declared._replace(definition=b"definition"))
        a.send(make.batch(number, 0, 5, size=10))
        await a.synchronise()
        stats = broker.stats()
        assert (stats.latched, stats.latched_bytes) == (3, held_bytes(make.batch(1, 0, 3)))
        assert (stats.definitions, stats.definition_bytes) == (1, 10)
        a.send(frames.Undeclare(1))
        await a.synchronise()
        stats = broker.stats()
        assert (stats.latched, stats.latched_bytes, stats.definitions) == (0, 0, 0)


async def test_frames_and_bytes_of_links_that_have_gone_still_count(broker: Broker) -> None:
    """Totals never fall; what waited for a link is gone with it."""
    async with link(broker, "/a") as a:
        await a.synchronise()
        first = broker.stats()
        await a.synchronise()
        before = broker.stats()
        assert before.frames_received == first.frames_received + 1
        received, sent = a.channel.bytes_received, a.channel.bytes_sent
    await until(lambda: not broker.stats().connections)
    after = broker.stats()
    assert (after.bytes_received, after.bytes_sent) == (sent, received)
    assert after.bytes_received >= before.bytes_received
    assert after.frames_received >= before.frames_received
    assert not broker.link_stats()


async def test_two_snapshots_give_rates(broker: Broker) -> None:
    """Counts between two snapshots, per second of the broker's own clock."""
    async with link(broker, "/a") as a:
        number = await publisher(a, make.publisher(1))
        before = broker.stats()
        a.send(make.batch(number, 0, 50))
        await a.synchronise()
        after = broker.stats()
        rates = after.rates_since(before)
        assert rates.unmatched * rates.interval_sec == pytest.approx(50)
        assert after.uptime_sec - before.uptime_sec == pytest.approx(rates.interval_sec)
        assert before.broker == broker.instance.hex()


def test_a_broker_that_has_never_run_has_zero_statistics() -> None:
    """The numbers need no loop."""
    idle = Broker()
    assert idle.stats() == BrokerStats(broker=idle.instance.hex())
    assert not idle.topic_stats() + idle.link_stats()


async def test_refused_connections_are_counted() -> None:
    """Each of them gets a reason."""
    options = BrokerOptions(port=0, max_connections=1, drain_timeout_sec=0.2)
    async with Broker(options) as small, link(small, "/a"), RawClient().connected(small) as second:
        second.send(hello())
        await second.gone()
        await until(lambda: small.stats().connections == 1)
        assert (small.stats().refused_connections, small.stats().refused_per_address) == (1, 0)


async def test_reading_statistics_changes_nothing(broker: Broker) -> None:
    """Counters and queues stay as they are."""
    async with link(broker, "/a") as a, link(broker, "/b") as b:
        b.send(make.subscription(1, qos={"history": 2}, window=5))
        await b.synchronise()
        number = await publisher(a, make.publisher(1))
        a.send(make.batch(number, 0, 5))
        await b.next(frames.Batch)
        await a.synchronise()
        first = broker.stats(), broker.topic_stats()
        for _ in range(1000):
            broker.link_stats()
            last = broker.stats(), broker.topic_stats()
        assert last[1] == first[1]
        assert last[0].accounted == first[0].accounted == last[0].copies == 5


def test_a_blocked_loop_and_a_silent_link_are_visible() -> None:
    """The periodic check reports its delay; a partitioned link is silent, suspended, and then restored."""

    async def scene(stage: Stage) -> None:
        await stage.enter("talker")
        listener = await stage.enter("listener")
        (await stage.enter("other")).create_publisher(String, "t")
        listener.create_subscription(String, "t", lambda _: None)
        await asyncio.sleep(5)
        assert stage.broker.stats().lag_longest_sec < 0.01
        assert links(stage.broker)["/listener"].silent_ms < 2000
        stage.network.partition("listener")
        await stage.until(lambda: links(stage.broker)["/listener"].suspended)
        assert links(stage.broker)["/listener"].silent_ms == pytest.approx(3000, abs=1500)
        assert (stage.broker.stats().suspended, stage.broker.stats().connections) == (1, 3)
        stage.network.heal()
        await stage.until(lambda: stage.broker.stats().suspended == 0)
        stage.loop.stall(0.7)
        await asyncio.sleep(1)
        stats = stage.broker.stats()
        assert stats.lag_longest_sec == pytest.approx(0.5, abs=0.3)
        assert stats.lag_last_sec < 0.01
        await asyncio.sleep(100)
        assert stage.broker.stats().lag_longest_sec < 0.01

    play(scene)


def test_a_pause_of_the_machine_delays_no_answer_for_long() -> None:
    """A pause while the numbers are collected is no reason not to collect them for seven times as long."""

    async def main(loop: SimulatedLoop) -> None:
        async with AsyncExitStack() as stack:
            stage = Stage(loop, stack, BrokerOptions())
            await stage.start_broker()
            node = await stage.enter("asker")
            for _ in range(3):
                await node.get_broker_stats()
        await stage.stop_broker()

    simulate(main, clock_step_sec=1.0)


def test_answers_fit_the_largest_names() -> None:
    """However long the names, no STATS frame is larger than a frame may be."""
    name = "/" + "n" * 246
    topic = TopicStats(2**32 - 1, name, *[2**64 - 1] * 11)
    nodes = (f"/{'n' * 244}/{'n' * 255}",) * MAX_NODE_NAMES
    one = LinkStats(2**32 - 1, 2**64 - 1, "\U0001f680" * 80, nodes, 2**64 - 1, True, *[2**64 - 1] * 11)
    other = MeshBrokerStats(2**32, "\U0001f680" * 63, "\U0001f680" * 63, True, *[2**64 - 1] * 5)
    pieces = list(answer(1, BrokerStats(), (topic,) * 1200, (one,) * 100, brokers=(other,) * 1000))
    assert max(len(encode(piece)) for piece in pieces) < limits.MAX_FRAME_BYTES
    assert sum(len(piece.topics) for piece in pieces) == 1200
    assert sum(len(piece.links) for piece in pieces) == 100
    assert sum(len(piece.brokers) for piece in pieces) == 1000
    (only,) = answer(1, BrokerStats(), (), ())
    assert BrokerStats.from_map(only.totals) == BrokerStats()


async def test_inspects_are_answered_one_in_a_loop_turn(broker: Broker) -> None:
    """Case 54: each is answered under its own id, in order, and others are served between two of a link."""
    async with link(broker, "/a") as a, link(broker, "/b") as b:
        a.send(frames.Inspect(5), make.publisher(1), *(frames.Inspect(number) for number in range(6, 100)))
        await b.synchronise()
        assert len(a.waiting(frames.Stats)) < 94
        while (last := await a.next(frames.Stats)).id < 99:
            pass
        assert last.topics[0].name == "/t"
        a.send(frames.Inspect(8), frames.Goodbye(""))
        await a.gone()
        assert a.problem is None


async def test_a_peer_that_does_not_read_its_statistics_is_closed(tmp_path: Path) -> None:
    """The answers count as waiting control frames; other links are not affected."""
    # A Unix socket, because the kernel keeps less for it.
    options = BrokerOptions(unix=tmp_path / "s", max_queue_bytes=65_536, drain_timeout_sec=0.2)
    async with Broker(options) as small, link(small, "/deaf") as deaf, link(small, "/other") as other:
        deaf.send(*(make.publisher(number, f"/t{number}") for number in range(1, 500)))
        await deaf.synchronise()
        deaf.stop_reading()
        while small.stats().connections == 2:
            deaf.send(*[frames.Inspect(1)] * 20)
            await other.synchronise()
        await other.synchronise()
        assert small.stats().connections == 1


async def test_waiting_bytes_are_all_that_is_not_a_batch(broker: Broker) -> None:
    """Also large calls and latched messages; totals and links agree."""
    async with link(broker, "/reader"):
        (connection,) = dispatcher_of(broker).links
        outbox = connection.channel.outbox
        frames_waiting = [encode(make.request(1, 1)), encode(make.request(1, 2, body=bytes(300_000)))]
        for raw in frames_waiting:
            outbox.put_calls(raw)
        detached = encode(frames.Detached(1, (1,), 0))
        replay = frames.Replay(1, *make.batch(1, 0, size=1000)[:-1])
        for item in (detached, replay):
            outbox.enqueue(PublisherQueue(1, 1), item)
        waiting = memory((*frames_waiting, detached, replay.payload))
        totals = broker.stats()
        assert links(broker)["/reader"].waiting_bytes == waiting
        assert totals.urgent_bytes + totals.ordered_bytes == waiting

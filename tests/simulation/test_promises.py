"""Single promises, each in the situation that tests it."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import pytest

import actors
from tests.seams import simulation as seams
from tests.seams.nodes import link_of
from tests.simulation.network import BROKER, on_host
from tests.simulation.records import Ask, Note
from tests.simulation.stage import Stage, play

if TYPE_CHECKING:
    from actors.endpoints.publisher.publisher import Publisher

LATCHED = actors.DurabilityPolicy.TRANSIENT_LOCAL
KEEP_ALL = actors.QoSProfile(history=actors.HistoryPolicy.KEEP_ALL)


async def matched(stage: Stage, publisher: Publisher[Note], count: int = 1) -> None:
    await stage.until(lambda: publisher.get_subscription_count() == count)


def test_a_busy_reader_keeps_exactly_its_depth() -> None:
    """While a callback runs, the node keeps the last `depth` messages and counts the others."""

    async def scene(stage: Stage) -> None:
        talker, listener = await stage.enter("talker"), await stage.enter("listener")
        received: list[int] = []
        wake = asyncio.Event()

        async def slow(message: Note) -> None:
            received.append(message.number)
            await wake.wait()

        subscription = listener.create_subscription(Note, "red", slow, 7)
        publisher = talker.create_publisher(Note, "red", 1000)
        await matched(stage, publisher)
        publisher.publish(Note(number=0))
        await asyncio.sleep(1)
        for number in range(1, 101):
            publisher.publish(Note(number=number))
        await asyncio.sleep(1)
        assert subscription.queued == 7
        wake.set()
        await asyncio.sleep(1)
        assert received == [0, *range(94, 101)]
        assert (subscription.received, subscription.dropped, subscription.lost) == (8, 93, 0)

    play(scene)


def test_an_unread_link_keeps_exactly_its_depth() -> None:
    """Behind a full connection the broker keeps the last `depth` messages; the reader counts the others."""

    async def scene(stage: Stage) -> None:
        talker, listener = await stage.enter("talker"), await stage.enter("listener")
        received: list[int] = []
        subscription = listener.create_subscription(
            Note, "red", lambda message: received.append(message.number), 10
        )
        publisher = talker.create_publisher(Note, "red", 10)
        await matched(stage, publisher)
        stage.network.block(BROKER, "listener")
        for number in range(2000):
            publisher.publish(Note(number=number, weight=bytes(1000)))
            await asyncio.sleep(0.001)
        await asyncio.sleep(0.2)
        stage.network.heal()
        await asyncio.sleep(2)
        assert received[-10:] == list(range(1990, 2000))
        assert received[:-10] == list(range(len(received) - 10))
        assert subscription.lost == 2000 - len(received) > 0
        assert not subscription.dropped
        assert not subscription.lost_on_break

    play(scene)


def test_keep_all_pushes_the_publisher_back_and_loses_nothing() -> None:
    """A slow KEEP_ALL reader fills the publisher's queue; ready() waits, and every message arrives."""

    async def scene(stage: Stage) -> None:
        talker, listener = await stage.enter("talker"), await stage.enter("listener")
        received: list[int] = []
        gate = asyncio.Event()

        async def slow(message: Note) -> None:
            received.append(message.number)
            await gate.wait()

        listener.create_subscription(Note, "red", slow, KEEP_ALL)
        publisher = talker.create_publisher(Note, "red", KEEP_ALL)
        await matched(stage, publisher)
        number = 0
        while publisher.queued < 100_000:
            publisher.publish(Note(number=number))
            number += 1
            if number % 1000 == 0:
                await asyncio.sleep(0.01)
        with pytest.raises(actors.PublisherFull):
            publisher.publish(Note(number=number))
        assert number > 100_000
        with pytest.raises(actors.WaitTimeout):
            await publisher.ready(0.5)
        gate.set()
        await publisher.ready(10)
        publisher.publish(Note(number=number))
        await stage.until(lambda: len(received) == number + 1, 60)
        assert received == list(range(number + 1))

    play(scene)


def test_keep_all_survives_a_short_partition() -> None:
    """A black hole shorter than the keepalive limit loses nothing and fails no call."""

    async def scene(stage: Stage) -> None:
        talker, listener = await stage.enter("talker"), await stage.enter("listener")
        received: list[int] = []
        listener.create_subscription(Note, "red", lambda message: received.append(message.number), KEEP_ALL)

        async def handler(request: Ask.Request) -> Ask.Response:
            await asyncio.sleep(request.seconds)
            return Ask.Response(number=2 * request.number)

        listener.create_service(Ask, "double", handler)
        client = talker.create_client(Ask, "double")
        publisher = talker.create_publisher(Note, "red", KEEP_ALL)
        await matched(stage, publisher)
        assert await client.wait_for_service(1)
        call = asyncio.create_task(client.call(Ask.Request(number=4, seconds=0.5), 10))
        await asyncio.sleep(0.1)
        stage.network.partition("listener")
        for number in range(1000):
            publisher.publish(Note(number=number))
            await asyncio.sleep(0.0015)
        stage.network.heal()
        assert (await call).number == 8
        await asyncio.sleep(2)
        assert received == list(range(1000))

    play(scene)


@pytest.mark.parametrize(("silent", "limit"), [(False, 0.1), (True, 5.0)])
def test_a_call_to_a_server_that_dies_ends_soon(*, silent: bool, limit: float) -> None:
    """Callers learn of a killed server within milliseconds, of a cut-off one after the keepalive limit."""

    async def scene(stage: Stage) -> None:
        caller = await stage.enter("caller")
        client = caller.create_client(Ask, "double")
        entered, dead = asyncio.Event(), asyncio.Event()

        async def forever(request: Ask.Request) -> Ask.Response:
            entered.set()
            await dead.wait()
            return Ask.Response()

        async def serve() -> None:
            async with actors.Node("server", use_global_arguments=False) as node:
                node.create_service(Ask, "double", forever)
                await dead.wait()

        with on_host("server"):
            server = asyncio.create_task(serve())
        assert await client.wait_for_service(5)
        call = asyncio.create_task(client.call(Ask.Request(), 60))
        await entered.wait()
        stage.network.crash("server", silent=silent)
        began = stage.loop.time()
        with pytest.raises(actors.ServiceUnavailable):
            await call
        assert stage.loop.time() - began < limit
        assert not client.service_is_ready()
        dead.set()
        await server

    play(scene)


def test_a_call_ends_when_the_broker_dies() -> None:
    """The end of the connection ends its calls; the next broker routes calls again."""

    async def scene(stage: Stage) -> None:
        caller, server = await stage.enter("caller"), await stage.enter("server")

        async def handler(request: Ask.Request) -> Ask.Response:
            await asyncio.sleep(request.seconds)
            return Ask.Response(number=2 * request.number)

        server.create_service(Ask, "double", handler)
        client = caller.create_client(Ask, "double")
        assert await client.wait_for_service(5)
        call = asyncio.create_task(client.call(Ask.Request(seconds=30), 60))
        await asyncio.sleep(0.5)
        await stage.crash_broker()
        began = stage.loop.time()
        with pytest.raises(actors.ServiceUnavailable):
            await call
        assert stage.loop.time() - began < 0.1
        await asyncio.sleep(1)
        await stage.start_broker()
        assert await client.wait_for_service(10)
        assert (await client.call(Ask.Request(number=3), 5)).number == 6

    play(scene)


@pytest.mark.parametrize("restart", [False, True])
def test_a_late_joiner_gets_the_latched_messages_once(*, restart: bool) -> None:
    """It gets the last `depth` in order, once, also from a new broker; earlier joiners get no repeats."""

    async def scene(stage: Stage) -> None:
        talker, listener = await stage.enter("talker"), await stage.enter("listener")
        qos = actors.QoSProfile(depth=5, durability=LATCHED)
        early: list[int] = []
        late: list[int] = []
        publisher = talker.create_publisher(Note, "map", qos)
        listener.create_subscription(Note, "map", lambda message: early.append(message.number), qos)
        await matched(stage, publisher)
        for number in range(20):
            publisher.publish(Note(number=number))
            await asyncio.sleep(0.01)
        if restart:
            await stage.crash_broker()
            await stage.start_broker()
            await stage.until(lambda: talker.connected and listener.connected)
            await asyncio.sleep(1)
        listener.create_subscription(Note, "map", lambda message: late.append(message.number), qos)
        await asyncio.sleep(1)
        assert late == [15, 16, 17, 18, 19]
        publisher.publish(Note(number=20))
        await asyncio.sleep(1)
        assert late == [15, 16, 17, 18, 19, 20]
        assert early == list(range(21))

    play(scene)


@pytest.mark.parametrize("keep_all", [False, True])
def test_a_new_broker_brings_a_volatile_subscription_no_latched_messages(*, keep_all: bool) -> None:
    """A subscription made without a broker receives only what is published later."""

    async def scene(stage: Stage) -> None:
        talker, listener = await stage.enter("talker"), await stage.enter("listener")
        history = actors.HistoryPolicy.KEEP_ALL if keep_all else actors.HistoryPolicy.KEEP_LAST
        old: list[int] = []
        fresh: list[int] = []
        publisher = talker.create_publisher(
            Note, "map", actors.QoSProfile(history=history, depth=400, durability=LATCHED)
        )
        volatile = actors.QoSProfile(history=history, depth=400)
        before = listener.create_subscription(
            Note, "map", lambda message: old.append(message.number), volatile
        )
        await matched(stage, publisher)
        for number in range(300):  # more than the least window, in bytes
            publisher.publish(Note(number=number, weight=bytes(1000)))
        await stage.until(lambda: len(old) == 300)
        await stage.crash_broker()
        await asyncio.sleep(1)
        meanwhile = listener.create_subscription(
            Note, "map", lambda message: fresh.append(message.number), volatile
        )
        for number in range(300, 310):
            publisher.publish(Note(number=number))
        stage.network.block("talker", BROKER)  # the listener is back first
        await stage.start_broker()
        await stage.until(lambda: listener.connected)
        stage.network.heal()
        await matched(stage, publisher, 2)
        publisher.publish(Note(number=310))
        await stage.until(lambda: bool(fresh) and fresh[-1] == 310)
        assert fresh == list(range(300, 311))
        assert old == list(range(311))
        for subscription in (before, meanwhile):
            lost = subscription.dropped + subscription.lost + subscription.lost_on_break
            assert (lost, subscription.received) == (0, len(old if subscription is before else fresh))

    play(scene)


def test_a_volatile_subscription_counts_what_broke_off_of_a_latched_publisher() -> None:
    """Messages in transit when the broker died return only as latched: they are lost, and counted."""

    async def scene(stage: Stage) -> None:
        talker, listener = await stage.enter("talker"), await stage.enter("listener")
        received: list[int] = []
        publisher = talker.create_publisher(Note, "map", actors.QoSProfile(depth=10, durability=LATCHED))
        subscription = listener.create_subscription(
            Note, "map", lambda message: received.append(message.number), 10
        )
        await matched(stage, publisher)
        publisher.publish(Note(number=0))
        await stage.until(lambda: received == [0])
        stage.network.block("talker", BROKER)
        publisher.publish(Note(number=1))
        await asyncio.sleep(0.1)  # it has left, and never arrives
        await stage.crash_broker()
        await stage.start_broker()
        await stage.until(lambda: listener.connected)
        stage.network.heal()
        await matched(stage, publisher)
        publisher.publish(Note(number=2))
        await stage.until(lambda: received[-1] == 2)
        assert received == [0, 2]
        assert (subscription.lost, subscription.lost_on_break) == (0, 1)

    play(scene)


def test_a_frozen_peer_leaves_the_graph_and_comes_back() -> None:
    """After the keepalive limit its calls fail and it is not matched; its next bytes restore it."""

    async def scene(stage: Stage) -> None:
        caller, server = await stage.enter("caller"), await stage.enter("server")
        received: list[int] = []
        server.create_service(Ask, "double", lambda request: Ask.Response(number=2 * request.number))
        server.create_subscription(Note, "red", lambda message: received.append(message.number))
        client = caller.create_client(Ask, "double")
        publisher = caller.create_publisher(Note, "red")
        await matched(stage, publisher)
        assert await client.wait_for_service(5)
        stage.network.block("server", BROKER)
        await stage.until(lambda: not client.service_is_ready(), 5)
        assert publisher.get_subscription_count() == 0
        stage.network.heal()
        await stage.until(client.service_is_ready, 5)
        assert (await client.call(Ask.Request(number=3), 5)).number == 6
        await matched(stage, publisher)
        publisher.publish(Note(number=1))
        await asyncio.sleep(1)
        assert received == [1]

    play(scene)


def test_names_are_unique() -> None:
    """A second node with the name of a live node gets a clear error; after the first has left it may join."""

    async def scene(stage: Stage) -> None:
        async def first() -> None:
            async with actors.Node("same", use_global_arguments=False):
                await stop.wait()

        stop = asyncio.Event()
        with on_host("first"):
            task = asyncio.create_task(first())
        await asyncio.sleep(1)
        with on_host("second"), pytest.raises(actors.NodeNameTaken):
            await actors.Node("same", use_global_arguments=False).run()
        stop.set()
        await task
        await stage.enter("same")

    play(scene)


def test_nodes_that_share_a_name_come_back_beside_each_other() -> None:
    """After a partition of one and a crash of the broker both are there; none takes the other's place."""

    async def scene(stage: Stage) -> None:
        watcher = await stage.enter("watcher")
        nodes = [await stage.enter("same", host=host, shared_name=True) for host in ("first", "second")]
        subscription = watcher.create_subscription(Note, "notes")
        publishers = [node.create_publisher(Note, "notes") for node in nodes]
        for publisher in publishers:
            await matched(stage, publisher)

        async def number_of_nodes() -> int:
            return (await watcher.get_node_names()).count("same")

        stage.network.partition("first")
        while await number_of_nodes() != 1:
            await asyncio.sleep(0.1)
        stage.network.heal()
        while await number_of_nodes() != 2:
            await asyncio.sleep(0.1)
        await stage.crash_broker()
        await asyncio.sleep(1)
        await stage.start_broker()
        for publisher in publishers:
            await matched(stage, publisher)
            publisher.publish(Note())
        assert await number_of_nodes() == 2
        await asyncio.sleep(30)
        assert subscription.queued == 2
        assert all(node.connected for node in nodes)
        assert await number_of_nodes() == 2

    play(scene)


def test_nodes_come_back_one_after_another() -> None:
    """After a loss a hundred nodes reconnect at different moments, all within a second."""

    async def scene(stage: Stage) -> None:
        nodes = [await stage.enter(f"n{number}") for number in range(100)]
        await stage.stop_broker()
        back: list[float] = []

        async def note(node: actors.Node) -> None:
            await stage.until(lambda: node.connected, 5)
            back.append(stage.loop.time())

        began = stage.loop.time()
        await stage.start_broker()
        await asyncio.gather(*map(note, nodes))
        assert max(back) - began < 1
        assert max(back.count(moment) for moment in back) <= 20

    play(scene)


def test_a_node_takes_its_name_back_from_its_own_half_dead_link() -> None:
    """A connection that broke on one side only does not block the reconnecting node."""

    async def scene(stage: Stage) -> None:
        node, other = await stage.enter("phoenix"), await stage.enter("other")
        received: list[int] = []
        node.create_subscription(Note, "red", lambda message: received.append(message.number))
        publisher = other.create_publisher(Note, "red")
        await matched(stage, publisher)
        stage.network.block(BROKER, "phoenix")
        await stage.until(lambda: not node.connected, 10)
        stage.network.heal()
        await stage.until(lambda: node.connected, 10)
        await matched(stage, publisher)
        publisher.publish(Note(number=5))
        await asyncio.sleep(1)
        assert received == [5]

    play(scene)


def test_a_publisher_that_comes_back_does_not_overtake_itself() -> None:
    """Messages on its new connection wait behind those that the broker still holds from the old one."""

    async def scene(stage: Stage) -> None:
        talker, listener = await stage.enter("talker"), await stage.enter("listener")
        received: list[int] = []
        listener.create_subscription(Note, "red", lambda message: received.append(message.number), KEEP_ALL)
        publisher = talker.create_publisher(Note, "red", KEEP_ALL)
        await matched(stage, publisher)
        stage.network.slow_down("listener", read=2000, pause=0.05)
        for number in range(500):
            publisher.publish(Note(number=number, weight=bytes(1000)))
        await asyncio.sleep(0.5)
        stage.network.drop("talker")
        await stage.until(lambda: not talker.connected)
        for number in range(500, 600):
            publisher.publish(Note(number=number))
        await stage.until(lambda: bool(received) and received[-1] == 599, 60)
        assert received == list(range(600))

    play(scene)


def test_a_publisher_that_leaves_as_credit_comes_costs_no_link() -> None:
    """A CREDIT that crosses the UNDECLARE is ignored."""

    async def scene(stage: Stage) -> None:
        talker, listener = await stage.enter("talker"), await stage.enter("listener")
        sessions = link_of(talker).connections
        for step in range(30):
            publisher = talker.create_publisher(Note, "red", KEEP_ALL)
            await asyncio.sleep(0.1)
            listener.create_subscription(Note, "red", lambda _: None, KEEP_ALL)
            await asyncio.sleep(step * 0.0002)
            talker.destroy_publisher(publisher)
            await asyncio.sleep(0.1)
        assert link_of(talker).connections == sessions
        assert not link_of(talker).publishers

    play(scene)


def test_credit_from_before_a_suspension_does_not_outlive_it() -> None:
    """A frozen publisher is not limited by a reader that has left meanwhile."""

    async def scene(stage: Stage) -> None:
        talker, listener = await stage.enter("talker"), await stage.enter("listener")
        other = await stage.enter("other")
        gate = asyncio.Event()
        received: list[int] = []

        async def slow(message: Note) -> None:
            await gate.wait()

        reader = listener.create_subscription(Note, "red", slow, KEEP_ALL)
        publisher = talker.create_publisher(Note, "red", KEEP_ALL)
        await matched(stage, publisher)
        for number in range(40_000):
            publisher.publish(Note(number=number))
            if number % 1000 == 0:
                await asyncio.sleep(0.01)
        await asyncio.sleep(0.5)
        assert publisher.queued
        stage.network.block("talker", BROKER)
        await asyncio.sleep(5)
        listener.destroy_subscription(reader)
        other.create_subscription(Note, "red", lambda message: received.append(message.number), 10)
        await asyncio.sleep(1)
        stage.network.heal()
        await stage.until(lambda: bool(received) and received[-1] == 39_999, 30)

    play(scene)


def test_a_frozen_reader_forgets_a_publisher_that_left_meanwhile() -> None:
    """Its old attachments are not kept forever."""

    async def scene(stage: Stage) -> None:
        talker, listener = await stage.enter("talker"), await stage.enter("listener")
        listener.create_subscription(Note, "red", lambda _: None)
        publisher = talker.create_publisher(Note, "red")
        await matched(stage, publisher)
        stage.network.block("listener", BROKER)
        await matched(stage, publisher, 0)
        talker.destroy_publisher(publisher)
        stage.network.heal()
        await asyncio.sleep(1)
        assert not seams.attached_publishers(link_of(listener).attachments)

    play(scene)


def test_the_second_of_two_brokers_is_reached_through_a_mute_first() -> None:
    """A broker that accepts without answering costs one connection timeout, and its end has no effect."""

    async def scene(stage: Stage) -> None:
        with on_host(BROKER):
            mute = await stage.loop.create_server(_Mute, "127.0.0.1", 1)
        urls = "callboard://127.0.0.1:1,callboard://127.0.0.1:7411"
        node = await stage.enter("patient", url=urls)
        await asyncio.sleep(20)
        assert node.connected
        mute.close()

    play(scene)


class _Mute(asyncio.BufferedProtocol):
    def __init__(self) -> None:
        self._buffer = bytearray(10_000)

    def get_buffer(self, sizehint: int) -> bytearray:
        return self._buffer


def test_what_was_dropped_before_the_first_message_uses_no_credit() -> None:
    """A publisher that dropped more than a window before the session sends the rest."""

    async def scene(stage: Stage) -> None:
        talker, listener = await stage.enter("talker"), await stage.enter("listener")
        received: list[int] = []
        listener.create_subscription(Note, "red", lambda message: received.append(message.number), KEEP_ALL)
        stage.network.block(BROKER, "talker")
        publisher = talker.create_publisher(Note, "red", 10)
        await asyncio.sleep(0.1)  # it has been declared, to go on with number 0
        for number in range(40_000):
            publisher.publish(Note(number=number))
        await asyncio.sleep(0.1)
        stage.network.heal()
        await stage.until(lambda: bool(received) and received[-1] == 39_999)
        assert received == list(range(39_990, 40_000))

    play(scene)

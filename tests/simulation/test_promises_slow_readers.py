"""Slow readers affect their own topic only, and every loss is counted."""

from __future__ import annotations

import asyncio
import logging
from typing import TYPE_CHECKING, Final

import pytest

from actors.endpoints.endpoint import endpoint_of
from broker.options import BrokerOptions
from proto import limits
from tests.seams.brokers import dispatcher_of
from tests.seams.limits import set_limits
from tests.seams.nodes import context_of, link_of
from tests.simulation.network import LinkFaults
from tests.simulation.records import Ask, Note
from tests.simulation.stage import Stage, play
from tests.simulation.test_promises import KEEP_ALL, matched

if TYPE_CHECKING:
    from collections.abc import Callable

    import actors

SAMPLES: Final = 200
KIB: Final = 1024

READ: Final = 64 * KIB
PAUSE: Final = 0.1
RATE: Final = READ / 2 / PAUSE
"""What a slow link takes in a second, on average: reads are of all sizes up to the greatest."""

TRANSIT: Final = limits.HIGH_WATER_BYTES + LinkFaults.window
"""What has left the broker's queues at most, and is not read: in the transport, in the kernels."""

CROWD: Final = 1000
EACH: Final = 12
"""So many publishers, and how many messages each of them sends."""


class Meter:
    """How long calls and messages take between two nodes, side by side, in virtual seconds."""

    def __init__(self, stage: Stage, near: actors.Node, far: actors.Node, name: str) -> None:
        self._time = stage.loop.time
        self._sent: dict[int, float] = {}
        self._stage = stage
        self.calls: list[float] = []
        self.messages: list[float] = []
        self._service = far.create_service(Ask, f"{name}_service", self._serve)
        self._reader = far.create_subscription(Note, f"{name}_topic", self._on_message, 10)
        self._client = near.create_client(Ask, f"{name}_service")
        self._publisher = near.create_publisher(Note, f"{name}_topic", 10)

    def leads_to(self, node: actors.Node) -> bool:
        """Whether it takes callbacks of a node."""
        return endpoint_of(self._reader).context is context_of(node)

    async def ready(self) -> None:
        """Return when both ends have met."""
        await matched(self._stage, self._publisher)
        assert await self._client.wait_for_service(10)

    def _serve(self, request: Ask.Request) -> Ask.Response:
        return Ask.Response(number=request.number)

    def _on_message(self, message: Note) -> None:
        self.messages.append(self._time() - self._sent[message.number])

    async def measure(self, period: float, count: int = SAMPLES) -> None:
        """Call, and publish, that many times."""
        for number in range(count):
            began = self._sent[number] = self._time()
            self._publisher.publish(Note(number=number))
            await self._client.call(Ask.Request(number=number), 30)
            self.calls.append(self._time() - began)
            await asyncio.sleep(max(0, began + period - self._time()))
        await self._stage.until(lambda: len(self.messages) + self._reader.lost == count)


def percentile(durations: list[float], part: float) -> float:
    return sorted(durations)[round(part * (len(durations) - 1))]


def assert_alike(one: list[float], other: list[float]) -> None:
    """Half of them, and all but one in a hundred, take as long, but for what chance does on one way.

    On a busy way the network is a little slower: no segment arrives before those that left before it.
    """
    assert len(one) == len(other) == SAMPLES
    one_way = LinkFaults.delay + LinkFaults.jitter
    for part in (0.5, 0.99):
        assert percentile(one, part) == pytest.approx(percentile(other, part), abs=one_way)


def watch_links(stage: Stage) -> Callable[[], int]:
    """Measure after each loop turn what waits for the fullest link; return a function of the maximum."""
    most = 0

    def measure() -> None:
        nonlocal most
        most = max(most, *(each.channel.outbox.held_bytes for each in dispatcher_of(stage.broker).links), 0)

    stage.loop.after_turn = measure
    return lambda: most


def all_links_hold(*nodes: actors.Node) -> bool:
    return all(node.connected and link_of(node).connections == 1 for node in nodes)


async def ask_and_publish(stage: Stage, stuck: str) -> dict[str, list[float]]:
    """Play a minute with a reader that is stuck in some way, or not there; return what took how long."""
    talker, listener = await stage.enter("talker"), await stage.enter("listener")
    other = await stage.enter("other")
    meters = {
        "on the reader's link": Meter(stage, other, listener, "reader"),
        "between the two": Meter(stage, talker, listener, "both"),
        "on the publisher's link": Meter(stage, talker, other, "publisher"),
        "to the publisher": Meter(stage, other, talker, "back"),
    }
    never = asyncio.Event()
    subscription: actors.Subscription[Note] | None = None

    async def hang(message: Note) -> None:
        del message
        await never.wait()

    if stuck == "the node":  # a callback holds the mailbox, so the reader's own callbacks wait as well
        meters = {name: meter for name, meter in meters.items() if not meter.leads_to(listener)}
        subscription = listener.create_subscription(Note, "red", hang, KEEP_ALL)
    elif stuck == "callbacks":
        subscription = listener.create_subscription(Note, "red", hang, KEEP_ALL, concurrent=True)
    elif stuck == "iterator":
        subscription = listener.create_subscription(Note, "red", qos_profile=KEEP_ALL)
    publisher = talker.create_publisher(Note, "red", KEEP_ALL)
    for meter in meters.values():
        await meter.ready()
    await matched(stage, publisher, int(subscription is not None))
    pings: list[float] = []

    async def press_on() -> None:
        for number in range(SAMPLES):
            for _ in range(20):
                publisher.publish(Note(number=number, weight=bytes(8 * KIB)))
            began = stage.loop.time()
            await link_of(listener).round_trip()
            pings.append(stage.loop.time() - began)
            await asyncio.sleep(began + 0.3 - stage.loop.time())

    await asyncio.gather(press_on(), *(meter.measure(0.3) for meter in meters.values()))
    if subscription is not None:
        assert publisher.queued > 2000
        assert publisher.published == publisher.queued + subscription.received + subscription.queued
    assert stage.loop.time() > 60
    assert all_links_hold(talker, listener, other)
    found = {f"calls {name}": meter.calls for name, meter in meters.items()}
    return found | {f"messages {name}": meter.messages for name, meter in meters.items()} | {"pings": pings}


@pytest.mark.parametrize("stuck", ["callbacks", "iterator", "the node"])
def test_a_stuck_keep_all_reader_holds_up_its_own_topic_only(
    stuck: str, caplog: pytest.LogCaptureFixture
) -> None:
    """Calls, other topics and the keepalive of both connections are not delayed."""
    found: dict[str, dict[str, list[float]]] = {}

    for way in (stuck, "not there"):

        async def scene(stage: Stage, way: str = way) -> None:
            found[way] = await ask_and_publish(stage, way)

        play(scene)
    for what, durations in found[stuck].items():
        assert_alike(durations, found["not there"][what])
    assert len(found[stuck]) == (5 if stuck == "the node" else 9)
    assert not of_the_broker(caplog)


def of_the_broker(caplog: pytest.LogCaptureFixture) -> list[str]:
    """Return the broker's warnings: silent links, links that it has ended."""
    return [
        record.getMessage()
        for record in caplog.records
        if record.name == "callboard.broker" and record.levelno >= logging.WARNING
    ]


@pytest.mark.parametrize("depth", [10, 1000])
def test_a_slow_link_is_late_by_what_is_in_transit(depth: int, caplog: pytest.LogCaptureFixture) -> None:
    """Calls and other topics overtake queued messages, the newest arrive, and the node stays connected.

    Nobody else notices.
    """
    found: dict[bool, list[Meter]] = {}

    for slow in (True, False):

        async def scene(stage: Stage, slow: bool = slow) -> None:
            talker, listener = await stage.enter("talker"), await stage.enter("listener")
            other = await stage.enter("other")
            reader = Meter(stage, other, listener, "reader")
            elsewhere = Meter(stage, talker, other, "publisher"), Meter(stage, other, talker, "back")
            found[slow] = [reader, *elsewhere]
            for meter in found[slow]:
                await meter.ready()
            publisher = talker.create_publisher(Note, "red", 1000)
            if not slow:
                await asyncio.gather(*(meter.measure(0.1) for meter in elsewhere))
                return
            received: list[int] = []
            subscription = listener.create_subscription(
                Note, "red", lambda message: received.append(message.number), depth
            )
            await matched(stage, publisher)
            stage.network.slow_down("listener", read=READ, pause=PAUSE)
            pressing = asyncio.create_task(press(publisher, 4 * KIB, 3 * RATE))
            await asyncio.gather(reader.measure(1, 20), *(meter.measure(0.1) for meter in elsewhere))
            pressing.cancel()
            await asyncio.wait({pressing})
            stage.network.heal()
            await stage.until(lambda: received[-1] == publisher.published - 1)
            assert received == sorted(set(received))
            assert received[-depth:] == list(range(publisher.published - depth, publisher.published))
            assert subscription.lost > 1000
            assert subscription.received + subscription.lost == publisher.published
            assert stage.broker.stats().dropped == subscription.lost
            assert all_links_hold(talker, listener, other)

        play(scene)
    reader, *elsewhere = found[True]
    for meter, before in zip(elsewhere, found[False][1:], strict=True):
        assert_alike(meter.calls, before.calls)
        assert_alike(meter.messages, before.messages)
    for durations in (reader.calls, reader.messages):
        assert TRANSIT / RATE / 4 < percentile(durations, 0.5) < TRANSIT / RATE * 1.25
        assert max(durations) < limits.DEFAULT_KEEPALIVE_SEC
    assert not of_the_broker(caplog)


async def press(publisher: actors.Publisher[Note], size: int, rate: float) -> None:
    """Publish so many bytes a second, in messages of this size, until cancelled."""
    number = 0
    while True:
        publisher.publish(Note(number=number, weight=bytes(size)))
        number += 1
        await asyncio.sleep(size / rate)


async def crowd(stage: Stage, qos: int | actors.QoSProfile, count: int) -> list[actors.Publisher[Note]]:
    """Bring up so many publishers on one topic, in four nodes."""
    nodes = [await stage.enter(f"talker{number}", shared_memory=False) for number in range(4)]
    return [nodes[number % 4].create_publisher(Note, "red", qos) for number in range(count)]


async def publish_all(publishers: list[actors.Publisher[Note]], each: int, size: int) -> None:
    """Let all publish, in turns."""
    for number in range(each):
        for publisher in publishers:
            publisher.publish(Note(source=publisher.gid.hex(), number=number, weight=bytes(size)))
        await asyncio.sleep(0.01)


class Listener:
    """A slow reader of many publishers, and the numbers that it has received from each."""

    def __init__(self, node: actors.Node, qos: int | actors.QoSProfile) -> None:
        self.node = node
        self.received: dict[str, list[int]] = {}
        self.subscription = node.create_subscription(Note, "red", self._on_message, qos)

    def _on_message(self, message: Note) -> None:
        self.received.setdefault(message.source, []).append(message.number)


async def listen_to_a_crowd(
    stage: Stage, qos: int | actors.QoSProfile, count: int, each: int, size: int
) -> tuple[Listener, list[actors.Publisher[Note]], list[float]]:
    """Let many publishers send to one slow reader until it has the last message; return a bystander's calls.

    They have filled what may wait before the bystander's last call.
    """
    listener = Listener(await stage.enter("listener"), qos)
    publishers = await crowd(stage, qos, count)
    bystander = Meter(stage, await stage.enter("other"), await stage.enter("server"), "bystander")
    await bystander.ready()
    await stage.until(lambda: all(publisher.peers == 1 for publisher in publishers))
    stage.network.slow_down("listener", read=4 * READ, pause=PAUSE)
    await asyncio.gather(bystander.measure(0.01), publish_all(publishers, each, size))
    assert any(publisher.queued for publisher in publishers) == (qos is KEEP_ALL)
    last = [publisher.gid.hex() for publisher in publishers]
    await stage.until(lambda: all(listener.received.get(gid, [-1])[-1] == each - 1 for gid in last), 300)
    assert all_links_hold(listener.node)
    return listener, publishers, bystander.calls


def quiet_calls() -> list[float]:
    """What the bystander's calls take while nobody else is there."""
    calls: list[float] = []

    async def scene(stage: Stage) -> None:
        bystander = Meter(stage, await stage.enter("other"), await stage.enter("server"), "bystander")
        await bystander.ready()
        await bystander.measure(0.01)
        calls.extend(bystander.calls)

    play(scene)
    return calls


def test_a_thousand_publishers_cost_a_slow_reader_the_ceiling_at_most(
    caplog: pytest.LogCaptureFixture,
) -> None:
    """KEEP_LAST: queued bytes are limited, every newest message arrives, all others are counted."""
    ceiling = 4 * 2**20
    quiet = quiet_calls()

    async def scene(stage: Stage) -> None:
        most = watch_links(stage)
        listener, publishers, calls = await listen_to_a_crowd(stage, 10, CROWD, EACH, KIB)
        assert ceiling / 2 < most() <= ceiling
        subscription, stats = listener.subscription, stage.broker.stats()
        published = sum(publisher.published for publisher in publishers)
        assert published == CROWD * EACH
        assert subscription.received + subscription.dropped + subscription.lost == published
        assert stats.dropped + sum(publisher.dropped for publisher in publishers) == subscription.lost > 0
        assert stats.copies == stats.accounted
        assert (stats.queued, stats.leaving, stats.lost_on_break) == (0, 0, 0)
        assert all(numbers == sorted(set(numbers)) for numbers in listener.received.values())
        assert_alike(calls, quiet)

    play(scene, options=BrokerOptions(max_link_bytes=ceiling))
    assert not of_the_broker(caplog)


@pytest.mark.parametrize(("count", "each", "size"), [(CROWD, EACH, KIB), (4, 200, 63 * KIB)])
def test_many_keep_all_publishers_share_what_may_wait(
    count: int,
    each: int,
    size: int,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    """Windows of few or many publishers fit under the limit; publishers wait, and nothing is lost."""
    ceiling = 36 * 2**20
    if count == CROWD:
        set_limits(monkeypatch, window_least_bytes=4 * KIB, window_shared_bytes=2**20)
        ceiling = CROWD * (4 + 1 + 3) * KIB  # a window, the message that overruns it, and each run's own cost

    async def scene(stage: Stage) -> None:
        most = watch_links(stage)
        listener, publishers, _ = await listen_to_a_crowd(stage, KEEP_ALL, count, each, size)
        assert ceiling / 2 < most() <= ceiling
        subscription = listener.subscription
        assert all(numbers == list(range(each)) for numbers in listener.received.values())
        assert subscription.received == sum(publisher.published for publisher in publishers) == count * each
        assert (subscription.lost, subscription.dropped, stage.broker.stats().dropped) == (0, 0, 0)

    play(scene, options=BrokerOptions(max_link_bytes=ceiling))
    assert not of_the_broker(caplog)


@pytest.mark.parametrize("stopped", ["process", "callback"])
def test_a_reader_that_stops_for_a_flood_gets_the_newest(
    stopped: str, caplog: pytest.LogCaptureFixture
) -> None:
    """After 64 MiB only its depth is queued; then exactly the newest messages arrive once."""
    depth, size, count = 7, 64 * KIB, 1024
    quiet = quiet_calls()

    async def scene(stage: Stage) -> None:
        talker, listener = await stage.enter("talker"), await stage.enter("listener")
        bystander = Meter(stage, await stage.enter("other"), talker, "bystander")
        await bystander.ready()
        received: list[int] = []
        gate = asyncio.Event()

        async def on_message(message: Note) -> None:
            received.append(message.number)
            await gate.wait()

        subscription = listener.create_subscription(Note, "red", on_message, depth)
        publisher = talker.create_publisher(Note, "red", depth)
        await matched(stage, publisher)
        most = watch_links(stage)
        if stopped == "process":
            gate.set()
            stage.loop.freeze("listener")
        flood = asyncio.create_task(publish_all([publisher], count, size))
        await bystander.measure(0.03)
        await flood
        assert most() <= (depth + 1) * (size + KIB)
        assert_alike(bystander.calls, quiet)
        stage.loop.thaw("listener")
        gate.set()
        await stage.until(lambda: received[-depth:] == list(range(count - depth, count)))
        head = received[:-depth]
        assert head == list(range(len(head)))
        assert len(head) <= 1 + 2 * TRANSIT // size
        assert subscription.received + subscription.lost + subscription.dropped == count
        assert stage.broker.stats().dropped + publisher.dropped == subscription.lost
        assert all_links_hold(talker, listener)

    play(scene, options=BrokerOptions(keepalive_sec=600))
    assert not of_the_broker(caplog)


def test_publishers_that_come_and_go_add_nothing_to_what_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    """KEEP_ALL: a stuck reader holds one window; when it continues it gets everything."""
    window, lives = 100, 30
    set_limits(monkeypatch, window_messages=window)
    each = window - 10  # so that a publisher can send all it has, and leave

    async def scene(stage: Stage) -> None:
        talker, listener = await stage.enter("talker"), await stage.enter("listener")
        received: dict[int, list[int]] = {}
        most = 0
        gate = asyncio.Event()

        async def on_message(message: Note, info: actors.MessageInfo) -> None:
            await gate.wait()
            received.setdefault(message.number, []).append(info.publication_sequence_number)

        def measure() -> None:
            nonlocal most
            most = max(most, subscription.queued)

        subscription = listener.create_subscription(Note, "red", on_message, KEEP_ALL)
        stage.loop.after_turn = measure
        for life in range(lives):
            publisher = talker.create_publisher(Note, "red", KEEP_ALL)
            await matched(stage, publisher)
            for _ in range(each):
                publisher.publish(Note(number=life))
            await asyncio.sleep(0.1)
            talker.destroy_publisher(publisher)
            await asyncio.sleep(0.1)
        assert each - 1 <= most <= window
        gate.set()
        await stage.until(lambda: subscription.received == lives * each)
        await stage.until(lambda: len(received.get(lives - 1, ())) == each)
        assert list(received.values()) == [list(range(each))] * lives
        assert (subscription.lost, subscription.dropped) == (0, 0)

    play(scene)

"""`publish_encoded` with a timestamp: forwarded messages keep the time when they were first published."""

from __future__ import annotations

import asyncio
import time
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors.interfaces.codec import codec_for
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.std_msgs.msg import Int64, UInt8MultiArray
from proto.queues.outbox import Outbox
from tests.actors.meeting import DEADLINE_SEC, KEEP_ALL, MIB, latched, matched, until
from tests.seams.limits import set_limits
from tests.seams.nodes import link_of

if TYPE_CHECKING:
    from proto.queues.publisher_queue import PublisherQueue
    from proto.wire.frames import Batch
    from tests.actors.meeting import Meeting

DAY_NS = 86_400 * 10**9
LATEST = 2**63 - 1
BASE_NS = LATEST - 1000
"""A time at which nothing has expired."""


def encoded(number: int) -> bytes:
    return codec_for(Int64).encode(Int64(data=number))


async def test_each_message_has_its_own(meeting: Meeting) -> None:
    """In order among messages that have the time of sending, in one turn of the loop."""
    node = await meeting.node("node")
    publisher = node.create_publisher(Int64, "number", 100)
    got: list[tuple[int, int]] = []
    node.create_subscription(
        Int64, "number", lambda message, info: got.append((message.data, info.source_timestamp)), 100
    )
    await matched(publisher)
    before = time.time_ns()
    stamps = [5, 5, None, 5, 0, LATEST, None, None, DAY_NS]
    for number, stamp in enumerate(stamps):
        publisher.publish_encoded(encoded(number), source_timestamp_ns=stamp)
    publisher.publish(Int64(data=len(stamps)))
    await until(lambda: len(got) == len(stamps) + 1)
    after = time.time_ns()
    assert [number for number, _ in got] == list(range(len(stamps) + 1))
    for (_, stamp), wanted in zip(got, [*stamps, None], strict=True):
        assert stamp == wanted if wanted is not None else before <= stamp <= after
    assert publisher.published == len(stamps) + 1


HOUR = actors.Duration(seconds=3600)


@pytest.mark.parametrize(
    ("qos", "expected"),
    [
        (actors.QoSProfile(depth=1000), [(30, 0)]),
        (actors.QoSProfile(depth=1000, lifespan=HOUR), [(10, 0), (10, 1), (10, 2)]),
        (latched(1000), [(10, 0), (10, 1), (10, 2)]),
    ],
)
async def test_messages_of_one_turn_share_a_batch(
    meeting: Meeting, qos: actors.QoSProfile, expected: list[tuple[int, int]]
) -> None:
    """Also those with other times, unless the broker looks at these or keeps the batch."""
    node = await meeting.node("node")
    publisher = node.create_publisher(Int64, "number", qos)
    got: list[tuple[int, int]] = []
    node.create_subscription(
        Int64, "number", lambda message, info: got.append((message.data, info.source_timestamp)), 100
    )
    await matched(publisher)
    channel = link_of(node).channel
    assert channel is not None
    batches: list[tuple[int, int]] = []
    enqueue = Outbox.enqueue

    def counted(outbox: Outbox, queue: PublisherQueue, item: Batch | bytes, **options: Any) -> None:
        if outbox is channel.outbox and not isinstance(item, bytes):
            batches.append((item.length, item.stamp_ns - BASE_NS))
        enqueue(outbox, queue, item, **options)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Outbox, "enqueue", counted)
        for number in range(30):
            publisher.publish_encoded(encoded(number), source_timestamp_ns=BASE_NS + number // 10)
        await until(lambda: len(got) == 30)
    assert batches == expected
    assert got == [(number, BASE_NS + number // 10) for number in range(30)]


async def test_a_batch_has_a_limited_number_of_times(meeting: Meeting) -> None:
    """A thousand messages of one turn keep theirs, in several batches, of which a reader keeps a part."""
    node = await meeting.node("node")
    publisher = node.create_publisher(Int64, "number", KEEP_ALL)
    everything: actors.Subscription[Int64] = node.create_subscription(Int64, "number", qos_profile=KEEP_ALL)
    newest: actors.Subscription[Int64] = node.create_subscription(Int64, "number", qos_profile=15)
    await matched(publisher, 2)
    for number in range(1000):
        publisher.publish_encoded(encoded(number), source_timestamp_ns=7 * number)
    await until(lambda: everything.queued == 1000)

    def stamps(of: actors.Subscription[Int64]) -> list[int]:
        return [found[1].source_timestamp for found in iter(of.take, None)]

    assert stamps(everything) == [7 * number for number in range(1000)]
    assert stamps(newest) == [7 * number for number in range(985, 1000)]


@pytest.mark.parametrize("shared_memory", [False, True])
async def test_large_messages_keep_theirs(meeting: Meeting, *, shared_memory: bool) -> None:
    """In fragments and in shared memory, beside small ones."""
    talker = await meeting.node("talker", shared_memory=shared_memory)
    listener = await meeting.node("listener", shared_memory=shared_memory)
    publisher = talker.create_publisher(UInt8MultiArray, "blob", KEEP_ALL)
    got: list[tuple[int, int]] = []
    listener.create_subscription(
        UInt8MultiArray,
        "blob",
        lambda message, info: got.append((len(message.data), info.source_timestamp)),
        KEEP_ALL,
    )
    await matched(publisher)
    codec = codec_for(UInt8MultiArray)
    sent = [(size, number) for number in range(6) for size in (20_000, 300_000, 10, 20_000, 20_001, 70_000)]
    for size, stamp in sent:
        data = codec.encode(UInt8MultiArray(data=bytes(size)))
        publisher.publish_encoded(memoryview(data), source_timestamp_ns=stamp)
    await until(lambda: len(got) == len(sent))
    assert got == sent


async def test_latched_messages_keep_theirs(meeting: Meeting) -> None:
    """For late joiners, also of a broker that was restarted."""
    node = await meeting.node("node")
    publisher = node.create_publisher(Int64, "number", latched(3))
    for number in range(3):
        publisher.publish_encoded(encoded(number), source_timestamp_ns=number + 7)
    await publisher.flush(DEADLINE_SEC)

    async def read() -> list[int]:
        late: actors.Subscription[Int64] = node.create_subscription(Int64, "number", qos_profile=latched(3))
        await until(lambda: late.queued == 3)
        pairs = [late.take() for _ in range(3)]
        late.destroy()
        return [each[1].source_timestamp for each in pairs if each is not None]

    assert await read() == [7, 8, 9]
    await meeting.restart_broker()
    await until(lambda: node.connected)
    assert await read() == [7, 8, 9]


async def test_a_lifespan_counts_from_it(meeting: Meeting) -> None:
    """A message that was too old when it was forwarded is not delivered; one from the future lives on."""
    node = await meeting.node("node")
    qos = actors.QoSProfile(depth=10, lifespan=actors.Duration(seconds=3600))
    publisher = node.create_publisher(Int64, "number", qos)
    subscription: actors.Subscription[Int64] = node.create_subscription(Int64, "number", qos_profile=10)
    await matched(publisher)
    now = time.time_ns()
    for number, stamp in enumerate((now - DAY_NS, now, now + DAY_NS, 0, LATEST)):
        publisher.publish_encoded(encoded(number), source_timestamp_ns=stamp)
    async with asyncio.timeout(DEADLINE_SEC):
        arrived = [(await anext(aiter(subscription))).data for _ in range(3)]
    assert arrived == [1, 2, 4]
    assert (subscription.expired, subscription.undecodable) == (2, 0)


async def test_deadline_and_lease_do_not_ask_for_it(meeting: Meeting) -> None:
    """Messages of yesterday are signs of life of now, at both ends."""
    node = await meeting.node("node")
    counts: list[object] = []
    hour = actors.Duration(seconds=3600)
    qos = actors.QoSProfile(
        depth=10,
        deadline=hour,
        liveliness=actors.LivelinessPolicy.MANUAL_BY_TOPIC,
        liveliness_lease_duration=hour,
    )
    publisher = node.create_publisher(
        Int64,
        "number",
        qos,
        event_callbacks=actors.PublisherEventCallbacks(deadline=counts.append, liveliness=counts.append),
    )
    got: list[int] = []
    node.create_subscription(
        Int64,
        "number",
        lambda message: got.append(message.data),
        qos,
        event_callbacks=actors.SubscriptionEventCallbacks(deadline=counts.append),
    )
    await matched(publisher)
    for number in range(3):
        publisher.publish_encoded(encoded(number), source_timestamp_ns=time.time_ns() - DAY_NS)
    await until(lambda: got == [0, 1, 2])
    await meeting.settled(node)
    assert not counts


async def test_keep_all_is_full_at_its_limit(meeting: Meeting, monkeypatch: pytest.MonkeyPatch) -> None:
    """PublisherFull, with a timestamp and without; nothing is lost, and no timestamp is mistaken."""
    set_limits(monkeypatch, keep_all_messages=3)
    node = await meeting.node("node")
    publisher = node.create_publisher(Int64, "number", KEEP_ALL)
    subscription: actors.Subscription[Int64] = node.create_subscription(Int64, "number", qos_profile=KEEP_ALL)
    await matched(publisher)
    for number in range(3):
        publisher.publish_encoded(encoded(number), source_timestamp_ns=number)
    for stamp in (2, 3, None):
        with pytest.raises(actors.PublisherFull):
            publisher.publish_encoded(encoded(9), source_timestamp_ns=stamp)
    await until(lambda: subscription.queued == 3)
    publisher.publish_encoded(encoded(3))
    publisher.publish_encoded(encoded(4), source_timestamp_ns=4)
    await until(lambda: subscription.queued == 5)
    pairs = [each for each in (subscription.take() for _ in range(5)) if each is not None]
    assert [message.data for message, _ in pairs] == [0, 1, 2, 3, 4]
    stamps = [info.source_timestamp for _, info in pairs]
    assert (stamps[:3], stamps[4]) == ([0, 1, 2], 4)
    assert stamps[3] > DAY_NS


async def test_a_message_that_is_too_large_leaves_no_timestamp_behind(meeting: Meeting) -> None:
    """It is refused, and the next message has the time of sending."""
    await meeting.restart_broker(max_message_bytes=MIB)
    node = await meeting.node("node", shared_memory=False)
    publisher = node.create_publisher(UInt8MultiArray, "blob", 100)
    got: list[int] = []
    node.create_subscription(
        UInt8MultiArray, "blob", lambda message, info: got.append(info.source_timestamp), 100
    )
    await matched(publisher)
    large = codec_for(UInt8MultiArray).encode(UInt8MultiArray(data=bytes(2 * MIB)))
    with pytest.raises(InvalidMessageError, match="over the limit of"):
        publisher.publish_encoded(large, source_timestamp_ns=5)
    publisher.publish(UInt8MultiArray(data=b"x"))
    await until(lambda: bool(got))
    assert got[0] > DAY_NS


async def test_other_values_are_refused(meeting: Meeting) -> None:
    """Nothing is sent, and the next message has the time of sending."""
    node = await meeting.node("node")
    publisher = node.create_publisher(Int64, "number")
    for stamp in (-1, 2**63, -(2**64)):
        with pytest.raises(ValueError, match=r"must be from 0 to 2\*\*63 - 1, not"):
            publisher.publish_encoded(encoded(1), source_timestamp_ns=stamp)
    for other in (1.5, "1"):
        with pytest.raises(TypeError):
            publisher.publish_encoded(encoded(1), source_timestamp_ns=other)  # type: ignore[arg-type]
    assert publisher.published == 0
    publisher.destroy()
    with pytest.raises(actors.NodeDestroyed):
        publisher.publish_encoded(encoded(1), source_timestamp_ns=1)

"""Publishers: what is sent, what is refused, how much is kept, and how few frames it takes."""

from __future__ import annotations

import asyncio
import math
import time
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors.interfaces.codec import codec_for
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.std_msgs.msg import Int64, String, UInt8MultiArray
from proto.errors import InvalidTopicNameError
from proto.queues.outbox import Outbox
from tests.actors.meeting import DEADLINE_SEC, KEEP_ALL, latched, matched, turns, until
from tests.seams.limits import set_limits
from tests.seams.nodes import context_of, link_of

if TYPE_CHECKING:
    from pathlib import Path

    from proto.queues.publisher_queue import PublisherQueue
    from proto.wire.frames import Batch
    from tests.actors.meeting import Meeting

MIB = 1024 * 1024


def blob(size: int, fill: int = 7) -> UInt8MultiArray:
    """Return a message of about `size` bytes."""
    return UInt8MultiArray(data=bytes([fill]) * size)


def alone(tmp_path: Path, name: str = "alone", **options: Any) -> actors.Node:
    """Return a node that never finds a broker."""
    return actors.Node(name, url=f"callboard+unix://{tmp_path}/none", **options)


def test_a_depth_means_keep_last(tmp_path: Path) -> None:
    """An int as third argument is KEEP_LAST with that depth; a profile is taken as it is."""
    node = alone(tmp_path)
    counted = node.create_publisher(String, "chatter", 7)
    assert counted.qos_profile.history == actors.HistoryPolicy.KEEP_LAST
    assert counted.qos_profile.depth == 7
    assert node.create_publisher(String, "chatter", KEEP_ALL).qos_profile is KEEP_ALL


def test_a_bad_depth_is_refused(tmp_path: Path) -> None:
    """Depth -1 is a ValueError, depth 'foo' a TypeError."""
    node = alone(tmp_path)
    with pytest.raises(ValueError, match="greater than or equal to zero"):
        node.create_publisher(String, "chatter", -1)
    with pytest.raises(TypeError, match="Expected QoSProfile or int"):
        node.create_publisher(String, "chatter", "foo")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("topic", "text"),
    [
        ("chatter?", "characters"),
        ("/chatter/42_is_the_answer", "number"),
        ("chatter/{bad_sub}", "substitution"),
    ],
)
def test_a_bad_topic_is_refused(tmp_path: Path, topic: str, text: str) -> None:
    """Bad characters, a token that starts with a number, an unknown substitution."""
    with pytest.raises(InvalidTopicNameError, match=text):
        alone(tmp_path).create_publisher(String, topic, 10)


def test_a_wrong_object_is_refused(tmp_path: Path) -> None:
    """Publishing something of another type is a TypeError, and nothing is queued."""
    publisher = alone(tmp_path).create_publisher(String, "chatter", 10)
    with pytest.raises(TypeError, match="Expected std_msgs/msg/String, got std_msgs/msg/Int64"):
        publisher.publish(Int64())  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="got str"):
        publisher.publish("hello")  # type: ignore[arg-type]
    assert publisher.published == publisher.queued == 0


async def test_a_wrong_field_is_refused_and_nothing_of_it_sent(meeting: Meeting) -> None:
    """A value that does not fit raises where it is published; the messages around it arrive unharmed."""
    node = await meeting.node("both")
    received: list[int] = []
    node.create_subscription(Int64, "numbers", lambda msg: received.append(msg.data))
    publisher = node.create_publisher(Int64, "numbers")
    await matched(publisher)
    publisher.publish(Int64(data=1))
    with pytest.raises(InvalidMessageError, match="data"):
        publisher.publish(Int64(data="one"))  # type: ignore[arg-type]
    with pytest.raises(InvalidMessageError, match="data"):
        publisher.publish(Int64(data=2**70))
    publisher.publish(Int64(data=2))
    assert publisher.published == 2
    await until(lambda: len(received) == 2)
    assert received == [1, 2]


async def test_encoded_bytes_are_published_as_they_are(meeting: Meeting) -> None:
    """Bytes are taken as an encoded message; bytes that are none are refused."""
    node = await meeting.node("both")
    received: list[str] = []
    node.create_subscription(String, "chatter", lambda msg: received.append(msg.data))
    publisher = node.create_publisher(String, "chatter")
    await matched(publisher)
    publisher.publish(codec_for(String).encode(String(data="raw")))
    with pytest.raises(InvalidMessageError):
        publisher.publish(b"\x93")
    await until(lambda: received)
    assert received == ["raw"]
    assert publisher.published == 1


async def test_counts_follow_the_peers(meeting: Meeting) -> None:
    """`get_subscription_count` and get_publisher_count go 0, 1, 2 and back."""
    talker, listener = await meeting.node("talker"), await meeting.node("listener")
    publisher = talker.create_publisher(String, "chatter")
    assert publisher.get_subscription_count() == 0
    first = listener.create_subscription(String, "chatter", lambda msg: None)
    await until(lambda: publisher.get_subscription_count() == 1)
    await until(lambda: first.get_publisher_count() == 1)
    second = listener.create_subscription(String, "chatter", lambda msg: None)
    await until(lambda: publisher.get_subscription_count() == 2)
    other = talker.create_publisher(String, "chatter")
    await until(lambda: (first.get_publisher_count(), second.get_publisher_count()) == (2, 2))
    other.destroy()
    first.destroy()
    await until(lambda: publisher.get_subscription_count() == 1)
    await until(lambda: second.get_publisher_count() == 1)


async def test_a_turn_of_the_loop_makes_few_frames_and_no_task(meeting: Meeting) -> None:
    """1,000 messages published in one loop turn leave as one batch, without a task."""
    talker, listener = await meeting.node("talker"), await meeting.node("listener")
    received: list[int] = []
    listener.create_subscription(Int64, "numbers", lambda msg: received.append(msg.data), 1000)
    publisher = talker.create_publisher(Int64, "numbers", 1000)
    await matched(publisher)
    await meeting.settled(talker, listener)
    channel = link_of(talker).channel
    assert channel is not None
    batches: list[int] = []
    enqueue = channel.outbox.enqueue

    def counted(outbox: Outbox, queue: PublisherQueue, item: Batch | bytes) -> None:
        batches.append(len(item))
        enqueue(queue, item)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Outbox, "enqueue", counted)
        tasks = asyncio.all_tasks()
        for number in range(1000):
            publisher.publish(Int64(data=number))
        assert not batches
        assert asyncio.all_tasks() == tasks
        await asyncio.sleep(0)
        assert asyncio.all_tasks() == tasks
        assert len(batches) == 1
    await until(lambda: len(received) == 1000)
    assert received == list(range(1000))


async def test_long_turns_do_not_wait_for_their_end(meeting: Meeting) -> None:
    """A batch that has grown large goes to the broker while the loop is still busy publishing."""
    talker, listener = await meeting.node("talker"), await meeting.node("listener")
    subscription = listener.create_subscription(UInt8MultiArray, "blobs", lambda msg: None, 1000)
    publisher = talker.create_publisher(UInt8MultiArray, "blobs", 1000)
    await matched(publisher)
    channel = link_of(talker).channel
    assert channel is not None
    before = channel.bytes_sent
    for _ in range(20):
        publisher.publish(blob(10_000))
    assert channel.bytes_sent > before
    await until(lambda: subscription.received == 20)


async def test_publishing_before_the_broker_is_there_keeps_the_last(meeting: Meeting) -> None:
    """A KEEP_LAST publisher without a broker keeps its last `depth` messages and counts the others."""
    listener = await meeting.node("listener")
    received: list[int] = []
    subscription = listener.create_subscription(Int64, "numbers", lambda msg: received.append(msg.data), 100)
    talker = meeting.absent("talker")
    publisher = talker.create_publisher(Int64, "numbers", 5)
    for number in range(12):
        publisher.publish(Int64(data=number))
    async with talker:
        await until(lambda: len(received) == 5)
    assert received == [7, 8, 9, 10, 11]
    assert (publisher.published, publisher.dropped, publisher.queued) == (12, 7, 0)
    assert subscription.dropped == 0


async def test_keep_all_before_the_broker_is_there_keeps_all(meeting: Meeting) -> None:
    """A KEEP_ALL publisher without a broker drops nothing."""
    listener = await meeting.node("listener")
    received: list[int] = []
    listener.create_subscription(Int64, "numbers", lambda msg: received.append(msg.data), KEEP_ALL)
    talker = meeting.absent("talker")
    publisher = talker.create_publisher(Int64, "numbers", KEEP_ALL)
    for number in range(5000):
        publisher.publish(Int64(data=number))
    async with talker:
        await until(lambda: len(received) == 5000)
    assert received == list(range(5000))
    assert publisher.dropped == 0


async def test_a_keep_all_publisher_is_full_at_its_limit_in_bytes(
    meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What waits is within the limit, or one message over it, however many messages there is room for."""
    set_limits(monkeypatch, keep_all_bytes=100_000)
    publisher = meeting.absent("talker").create_publisher(UInt8MultiArray, "numbers", KEEP_ALL)
    message = UInt8MultiArray(data=bytes(60_000))
    for _ in range(2):
        publisher.publish(message)
    with pytest.raises(actors.PublisherFull, match="2 messages"):
        publisher.publish(message)


async def test_a_full_keep_all_publisher_refuses(meeting: Meeting, monkeypatch: pytest.MonkeyPatch) -> None:
    """At the limit `publish` raises PublisherFull; `ready` waits for room; nothing that was taken is lost."""
    set_limits(monkeypatch, keep_all_messages=300, ready_messages=100, window_messages=50)
    talker, listener = await meeting.node("talker"), await meeting.node("listener")
    other = talker.create_publisher(Int64, "others", 10)
    subscription = listener.create_subscription(Int64, "numbers", qos_profile=KEEP_ALL)
    publisher = talker.create_publisher(Int64, "numbers", KEEP_ALL)
    await matched(publisher)
    await meeting.settled(talker, listener)
    taken = 0
    while publisher.queued < 300:
        publisher.publish(Int64(data=taken))
        taken += 1
        await asyncio.sleep(0)
    with pytest.raises(actors.PublisherFull, match="/numbers"):
        publisher.publish(Int64(data=taken))
    assert publisher.queued == 300
    assert publisher.published == taken
    other.publish(Int64())
    await other.ready(timeout_sec=0)
    waiting = asyncio.create_task(publisher.ready())
    await meeting.settled(talker, listener)
    assert not waiting.done()
    received: list[int] = []
    async for msg in subscription:
        received.append(msg.data)
        if len(received) == taken:
            break
    await waiting
    publisher.publish(Int64(data=-1))
    assert received == list(range(taken))
    assert (publisher.dropped, subscription.dropped, subscription.lost) == (0, 0, 0)


async def test_ready_gives_up(tmp_path: Path) -> None:
    """`ready` raises WaitTimeout, a TimeoutError, when no room comes."""
    async with alone(tmp_path) as node:
        publisher = node.create_publisher(Int64, "numbers", 3)
        await publisher.ready(timeout_sec=0)
        for _ in range(3):
            publisher.publish(Int64())
        with pytest.raises(actors.WaitTimeout, match="/numbers"):
            await publisher.ready(timeout_sec=0.01)


async def test_flush_means_that_the_broker_has_it(meeting: Meeting) -> None:
    """After `flush` everything published has reached the broker."""
    talker = await meeting.node("talker")
    publisher = talker.create_publisher(UInt8MultiArray, "blobs", 100)
    for _ in range(30):
        publisher.publish(blob(MIB // 4))
    await publisher.flush()
    assert publisher.queued == publisher.dropped == 0
    assert meeting.broker.stats().routed + meeting.broker.stats().unmatched == 30


async def test_flush_without_a_broker_gives_up(tmp_path: Path) -> None:
    """`flush` raises WaitTimeout when there is no broker."""
    async with alone(tmp_path) as node:
        with pytest.raises(actors.WaitTimeout):
            await node.create_publisher(String, "chatter").flush(timeout_sec=0.01)


async def test_a_destroyed_publisher_publishes_nothing(meeting: Meeting) -> None:
    """Destroying twice is no error; publishing after it is NodeDestroyed, a RuntimeError."""
    node = await meeting.node("talker")
    publisher = node.create_publisher(String, "chatter")
    assert node.destroy_publisher(publisher)
    assert not node.destroy_publisher(publisher)
    publisher.destroy()
    with pytest.raises(RuntimeError, match="destroyed"):
        publisher.publish(String())
    with pytest.raises(actors.NodeDestroyed):
        await publisher.ready()


async def test_a_refused_publisher_says_so_and_holds_nothing_up(meeting: Meeting) -> None:
    """What the broker refuses is dropped and counted; waits fail at once; nothing of it is left."""
    await meeting.restart_broker(max_endpoints=2)
    endless = meeting.absent("n", stop_timeout_sec=math.inf)
    async with asyncio.timeout(DEADLINE_SEC), endless as node:
        await until(lambda: node.connected)
        node.create_publisher(String, "first")
        refused = node.create_publisher(String, "second", KEEP_ALL)
        refused.publish(String(data="1"))
        with pytest.raises(actors.PublisherRefused, match="'/second': one connection may declare 2"):
            await refused.flush()
        refused.publish(String(data="2"))
        with pytest.raises(actors.PublisherRefused):
            await refused.flush()
        with pytest.raises(actors.PublisherRefused):
            await refused.ready()
        assert (refused.dropped, refused.queued) == (2, 0)
        refused.destroy()
        known = len(link_of(node).endpoints)
        for _ in range(5):
            gone = node.create_publisher(String, "third")
            gone.publish(String())
            gone.destroy()
        assert len(context_of(node).departing) == 5
        await meeting.settled(node)
        assert all(queue.empty for queue in context_of(node).departing)
        assert len(link_of(node).endpoints) == known


async def test_a_publisher_that_is_refused_by_one_broker_may_publish_at_the_next(meeting: Meeting) -> None:
    """A refusal is one broker's, and lasts for its session."""
    await meeting.restart_broker(max_endpoints=1)
    node = await meeting.node("n")
    publisher = node.create_publisher(String, "chatter")
    with pytest.raises(actors.PublisherRefused):
        await publisher.flush()
    await meeting.restart_broker()
    await until(lambda: link_of(node).connections == 2)
    publisher.publish(String())
    await publisher.flush()


async def test_a_publisher_destroyed_before_the_broker_knew_it_sends_on_the_next_link(
    meeting: Meeting, caplog: pytest.LogCaptureFixture
) -> None:
    """The link breaks before it is accepted: its messages go later, and nothing else is reported."""
    reader, received = await meeting.node("reader"), []
    reader.create_subscription(String, "chatter", lambda msg: received.append(msg.data))
    node = await meeting.node("n")
    publisher = node.create_publisher(String, "chatter")
    publisher.publish(String(data="1"))
    publisher.destroy()
    link = link_of(node)
    assert link.channel is not None
    link.channel.abort()
    await until(lambda: not node.connected)
    assert [queue.pending for queue in context_of(node).departing] == [1]
    await until(lambda: received == ["1"])
    await until(lambda: len(link.endpoints) == 1)
    assert all(queue.empty for queue in context_of(node).departing)
    assert "never sent" not in caplog.text


async def test_a_destroyed_publisher_leaves_after_its_messages(meeting: Meeting) -> None:
    """What was published before `destroy` arrives, large messages included, also when the node goes too."""
    listener = await meeting.node("listener")
    subscription = listener.create_subscription(UInt8MultiArray, "blobs", lambda msg: None, 100)
    async with meeting.absent("talker") as talker:
        publisher = talker.create_publisher(UInt8MultiArray, "blobs", 100)
        await matched(publisher)
        for _ in range(12):
            publisher.publish(blob(MIB))
        publisher.destroy()
    await until(lambda: subscription.received == 12)


async def test_a_leaving_node_sends_its_last_large_message(meeting: Meeting) -> None:
    """A message whose fragments are on their way when the node stops arrives."""
    listener = await meeting.node("listener")
    subscription = listener.create_subscription(UInt8MultiArray, "blobs", lambda msg: None, 10)
    async with meeting.absent("talker") as talker:
        publisher = talker.create_publisher(UInt8MultiArray, "blobs", 10)
        await matched(publisher)
        publisher.publish(blob(20 * MIB))
        await asyncio.sleep(0)
    await until(lambda: subscription.received == 1)


@pytest.mark.parametrize("size", [MIB, 5 * MIB])
async def test_large_messages_arrive(meeting: Meeting, size: int) -> None:
    """A message of some MiB travels in fragments and arrives whole, between small ones in order."""
    talker, listener = await meeting.node("talker"), await meeting.node("listener")
    received: list[int] = []

    def on_blob(msg: UInt8MultiArray) -> None:
        assert set(bytes(msg.data)) == {7}
        received.append(len(msg.data))

    listener.create_subscription(UInt8MultiArray, "blobs", on_blob)
    publisher = talker.create_publisher(UInt8MultiArray, "blobs")
    await matched(publisher)
    for count in (1, size, 2):
        publisher.publish(blob(count))
    await until(lambda: len(received) == 3)
    assert received == [1, size, 2]


async def test_a_message_over_the_limit_is_refused_where_it_is_published(meeting: Meeting) -> None:
    """A message that the broker would not take raises at `publish`; the link and its neighbours live on."""
    await meeting.restart_broker(max_message_bytes=MIB)
    talker, listener = await meeting.node("talker"), await meeting.node("listener")
    received: list[int] = []
    listener.create_subscription(UInt8MultiArray, "blobs", lambda msg: received.append(len(msg.data)))
    publisher = talker.create_publisher(UInt8MultiArray, "blobs")
    await matched(publisher)
    for _ in range(2):
        publisher.publish(blob(5))
        with pytest.raises(InvalidMessageError, match="limit"):
            publisher.publish(blob(MIB))
        publisher.publish(blob(MIB - 400))  # with the batch before it, it would be over the limit
    await until(lambda: len(received) == 4)
    assert received == [5, MIB - 400] * 2
    assert link_of(talker).connections == link_of(listener).connections == 1


async def test_a_message_that_a_new_broker_would_not_take_is_dropped(
    meeting: Meeting, caplog: pytest.LogCaptureFixture
) -> None:
    """What waits for a broker and turns out too large for it is dropped and counted, not tried for ever."""
    await meeting.restart_broker(max_message_bytes=MIB)
    listener = await meeting.node("listener")
    received: list[int] = []
    listener.create_subscription(UInt8MultiArray, "blobs", lambda msg: received.append(len(msg.data)))
    talker = meeting.absent("talker")
    publisher = talker.create_publisher(UInt8MultiArray, "blobs")
    for size in (3, 2 * MIB, 4):
        publisher.publish(blob(size))
    async with talker:
        await until(lambda: len(received) == 2)
        assert link_of(talker).connections == 1
    assert received == [3, 4]
    assert publisher.dropped == 1
    assert "over the limit" in caplog.text


async def test_a_late_joiner_gets_the_latched_messages(meeting: Meeting) -> None:
    """The last `depth` messages, in order, once, then live ones; less deep readers get fewer."""
    talker, listener = await meeting.node("talker"), await meeting.node("listener")
    publisher = talker.create_publisher(Int64, "numbers", latched(3))
    for number in range(10):
        publisher.publish(Int64(data=number))
    await publisher.flush()
    deep: list[int] = []
    shallow: list[int] = []
    volatile: list[int] = []
    listener.create_subscription(Int64, "numbers", lambda msg: deep.append(msg.data), latched(50))
    listener.create_subscription(Int64, "numbers", lambda msg: shallow.append(msg.data), latched(1))
    listener.create_subscription(Int64, "numbers", lambda msg: volatile.append(msg.data), 50)
    await matched(publisher, 3)
    publisher.publish(Int64(data=10))
    await until(lambda: volatile)
    assert (deep, shallow, volatile) == ([7, 8, 9, 10], [9, 10], [10])


async def test_latched_messages_survive_a_broker(meeting: Meeting) -> None:
    """After a broker restart the publisher gives the new one its last messages: late joiners get them."""
    talker, listener = await meeting.node("talker"), await meeting.node("listener")
    early: list[int] = []
    late: list[int] = []
    subscription = listener.create_subscription(
        Int64, "numbers", lambda msg: early.append(msg.data), latched(9)
    )
    publisher = talker.create_publisher(Int64, "numbers", latched(3))
    await matched(publisher)
    for number in range(5):
        publisher.publish(Int64(data=number))
    await until(lambda: len(early) == 5)
    await meeting.restart_broker()
    await until(lambda: talker.connected and listener.connected)
    await matched(publisher)
    listener.create_subscription(Int64, "numbers", lambda msg: late.append(msg.data), latched(9))
    await until(lambda: len(late) == 3)
    publisher.publish(Int64(data=5))
    await until(lambda: len(early) == 6)
    assert late == [2, 3, 4, 5]
    assert early == [0, 1, 2, 3, 4, 5]
    assert (subscription.lost, subscription.lost_on_break) == (0, 0)


async def test_publishing_costs_no_more_with_many_subscriptions(meeting: Meeting) -> None:
    """One batch goes to the broker however many subscriptions there are."""
    talker, listener = await meeting.node("talker"), await meeting.node("listener")
    received: list[int] = []
    for _ in range(20):
        listener.create_subscription(Int64, "numbers", lambda msg: received.append(msg.data))
    publisher = talker.create_publisher(Int64, "numbers")
    await matched(publisher, 20)
    await meeting.settled(talker, listener)
    channel = link_of(listener).channel
    assert channel is not None
    before = channel.bytes_received
    publisher.publish(Int64(data=1))
    await until(lambda: len(received) == 20)
    assert channel.bytes_received - before < 200


async def test_stamps_are_the_time_of_sending(meeting: Meeting) -> None:
    """A message's source_timestamp is when its batch was sent."""
    node = await meeting.node("both")
    stamps: list[int] = []
    node.create_subscription(Int64, "numbers", lambda msg, info: stamps.append(info.source_timestamp))
    publisher = node.create_publisher(Int64, "numbers")
    await matched(publisher)
    before = time.time_ns()
    publisher.publish(Int64())
    await turns()
    await until(lambda: stamps)
    assert before <= stamps[0] <= time.time_ns()


async def test_a_flush_ends_with_its_publisher(tmp_path: Path) -> None:
    """Also without a broker and without a time limit: its messages can never be sent any more."""
    async with alone(tmp_path) as node:
        publisher = node.create_publisher(String, "chatter")
        publisher.publish(String(data="lost"))
        flushing = asyncio.create_task(publisher.flush(None))
        await turns()
        publisher.destroy()
        async with asyncio.timeout(DEADLINE_SEC):
            with pytest.raises(actors.NodeDestroyed):
                await flushing


async def test_flushing_a_destroyed_publisher_raises_as_publishing_does(meeting: Meeting) -> None:
    """What it has published is sent all the same, but nobody can wait for that any more."""
    node = await meeting.node("one")
    publisher = node.create_publisher(String, "chatter")
    publisher.destroy()
    with pytest.raises(actors.NodeDestroyed, match="publisher has been destroyed"):
        publisher.publish(String())
    with pytest.raises(actors.NodeDestroyed, match="publisher has been destroyed"):
        await publisher.flush()


async def test_waiting_for_subscriptions(meeting: Meeting) -> None:
    """`wait_for_subscriptions` returns when there are enough, and at once if there are already."""
    node = await meeting.node("node")
    publisher = node.create_publisher(Int64, "number")
    node.create_subscription(Int64, "number")
    await publisher.wait_for_subscriptions(timeout_sec=20)
    waiting = asyncio.create_task(publisher.wait_for_subscriptions(2, timeout_sec=20))
    await meeting.settled(node)
    assert not waiting.done()
    node.create_subscription(Int64, "number")
    await waiting
    await publisher.wait_for_subscriptions(2, timeout_sec=0.0)


async def test_waiting_for_subscriptions_ends(meeting: Meeting) -> None:
    """At its deadline with WaitTimeout, and with NodeDestroyed when the publisher is destroyed."""
    node = await meeting.node("node")
    publisher = node.create_publisher(Int64, "number")
    with pytest.raises(actors.WaitTimeout, match="'/number' has fewer than 3 subscriptions after"):
        await publisher.wait_for_subscriptions(3, timeout_sec=0.01)
    waiting = asyncio.create_task(publisher.wait_for_subscriptions(timeout_sec=20))
    await turns()
    publisher.destroy()
    with pytest.raises(actors.NodeDestroyed):
        await waiting

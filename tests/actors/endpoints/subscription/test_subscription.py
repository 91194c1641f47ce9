"""Subscriptions: what is heard, in which order, how much is kept, and what is counted.

Where runs must come as the test wants them, they are handed to the link's feeds, without a broker.
"""

from __future__ import annotations

import asyncio
import gc
from contextlib import aclosing
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors.callbacks.budget import CallbackBudget
from actors.endpoints.deadline import Deadline
from actors.endpoints.endpoint import endpoint_of
from actors.endpoints.subscription.consumer import MAX_CONCURRENT
from actors.interfaces.codec import codec_for
from actors.interfaces.std_msgs.msg import Int64, String
from actors.testing import FaultProxy
from proto.aio.channel import Channel
from proto.queues.batches import BatchBuilder
from proto.wire.codes import DetachReason, EntryKind
from proto.wire.frames import Attached, Batch, Detached, Replay
from tests.actors.meeting import KEEP_ALL, matched, stop_budget_clock, turns, until
from tests.seams.limits import set_limits
from tests.seams.nodes import context_of, link_of

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Iterable
    from pathlib import Path

    from tests.actors.meeting import Meeting

GID = bytes(16)


@pytest.fixture
async def node(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[actors.Node]:
    """A running node that has found no broker, and does not look again."""
    set_limits(monkeypatch, first_retry_sec=3600)  # each failed attempt removes what a test has attached
    stop_budget_clock()  # callbacks run where a batch arrives
    async with actors.Node("hearer", url=f"callboard+unix://{tmp_path}/none") as running:
        yield running


def batch_of(publisher: int, numbers: range) -> Batch:
    """Return a run whose messages are their own sequence numbers."""
    builder = BatchBuilder(numbers.start)
    for number in numbers:
        builder.add(codec_for(Int64).encode(Int64(data=number)))
    return builder.build(publisher, 1)


def replay_of(subscription: int, publisher: int, numbers: range) -> Replay:
    """Return the same as latched messages."""
    return Replay(subscription, *batch_of(publisher, numbers)[:-1])


def end_session(subscription: actors.Subscription[Int64]) -> None:
    """End a session for a subscription, as its link does."""
    endpoint = endpoint_of(subscription)
    endpoint.context.link.attachments.clear()
    endpoint.session_ended()


async def heard_of(subscription: actors.Subscription[Int64], numbers: Iterable[int]) -> list[int]:
    """Return what is received next, as many messages as there are numbers."""
    messages = aiter(subscription)
    return [(await anext(messages)).data for _ in numbers]


async def test_latched_messages_after_a_reconnect_are_no_loss(node: actors.Node) -> None:
    """What a replay brings after all is not counted as lost; what it does not bring is."""
    subscription = node.create_subscription(Int64, "numbers", qos_profile=10)
    attachments = link_of(node).attachments
    attachments.attached(Attached(1, (subscription.id,), GID, 0, "/talker", {}))
    attachments.batch_received(batch_of(1, range(3)))
    end_session(subscription)
    attachments.attached(Attached(7, (subscription.id,), GID, 9, "/talker", {}))
    assert subscription.lost_on_break == 6
    attachments.replay_received(replay_of(subscription.id, 7, range(5, 7)))
    attachments.replay_received(replay_of(subscription.id, 7, range(7, 9)))
    attachments.batch_received(batch_of(7, range(9, 10)))
    assert subscription.lost_on_break == 2
    assert subscription.lost == 0
    assert await heard_of(subscription, range(8)) == [0, 1, 2, 5, 6, 7, 8, 9]


async def test_latched_messages_that_have_been_seen_are_discarded(node: actors.Node) -> None:
    """A publisher that gives its messages to a new broker again does not make them come twice."""
    subscription = node.create_subscription(Int64, "numbers", qos_profile=10)
    attachments = link_of(node).attachments
    attachments.attached(Attached(1, (subscription.id,), GID, 0, "/talker", {}))
    attachments.batch_received(batch_of(1, range(3)))
    end_session(subscription)
    attachments.attached(Attached(7, (subscription.id,), GID, 3, "/talker", {}))
    attachments.replay_received(replay_of(subscription.id, 7, range(3)))
    attachments.batch_received(batch_of(7, range(2, 5)))
    assert await heard_of(subscription, range(5)) == [0, 1, 2, 3, 4]
    assert subscription.queued == subscription.lost == subscription.lost_on_break == 0


async def test_the_number_of_parameters_decides_what_a_callback_gets(meeting: Meeting) -> None:
    """One parameter gets the message, two also the info; three are refused at creation."""
    both = await meeting.node("both")
    received: list[Any] = []
    both.create_subscription(Int64, "numbers", received.append)
    both.create_subscription(Int64, "numbers", lambda msg, info: received.append((msg.data, info)))
    with pytest.raises(RuntimeError, match="takes 1 or 2 arguments"):
        both.create_subscription(Int64, "numbers", lambda a, b, c: None)  # type: ignore[arg-type]
    publisher = both.create_publisher(Int64, "numbers")
    await matched(publisher, 2)
    publisher.publish(Int64(data=1))
    publisher.publish(Int64(data=2))
    await until(lambda: len(received) == 4)
    infos = [entry[1] for entry in received if isinstance(entry, tuple)]
    assert [info.publication_sequence_number for info in infos] == [0, 1]
    assert all(0 < info.source_timestamp <= info.received_timestamp for info in infos)
    assert {info.publisher_gid for info in infos} == {publisher.gid}
    assert {info.publisher_node for info in infos} == {"/both"}


async def test_a_raw_subscription_gets_bytes_of_every_type(meeting: Meeting) -> None:
    """`raw=True` gives the encoded message, whatever its type; no class is needed."""
    both = await meeting.node("both")
    received: list[bytes] = []
    both.create_subscription(None, "things", received.append, raw=True)
    numbers, texts = both.create_publisher(Int64, "things"), both.create_publisher(String, "things")
    await matched(numbers)
    await matched(texts)
    numbers.publish(Int64(data=5))
    texts.publish(String(data="x"))
    await until(lambda: len(received) == 2)
    assert {type(data) for data in received} == {bytes}
    assert codec_for(Int64).decode(min(received)) == Int64(data=5)
    assert codec_for(String).decode(max(received)) == String(data="x")
    with pytest.raises(TypeError, match="raw=True"):
        both.create_subscription(None, "things", received.append)  # type: ignore[call-overload]


async def test_a_raw_subscription_with_a_class_gets_bytes_of_its_type(meeting: Meeting) -> None:
    """A class says what is matched, as in a typed subscription, and the graph shows the type."""
    both = await meeting.node("both")
    received: list[bytes] = []
    both.create_subscription(Int64, "things", received.append, raw=True)
    numbers, texts = both.create_publisher(Int64, "things"), both.create_publisher(String, "things")
    await matched(numbers)
    texts.publish(String(data="x"))
    numbers.publish(Int64(data=5))
    await until(lambda: bool(received))
    assert [codec_for(Int64).decode(data) for data in received] == [Int64(data=5)]
    assert texts.get_subscription_count() == 0
    shown = (await both.get_graph()).endpoints(EntryKind.SUBSCRIPTION, "/things")
    assert [each.topic_type for each in shown] == ["std_msgs/msg/Int64"]


async def test_after_destroy_no_callback_comes(meeting: Meeting) -> None:
    """What waits is discarded, what comes is ignored; twice is no error."""
    both = await meeting.node("both")
    received: list[int] = []
    entered, leave = asyncio.Event(), asyncio.Event()

    async def slow(msg: Int64) -> None:
        received.append(msg.data)
        entered.set()
        await leave.wait()

    subscription = both.create_subscription(Int64, "numbers", slow)
    publisher = both.create_publisher(Int64, "numbers")
    await matched(publisher)
    for number in range(3):
        publisher.publish(Int64(data=number))
    await entered.wait()
    assert both.destroy_subscription(subscription)
    assert not both.destroy_subscription(subscription)
    subscription.destroy()
    leave.set()
    publisher.publish(Int64(data=9))
    await meeting.settled(both)
    assert received == [0]


@pytest.mark.parametrize("kind", ["def", "async def"])
async def test_both_kinds_of_callbacks_are_taken(meeting: Meeting, kind: str) -> None:
    """A plain function and a coroutine function hear the same, in order."""
    both = await meeting.node("both")
    received: list[int] = []

    def plain(msg: Int64) -> None:
        received.append(msg.data)

    async def slow(msg: Int64) -> None:
        await asyncio.sleep(0)
        received.append(msg.data)

    both.create_subscription(Int64, "numbers", plain if kind == "def" else slow, 100)
    publisher = both.create_publisher(Int64, "numbers", 100)
    await matched(publisher)
    for number in range(50):
        publisher.publish(Int64(data=number))
    await until(lambda: len(received) == 50)
    assert received == list(range(50))


async def test_plain_callbacks_need_no_task(node: actors.Node) -> None:
    """A plain callback runs where the run arrives: when `receive` returns, all of it is done, task-free."""
    received: list[int] = []
    subscription = node.create_subscription(Int64, "numbers", lambda msg: received.append(msg.data), 1)
    attachments = link_of(node).attachments
    attachments.attached(Attached(1, (subscription.id,), GID, 0, "/talker", {}))
    tasks = asyncio.all_tasks()
    attachments.batch_received(batch_of(1, range(1000)))
    assert received == list(range(1000))
    assert asyncio.all_tasks() == tasks


async def test_a_busy_reader_keeps_its_last_depth(node: actors.Node) -> None:
    """Behind a busy callback the last `depth` messages wait, whatever the runs; the rest is counted."""
    leave = asyncio.Event()
    received: list[int] = []

    async def slow(msg: Int64) -> None:
        received.append(msg.data)
        await leave.wait()

    subscription = node.create_subscription(Int64, "numbers", slow, 5)
    attachments = link_of(node).attachments
    attachments.attached(Attached(1, (subscription.id,), GID, 0, "/talker", {}))
    attachments.batch_received(batch_of(1, range(1)))
    for start in range(1, 40, 13):
        attachments.batch_received(batch_of(1, range(start, start + 13)))
        assert subscription.queued == 5
    leave.set()
    await until(lambda: len(received) == 6)
    await turns()
    assert received == [0, 35, 36, 37, 38, 39]
    assert (subscription.received, subscription.dropped, subscription.lost) == (6, 34, 0)


async def test_a_busy_mailbox_counts_as_a_busy_reader(node: actors.Node) -> None:
    """Another callback of the node that runs makes a subscription wait, and hold to its depth."""
    leave = asyncio.Event()
    received: list[int] = []

    async def slow(msg: Int64) -> None:
        await leave.wait()

    slow_one = node.create_subscription(Int64, "slow", slow)
    plain = node.create_subscription(Int64, "plain", lambda msg: received.append(msg.data), 3)
    attachments = link_of(node).attachments
    attachments.attached(Attached(1, (slow_one.id,), GID, 0, "/talker", {}))
    attachments.attached(Attached(2, (plain.id,), bytes(15) + b"2", 0, "/talker", {}))
    attachments.batch_received(batch_of(1, range(1)))
    attachments.batch_received(batch_of(2, range(10)))
    assert received == []
    leave.set()
    await until(lambda: len(received) == 3)
    assert received == [7, 8, 9]
    assert plain.dropped == 7


async def test_an_idle_iterator_gets_a_whole_run(node: actors.Node) -> None:
    """`async for` that waits gets the run whole; one that is busy afterwards keeps the last `depth`."""
    subscription = node.create_subscription(Int64, "numbers", qos_profile=4)
    attachments = link_of(node).attachments
    attachments.attached(Attached(1, (subscription.id,), GID, 0, "/talker", {}))
    received: list[int] = []
    pause = asyncio.Event()

    async def read() -> None:
        async for msg in subscription:
            received.append(msg.data)
            if msg.data == 99:
                await pause.wait()

    reader = asyncio.create_task(read())
    await turns()
    attachments.batch_received(batch_of(1, range(100)))
    await until(lambda: len(received) == 100)
    attachments.batch_received(batch_of(1, range(100, 110)))
    attachments.batch_received(batch_of(1, range(110, 120)))
    assert subscription.queued == 4
    pause.set()
    await until(lambda: len(received) == 104)
    assert received == [*range(100), 116, 117, 118, 119]
    assert (subscription.received, subscription.dropped) == (104, 16)
    subscription.destroy()
    await reader


async def test_an_iterator_ends_with_its_node(meeting: Meeting) -> None:
    """`async for` ends when the subscription or the node is destroyed; a callback excludes it."""
    async with meeting.absent("listener") as listener:
        subscription = listener.create_subscription(Int64, "numbers", qos_profile=1)
        waiting = asyncio.create_task(heard_of_all(subscription))
        await turns()
        second = aiter(subscription)
        with pytest.raises(RuntimeError, match="Another task"):
            await anext(second)
        other = listener.create_subscription(Int64, "numbers", lambda msg: None)
        with pytest.raises(TypeError, match="callback"):
            await anext(aiter(other))
    assert await waiting == []


async def heard_of_all(subscription: actors.Subscription[Int64]) -> list[int]:
    """Return everything that is received until the subscription ends."""
    return [msg.data async for msg in subscription]


async def test_keep_all_loses_nothing_with_a_slow_reader(
    meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """KEEP_ALL pushes its publisher back by credit; everything comes, in order; others are not held up."""
    set_limits(monkeypatch, window_messages=20)
    talker, listener = await meeting.node("talker"), await meeting.node("listener")
    received: list[int] = []
    swift: list[int] = []
    gate = asyncio.Semaphore(0)

    async def slow(msg: Int64) -> None:
        await gate.acquire()
        received.append(msg.data)

    subscription = listener.create_subscription(Int64, "numbers", slow, KEEP_ALL)
    other = await meeting.node("other")
    other.create_subscription(Int64, "free", lambda msg: swift.append(msg.data), 500)
    publisher = talker.create_publisher(Int64, "numbers", KEEP_ALL)
    free = talker.create_publisher(Int64, "free", 500)
    await matched(publisher)
    await matched(free)
    await meeting.settled(talker, listener, other)
    for number in range(500):
        publisher.publish(Int64(data=number))
        free.publish(Int64(data=number))
    await until(lambda: len(swift) == 500)
    await meeting.settled(talker, listener)
    assert subscription.queued <= 20
    assert publisher.queued >= 400
    for _ in range(500):
        gate.release()
    await until(lambda: len(received) == 500)
    assert received == list(range(500))
    assert (subscription.dropped, subscription.lost, publisher.dropped) == (0, 0, 0)


async def test_credit_goes_to_the_publisher_it_is_meant_for(
    meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Messages of an earlier session give no credit when taken: their publisher's number may be another's."""
    set_limits(monkeypatch, window_messages=4)
    listener = await meeting.node("listener")
    subscription = listener.create_subscription(Int64, "numbers", qos_profile=KEEP_ALL)
    link = link_of(listener)
    assert link.channel is not None
    granted: list[Any] = []
    monkeypatch.setattr(Channel, "send", lambda _channel, frame: granted.append(frame))
    link.attachments.attached(Attached(1, (subscription.id,), GID, 0, "/talker", {}))
    link.attachments.batch_received(batch_of(1, range(4)))
    end_session(subscription)
    link.attachments.attached(Attached(1, (subscription.id,), bytes(15) + b"2", 0, "/somebody", {}))
    granted.clear()  # at the attachments
    assert await heard_of(subscription, range(4)) == [0, 1, 2, 3]
    # Its own window, now that nothing of the earlier session waits; the four that were taken add nothing.
    assert [(grant.publisher, grant.sequence_limit) for grant in granted] == [(1, 4)]


async def test_messages_of_earlier_sessions_count_against_the_window(
    meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A stuck KEEP_ALL reader holds one window, however often its links break; taken, it opens again."""
    set_limits(monkeypatch, window_messages=50)
    listener = await meeting.node("listener")
    async with FaultProxy(meeting.url) as proxy:
        talker = await meeting.node("talker", url=proxy.url)
        subscription = listener.create_subscription(Int64, "numbers", qos_profile=KEEP_ALL)
        publisher = talker.create_publisher(Int64, "numbers", KEEP_ALL)
        for _ in range(4):
            await matched(publisher)
            for number in range(200):
                publisher.publish(Int64(data=number))
            await meeting.settled(talker, listener, talker)
            # The reader is back first. Without it nothing limits the publisher, and what is then on its way
            # arrives although it has no credit.
            proxy.refuse()
            await meeting.restart_broker()
            await until(lambda: not publisher.peers and listener.connected)
            await meeting.settled(listener)
            proxy.heal()
        await matched(publisher)
        await meeting.settled(talker, listener, talker)
        assert subscription.queued == 50
        taken = publisher.published - subscription.lost_on_break
        assert len(await heard_of(subscription, range(taken))) == taken


async def test_credit_begins_behind_what_a_publisher_sent_before_it_came_back(
    meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its latched messages have arrived: a window from the first of them ends before the next message."""
    set_limits(monkeypatch, window_messages=4)
    listener = await meeting.node("listener")
    subscription = listener.create_subscription(Int64, "numbers", qos_profile=KEEP_ALL)
    attachments = link_of(listener).attachments
    granted: list[Any] = []
    monkeypatch.setattr(Channel, "send", lambda _channel, frame: granted.append(frame))
    attachments.attached(Attached(1, (subscription.id,), GID, 0, "/talker", {}))
    attachments.batch_received(batch_of(1, range(8)))
    assert await heard_of(subscription, range(8)) == list(range(8))
    attachments.detached(Detached(1, (subscription.id,), DetachReason.GONE))
    attachments.attached(Attached(2, (subscription.id,), GID, 0, "/talker", {}))
    assert (granted[-1].publisher, granted[-1].sequence_limit) == (2, 12)


async def test_a_publisher_that_comes_back_before_it_has_gone_adds_nothing_to_what_waits(
    meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What its earlier life has sent is taken before the next one may send, however their frames cross."""
    listener = await meeting.node("listener")
    subscription = listener.create_subscription(Int64, "numbers", qos_profile=KEEP_ALL)
    attachments = link_of(listener).attachments
    granted: list[Any] = []
    monkeypatch.setattr(Channel, "send", lambda _channel, frame: granted.append(frame))
    attachments.attached(Attached(1, (subscription.id,), GID, 0, "/talker", {}))
    attachments.batch_received(batch_of(1, range(4)))
    granted.clear()
    attachments.attached(Attached(2, (subscription.id,), GID, 4, "/talker", {}))
    attachments.detached(Detached(1, (subscription.id,), DetachReason.GONE))
    assert granted == []
    assert await heard_of(subscription, range(4)) == [0, 1, 2, 3]
    assert [grant.publisher for grant in granted] == [2]


@pytest.mark.parametrize("latched", [False, True])
async def test_latched_messages_that_come_again_keep_no_deadline(
    node: actors.Node, monkeypatch: pytest.MonkeyPatch, *, latched: bool
) -> None:
    """They were in time once; only what is new to the subscription is."""
    met: list[int] = []
    durability = actors.DurabilityPolicy.TRANSIENT_LOCAL if latched else actors.DurabilityPolicy.VOLATILE
    qos = actors.QoSProfile(depth=10, deadline=100.0, durability=durability)
    subscription = node.create_subscription(Int64, "numbers", qos_profile=qos)
    monkeypatch.setattr(Deadline, "met", lambda _deadline: met.append(subscription.queued))
    attachments = link_of(node).attachments
    attachments.attached(Attached(1, (subscription.id,), GID, 0, "/talker", {}))
    attachments.batch_received(batch_of(1, range(3)))
    assert met == [0]
    end_session(subscription)
    attachments.attached(Attached(7, (subscription.id,), GID, 1 if latched else 4, "/talker", {}))
    attachments.batch_received(batch_of(7, range(1, 3)))
    assert met == [0]
    attachments.batch_received(batch_of(7, range(3, 4)))  # it had not come, and is old
    assert met == ([0, 3] if latched else [0])
    attachments.batch_received(batch_of(7, range(4, 5)))
    assert met[1:] == ([3, 4] if latched else [3])


async def test_a_bad_message_drops_only_itself(node: actors.Node, caplog: pytest.LogCaptureFixture) -> None:
    """Of a run that does not decode only the bad messages are dropped, counted and told of."""
    subscription = node.create_subscription(Int64, "numbers", qos_profile=10)
    attachments = link_of(node).attachments
    attachments.attached(Attached(1, (subscription.id,), GID, 0, "/talker", {}))
    builder = BatchBuilder(0)
    good = codec_for(Int64)
    for data in (good.encode(Int64(data=1)), b"\xa1x", b"\xc1", good.encode(Int64(data=2))):
        builder.add(data)
    attachments.batch_received(builder.build(1, 1))
    bad = BatchBuilder(4)
    bad.add(b"\xc1")
    attachments.batch_received(bad.build(1, 1))
    attachments.batch_received(batch_of(1, range(5, 6)))
    assert await heard_of(subscription, range(3)) == [1, 2, 5]
    assert (subscription.undecodable, subscription.lost) == (3, 0)
    assert "invalid message on '/numbers'" in caplog.text


async def test_numbers_stay_with_their_messages_around_a_bad_one(tmp_path: Path) -> None:
    """The sequence number of a message behind a dropped one is its own."""
    numbers: list[tuple[int, int]] = []
    node = actors.Node("quiet", url=f"callboard+unix://{tmp_path}/none")
    context_of(node).mailbox.open(lambda _: None, CallbackBudget(lambda: 0.0))  # whose time stands still
    subscription = node.create_subscription(
        Int64, "numbers", lambda msg, info: numbers.append((msg.data, info.publication_sequence_number))
    )
    attachments = link_of(node).attachments
    attachments.attached(Attached(1, (subscription.id,), GID, 0, "/talker", {}))
    builder = BatchBuilder(0)
    for data in (codec_for(Int64).encode(Int64(data=0)), b"\xc1", codec_for(Int64).encode(Int64(data=2))):
        builder.add(data)
    attachments.batch_received(builder.build(1, 1))
    assert numbers == [(0, 0), (2, 2)]


async def test_duplicates_are_discarded_and_gaps_counted(node: actors.Node) -> None:
    """What was seen does not come again, also after a reconnect; what never came is lost or lost_on_break."""
    subscription = node.create_subscription(Int64, "numbers", qos_profile=100)
    attachments = link_of(node).attachments
    attachments.attached(Attached(1, (subscription.id,), GID, 0, "/talker", {}))
    attachments.batch_received(batch_of(1, range(3)))
    attachments.batch_received(batch_of(1, range(1, 5)))
    attachments.batch_received(batch_of(1, range(7, 9)))
    assert (subscription.lost, subscription.lost_on_break) == (2, 0)
    end_session(subscription)
    attachments.attached(Attached(4, (subscription.id,), GID, 6, "/talker", {}))
    attachments.batch_received(batch_of(4, range(6, 10)))
    assert (subscription.lost, subscription.lost_on_break) == (2, 0)
    end_session(subscription)
    attachments.attached(Attached(5, (subscription.id,), GID, 15, "/talker", {}))
    attachments.batch_received(batch_of(5, range(15, 16)))
    assert (subscription.lost, subscription.lost_on_break) == (2, 5)
    assert await heard_of(subscription, range(9)) == [0, 1, 2, 3, 4, 7, 8, 9, 15]
    assert subscription.queued == 0


@pytest.mark.parametrize("kind", ["def", "async def"])
@pytest.mark.parametrize("error", [ValueError, asyncio.CancelledError])
async def test_a_raising_callback_harms_nobody(
    meeting: Meeting, caplog: pytest.LogCaptureFixture, kind: str, error: type[BaseException]
) -> None:
    """The error is logged with its traceback and counted; node, link and mailbox go on."""
    both = await meeting.node("both")
    received: list[int] = []

    def plain(msg: Int64) -> None:
        if msg.data == 1:
            raise error
        received.append(msg.data)

    async def slow(msg: Int64) -> None:
        await asyncio.sleep(0)
        plain(msg)

    both.create_subscription(Int64, "numbers", plain if kind == "def" else slow)
    publisher = both.create_publisher(Int64, "numbers")
    await matched(publisher)
    for number in range(3):
        publisher.publish(Int64(data=number))
    await until(lambda: len(received) == 2)
    assert received == [0, 2]
    assert both.callback_errors == 1
    assert link_of(both).connections == 1
    assert f"of the subscription to '/numbers' raised {error.__name__}" in caplog.text
    assert any(record.exc_info for record in caplog.records)


async def test_concurrent_callbacks_meet(meeting: Meeting) -> None:
    """Three messages meet at a barrier of three only when concurrent."""
    both = await meeting.node("both")
    inside, most, barrier = 0, 0, asyncio.Barrier(3)

    async def meet(msg: Int64) -> None:
        await barrier.wait()

    async def alone(msg: Int64) -> None:
        nonlocal inside, most
        inside += 1
        most = max(most, inside)
        await turns()
        inside -= 1

    meeting_one = both.create_subscription(Int64, "numbers", meet, concurrent=True)
    lonely = both.create_subscription(Int64, "numbers", alone)
    publisher = both.create_publisher(Int64, "numbers")
    await matched(publisher, 2)
    for number in range(3):
        publisher.publish(Int64(data=number))
    await until(lambda: meeting_one.received == 3 and lonely.received == 3 and not inside)
    await until(lambda: not barrier.n_waiting)
    assert most == 1


async def test_a_concurrent_subscription_receives_while_another_callback_is_suspended(
    meeting: Meeting,
) -> None:
    """Its callback, a plain function, runs for each message meanwhile."""
    both = await meeting.node("both")
    entered, gate = asyncio.Event(), asyncio.Event()
    received: list[int] = []

    async def hold() -> None:
        timer.cancel()
        entered.set()
        await gate.wait()

    timer = both.create_timer(0.001, hold)
    both.create_subscription(Int64, "numbers", lambda msg: received.append(msg.data), 10, concurrent=True)
    publisher = both.create_publisher(Int64, "numbers", 10)
    await matched(publisher)
    await entered.wait()
    for number in range(10):
        publisher.publish(Int64(data=number))
    await until(lambda: received == list(range(10)))
    gate.set()


async def test_so_many_callbacks_run_concurrently_and_no_more(meeting: Meeting) -> None:
    """The rest waits in the queue, and has its turn as others end."""
    both = await meeting.node("both")
    extra, gate = 5, asyncio.Event()

    async def wait(msg: Int64) -> None:
        await gate.wait()

    depth = MAX_CONCURRENT + extra
    subscription = both.create_subscription(Int64, "numbers", wait, depth, concurrent=True)
    publisher = both.create_publisher(Int64, "numbers", depth)
    await matched(publisher)
    for number in range(depth):
        publisher.publish(Int64(data=number))
    await until(lambda: (subscription.received, subscription.queued) == (MAX_CONCURRENT, extra))
    await turns()
    (look,) = both.diagnostics().subscriptions
    assert (look.running, look.queued, look.received) == (MAX_CONCURRENT, extra, MAX_CONCURRENT)
    gate.set()
    await until(lambda: subscription.received == depth)
    assert not subscription.dropped


async def test_a_concurrent_callback_that_never_began_is_closed(node: actors.Node) -> None:
    """A coroutine whose task is cancelled before its first step is not left unawaited."""

    async def never(msg: Int64) -> None:
        raise AssertionError("it must not run")

    async with actors.Node("hearer", url=link_of(node).broker_urls) as leaving:
        subscription = leaving.create_subscription(Int64, "numbers", never, concurrent=True)
        attachments = link_of(leaving).attachments
        attachments.attached(Attached(1, (subscription.id,), GID, 0, "/talker", {}))
        attachments.batch_received(batch_of(1, range(2)))
    gc.collect()


async def test_iterations_are_closed_by_aclosing(meeting: Meeting) -> None:
    """At the end of the block, not when they are collected; the subscription and the watch go on."""
    node = await meeting.node("node")
    publisher = node.create_publisher(Int64, "number")
    subscription, watch = node.create_subscription(Int64, "number"), node.watch_graph()
    await matched(publisher)
    for number in range(2):
        publisher.publish(Int64(data=number))
        async with aclosing(aiter(subscription)) as messages, aclosing(watch.batches()) as batches:
            assert (await anext(messages)).data == number
            if number == 0:
                assert await anext(batches)
        assert [item async for item in messages] == []
        assert [item async for item in batches] == []

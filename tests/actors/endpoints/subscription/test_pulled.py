"""Pulled subscriptions: `take` in any thread, `on_ready` in the loop's, and exact counts."""

from __future__ import annotations

import asyncio
import threading
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors.endpoints.endpoint import endpoint_of
from actors.endpoints.subscription.backlog import SharedBacklog
from actors.interfaces.std_msgs.msg import Int64
from tests.actors.meeting import DEADLINE_SEC, KEEP_ALL, latched, matched, until
from tests.seams.limits import set_limits

if TYPE_CHECKING:
    from tests.actors.meeting import Meeting


def taken(subscription: actors.Subscription[Int64]) -> list[int]:
    """Take everything that waits."""
    return [message.data for message, _ in iter(subscription.take, None)]


def publish(publisher: actors.Publisher[Int64], numbers: range) -> None:
    for number in numbers:
        publisher.publish(Int64(data=number))


async def pair(
    meeting: Meeting, qos: actors.QoSProfile | int
) -> tuple[actors.Publisher[Int64], actors.Subscription[Int64]]:
    """Return a matched publisher and pulled subscription."""
    talker, puller = await meeting.node("talker"), await meeting.node("puller")
    publisher = talker.create_publisher(Int64, "number", 1000 if isinstance(qos, int) else qos)
    subscription = puller.create_subscription(Int64, "number", qos_profile=qos)
    await matched(publisher)
    return publisher, subscription


async def test_a_message_comes_with_its_info(meeting: Meeting) -> None:
    """`take` returns the oldest message and its info, and None when there is none."""
    publisher, subscription = await pair(meeting, 10)
    assert subscription.take() is None
    publish(publisher, range(5, 7))
    await until(lambda: subscription.queued == 2)
    first, second = subscription.take(), subscription.take()
    assert first is not None
    assert second is not None
    assert [message.data for message, _ in (first, second)] == [5, 6]
    assert [info.publication_sequence_number for _, info in (first, second)] == [0, 1]
    assert first[1].publisher_gid == publisher.gid
    assert subscription.take() is None
    assert (subscription.received, subscription.queued) == (2, 0)


async def test_the_depth_holds(meeting: Meeting) -> None:
    """Only the newest messages wait, also of one large batch; the others are counted as dropped."""
    publisher, subscription = await pair(meeting, 3)
    publish(publisher, range(50))
    await until(lambda: subscription.queued + subscription.dropped == 50)
    assert subscription.queued == 3
    assert taken(subscription) == [47, 48, 49]
    assert (subscription.received, subscription.dropped) == (3, 47)


async def test_expired_messages_are_not_returned(meeting: Meeting) -> None:
    """A publisher's lifespan holds for messages that wait for `take`."""
    qos = actors.QoSProfile(depth=10, lifespan=actors.Duration(seconds=1000))
    publisher, subscription = await pair(meeting, qos)
    publish(publisher, range(4))
    await until(lambda: subscription.queued == 4)
    batch = endpoint_of(subscription).consumer.backlog.newest
    assert batch is not None
    batch.expires_at = asyncio.get_running_loop().time()
    assert subscription.take() is None
    assert (subscription.expired, subscription.received, subscription.queued) == (4, 0, 0)


async def test_a_jump_of_the_clock_changes_lifespans_while_no_thread_takes(meeting: Meeting) -> None:
    """The backlog is locked meanwhile, so that it does not change during the iteration."""
    qos = actors.QoSProfile(depth=10, lifespan=actors.Duration(seconds=100))
    publisher, subscription = await pair(meeting, qos)
    publish(publisher, range(1))
    await until(lambda: subscription.queued == 1)
    backlog, locked = endpoint_of(subscription).consumer.backlog, list[bool]()
    assert isinstance(backlog, SharedBacklog)
    lock = backlog.lock

    class Expiry(float):
        def __add__(self, seconds: float) -> float:
            locked.append(lock.locked())
            return float(self) + seconds

    backlog.batches[0].expires_at = Expiry(backlog.batches[0].expires_at)
    endpoint_of(subscription).time_shifted(-1000)
    assert locked == [True]
    assert subscription.take() is None
    assert subscription.expired == 1


async def test_keep_all_gets_credit_for_what_another_thread_takes(
    meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No message is lost or repeated, and at most the window waits while the thread takes nothing."""
    window = 1000
    set_limits(monkeypatch, window_messages=window)
    count = 2 * window
    publisher, subscription = await pair(meeting, KEEP_ALL)
    begin, numbers = threading.Event(), list[int]()

    def pull() -> None:
        begin.wait(DEADLINE_SEC)
        while len(numbers) < count:
            numbers.extend(taken(subscription))

    async def send() -> None:
        for number in range(count):
            await publisher.ready(DEADLINE_SEC)
            publisher.publish(Int64(data=number))

    async with asyncio.timeout(DEADLINE_SEC):
        sending, pulling = asyncio.create_task(send()), asyncio.create_task(asyncio.to_thread(pull))
        try:
            await until(lambda: subscription.queued == window)
            await until(lambda: publisher.queued)
            assert (subscription.received, subscription.queued) == (0, window)
        finally:
            begin.set()
        await asyncio.gather(sending, pulling)
    assert numbers == list(range(count))
    assert (subscription.dropped, subscription.lost, subscription.received) == (0, 0, count)


async def test_threads_share_the_messages(meeting: Meeting) -> None:
    """Each message is taken once, while batches arrive and the depth drops others; the counts add up."""
    publisher, subscription = await pair(meeting, 100)
    stop, numbers = threading.Event(), [list[int](), list[int](), list[int]()]

    def pull(mine: list[int]) -> None:
        while not stop.is_set():
            mine.extend(taken(subscription))

    async with asyncio.TaskGroup() as group:
        for mine in numbers:
            group.create_task(asyncio.to_thread(pull, mine))
        for start in range(0, 5000, 250):
            publish(publisher, range(start, start + 250))
            await until(lambda: publisher.queued == 0)
        await until(
            lambda: (
                subscription.received + subscription.queued + subscription.dropped + subscription.lost
                == publisher.published
            )
        )
        stop.set()
    every = [number for mine in numbers for number in mine] + taken(subscription)
    assert len(every) == len(set(every)) == subscription.received
    assert all(mine == sorted(mine) for mine in numbers)
    assert subscription.received + subscription.dropped + subscription.lost == 5000


async def test_on_ready_is_called_once_for_a_batch(meeting: Meeting) -> None:
    """In the loop's thread, after the batch; what is not taken then is not reported again."""
    publisher, subscription = await pair(meeting, 100)
    calls: list[tuple[int, int]] = []
    subscription.set_on_ready(lambda: calls.append((threading.get_ident(), subscription.queued)))
    publish(publisher, range(20))
    await until(lambda: calls)
    assert calls == [(threading.get_ident(), 20)]
    publish(publisher, range(1))
    await until(lambda: len(calls) == 2)
    subscription.set_on_ready(None)
    publish(publisher, range(1))
    await until(lambda: subscription.queued == 22)
    assert len(calls) == 2


async def test_on_ready_of_messages_that_wait_already(meeting: Meeting) -> None:
    """A hook that is set late is called for what waits: here a latched message."""
    node = await meeting.node("node")
    node.create_publisher(Int64, "number", latched(1)).publish(Int64(data=7))
    subscription = node.create_subscription(Int64, "number", qos_profile=latched(1))
    await until(lambda: subscription.queued == 1)
    got: list[int] = []
    subscription.set_on_ready(lambda: got.extend(taken(subscription)))
    await until(lambda: got == [7])


async def test_an_error_of_on_ready_is_counted(meeting: Meeting, caplog: pytest.LogCaptureFixture) -> None:
    """And logged; the node lives on, and the messages wait."""
    publisher, subscription = await pair(meeting, 10)
    node = endpoint_of(subscription).context
    subscription.set_on_ready(lambda: 1 // 0)
    publish(publisher, range(1))
    await until(lambda: node.callback_errors == 1)
    assert "on_ready of the subscription to '/number' raised ZeroDivisionError" in caplog.text
    assert taken(subscription) == [0]


async def test_misuse(meeting: Meeting) -> None:
    """A callback, a coroutine function and a destroyed subscription are errors."""
    node = await meeting.node("node")

    async def later() -> None: ...

    def callback(message: Any) -> None: ...

    pushed = node.create_subscription(Int64, "number", callback)
    with pytest.raises(TypeError, match="has a callback"):
        pushed.take()
    with pytest.raises(TypeError, match="has a callback"):
        pushed.set_on_ready(lambda: None)
    pulled = node.create_subscription(Int64, "number")
    with pytest.raises(TypeError, match="plain function"):
        pulled.set_on_ready(later)
    pulled.destroy()
    with pytest.raises(actors.NodeDestroyed):
        pulled.take()

"""Publishing from any thread: one wake-up for a burst, exact counts, errors where they are caused."""

from __future__ import annotations

import asyncio
import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any
from unittest.mock import MagicMock, Mock

import pytest

import actors
from actors.interfaces.std_msgs.msg import Int64, String
from actors.threads import NodeThread, ThreadStopped
from tests.actors.meeting import DEADLINE_SEC, KEEP_ALL
from tests.seams.limits import set_limits

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable

    from actors.threads import ThreadPublisher
    from tests.actors.threads.conftest import Host


class Pair:
    """A publisher in one thread, matched with a subscription in another one that keeps all messages."""

    def __init__(self, host: Host, thread: NodeThread, qos: actors.QoSProfile | int, **options: Any) -> None:
        self._host = host
        puller, talker = host.node("puller"), host.node("talker")
        self.subscription = puller.create_subscription(Int64, "number", qos_profile=KEEP_ALL)
        self.inner = talker.create_publisher(Int64, "number", qos)
        host.thread.enter(puller)
        self.talker = thread.enter(talker)
        thread.call(self.inner.wait_for_subscriptions)
        self.publisher = thread.publisher(self.inner, **options)

    def publish(self, numbers: Iterable[int]) -> None:
        for number in numbers:
            self.publisher.publish(Int64(data=number))

    def received(self, count: int) -> list[int]:
        """Wait for so many messages, and return everything that has come."""
        numbers: list[int] = []

        async def take() -> None:
            async with asyncio.timeout(DEADLINE_SEC):
                while len(numbers) < count:
                    numbers.extend(message.data for message, _ in iter(self.subscription.take, None))
                    await asyncio.sleep(0)

        self._host.thread.call(take)
        return numbers


@contextmanager
def blocked(thread: NodeThread, last: Callable[[], object] = lambda: None) -> Generator[None]:
    """Block the thread's loop; in the end it calls a function."""
    running, gate = threading.Event(), threading.Event()

    def block() -> None:
        running.set()
        gate.wait(DEADLINE_SEC)
        last()

    future = thread.submit(block)
    assert running.wait(DEADLINE_SEC)
    try:
        yield
    finally:
        gate.set()
        future.result(DEADLINE_SEC)


def test_a_burst_wakes_the_loop_once(host: Host, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its messages arrive in order; the next burst wakes it again."""
    loop = asyncio.SelectorEventLoop()
    wakeups = Mock(wraps=loop.call_soon_threadsafe)
    monkeypatch.setattr(loop, "call_soon_threadsafe", wakeups)
    with NodeThread(loop_factory=lambda: loop) as thread:
        pair = Pair(host, thread, 1000)
        for start in (0, 500):
            with blocked(thread):
                wakeups.reset_mock()
                pair.publish(range(start, start + 500))
                wakeups.assert_called_once()
                assert pair.publisher.queued == 500
            assert pair.received(500) == list(range(start, start + 500))
        assert (pair.publisher.published, pair.publisher.queued, pair.publisher.dropped) == (1000, 0, 0)
        assert pair.inner.published == 1000


def test_the_oldest_messages_are_dropped_and_counted(host: Host) -> None:
    """When the queue is full of messages, or of bytes, for KEEP_LAST; also by the node's diagnostics."""
    with NodeThread() as thread:
        pair = Pair(host, thread, 10, limit=3)
        with blocked(thread):
            pair.publish(range(50))
            assert (pair.publisher.queued, pair.publisher.dropped) == (3, 47)
        assert pair.received(3) == [47, 48, 49]
        for _ in range(2):  # the node's diagnostics have each drop once
            with blocked(thread):
                pair.publish(range(4))
        diagnostics = thread.call(pair.talker.diagnostics)
        (counts,) = (each for each in diagnostics.publishers if each.topic == "/number")
        assert (counts.published, counts.dropped, pair.publisher.dropped) == (58, 49, 49)
        large = thread.publisher(thread.call(lambda: pair.talker.create_publisher(String, "large", 10)))
        with blocked(thread):
            for _ in range(4):
                large.publish(String(data="x" * 30_000_000))
            assert (large.queued, large.dropped) == (2, 2)


def test_keep_all_drops_nothing(host: Host, monkeypatch: pytest.MonkeyPatch) -> None:
    """A full queue, here or in the publisher, raises PublisherFull; `ready` waits for space."""
    with NodeThread() as thread:
        pair = Pair(host, thread, KEEP_ALL, limit=3)
        with blocked(thread):
            pair.publish(range(3))
            with pytest.raises(actors.PublisherFull, match="'/number': 3 messages wait"):
                pair.publish([3])
        pair.publisher.ready()
        assert (pair.publisher.published, pair.publisher.dropped) == (3, 0)
        assert pair.received(3) == [0, 1, 2]
        set_limits(monkeypatch, keep_all_messages=0)
        with pytest.raises(actors.PublisherFull):
            pair.publish([3])
        monkeypatch.undo()
        pair.publish([3])
        assert pair.received(1) == [3]


def test_it_is_crowded_long_before_it_is_full(host: Host) -> None:
    """For KEEP_ALL only, by what waits for the loop, too; `ready` then waits, and shared memory has space."""
    with NodeThread() as thread:
        pair = Pair(host, thread, KEEP_ALL)
        inner = thread.call(lambda: pair.talker.create_publisher(String, "large", KEEP_ALL))
        thread.call(inner.flush)  # the broker has accepted it
        large, latest = (
            thread.publisher(each)
            for each in (inner, thread.call(lambda: pair.talker.create_publisher(String, "latest", 100)))
        )
        with blocked(thread):
            for crowded in (False, False, True):
                for publisher in (large, latest):
                    publisher.publish(String(data="x" * 1_500_000))
                assert (large.crowded, latest.crowded) == (crowded, False)
            large.publish(String(data="not refused"))
        large.ready()
        assert not large.crowded


def test_what_the_caller_was_not_refused_is_sent(host: Host, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also if others have filled the publisher's queue since."""
    with NodeThread() as thread:
        pair = Pair(host, thread, KEEP_ALL)
        with blocked(thread):
            pair.publish(range(3))
            set_limits(monkeypatch, keep_all_messages=0)
        assert pair.received(3) == [0, 1, 2]


def test_threads_publish_at_the_same_time(host: Host) -> None:
    """The messages of each stay in order, and the counts add up."""
    count, threads = 5000, 4
    with NodeThread() as thread:
        pair = Pair(host, thread, KEEP_ALL)

        def publish(start: int) -> None:
            for number in range(start, start + count):
                while True:
                    try:
                        pair.publish([number])
                        break
                    except actors.PublisherFull:
                        pair.publisher.ready()

        workers = [threading.Thread(target=publish, args=(each * count,)) for each in range(threads)]
        for worker in workers:
            worker.start()
        numbers = pair.received(count * threads)
        for worker in workers:
            worker.join()
        assert sorted(numbers) == list(range(count * threads))
        for each in range(threads):
            mine = [number for number in numbers if number // count == each]
            assert mine == sorted(mine)
        assert pair.publisher.published == pair.inner.published == count * threads


def test_publish_does_not_queue_for_the_lock(host: Host, monkeypatch: pytest.MonkeyPatch) -> None:
    """A thread that waits in the lock gets it without the GIL; all threads then switch after each message."""
    with NodeThread() as thread:
        lock = MagicMock()
        pair = Pair(host, thread, 10)
        monkeypatch.setattr(pair.publisher, "_lock", lock)
        lock.acquire.side_effect = [False, False, True]
        with blocked(thread):
            pair.publish([1])
            lock.__enter__.assert_not_called()
            assert [each.kwargs for each in lock.acquire.call_args_list] == [{"blocking": False}] * 3
            lock.release.assert_called_once()


def test_ctrl_c_does_not_lock_the_publisher(host: Host, monkeypatch: pytest.MonkeyPatch) -> None:
    """It may come before the thread has the lock, and as it gets it; then other threads go on publishing."""
    with NodeThread() as thread:
        pair = Pair(host, thread, 10)
        lock = threading.RLock()
        fake = MagicMock(wraps=lock)
        monkeypatch.setattr(pair.publisher, "_lock", fake)

        def interrupt(*, blocking: bool) -> None:
            if fake.acquire.call_count == 2:
                lock.acquire(blocking=blocking)
            raise KeyboardInterrupt

        fake.acquire.side_effect = interrupt
        for _ in range(2):
            with pytest.raises(KeyboardInterrupt):
                pair.publish([1])
        monkeypatch.setattr(pair.publisher, "_lock", lock)
        other = threading.Thread(target=pair.publish, args=([2],), daemon=True)
        other.start()
        assert pair.received(1) == [2]
        other.join(DEADLINE_SEC)


def test_the_loop_goes_on_while_a_publisher_is_locked(host: Host, monkeypatch: pytest.MonkeyPatch) -> None:
    """A signal handler that interrupts `publish` may call into the loop; the messages are sent afterwards."""
    with NodeThread() as thread:
        pair = Pair(host, thread, 10)
        lock = threading.RLock()
        monkeypatch.setattr(pair.publisher, "_lock", lock)
        with lock:
            pair.publish([1, 2])
            assert thread.call(lambda: "called", DEADLINE_SEC) == "called"
            assert pair.publisher.queued == 2
        assert pair.received(2) == [1, 2]


def test_the_counts_add_up_when_threads_overflow_the_queue(host: Host) -> None:
    """Each message is handed over, dropped or queued."""
    count, threads = 3000, 4
    with NodeThread() as thread:
        pair = Pair(host, thread, 100_000, limit=2)
        workers = [threading.Thread(target=pair.publish, args=(range(count),)) for _ in range(threads)]
        for worker in workers:
            worker.start()
        for worker in workers:
            worker.join()
        pair.publisher.flush()
        publisher = pair.publisher
        assert publisher.published == count * threads
        assert publisher.published == pair.inner.published + publisher.dropped
        assert publisher.dropped


def test_errors_are_raised_where_they_are_caused(host: Host) -> None:
    """A wrong type, a wrong value, too large a message, a destroyed publisher, a thread that has ended."""
    with NodeThread() as thread:
        node = thread.enter(host.node("node"))
        inner = thread.call(lambda: node.create_publisher(String, "text", 10))
        publisher: ThreadPublisher[Any] = thread.publisher(inner)
        cases: list[tuple[object, type[Exception], str]] = [
            (Int64(data=1), TypeError, "Expected std_msgs/msg/String"),
            (String(data=1), actors.InvalidMessageError, "data"),  # type: ignore[arg-type]  # pyright: ignore[reportArgumentType]
            (b"\x00", actors.InvalidMessageError, "std_msgs/msg/String"),
            (String(data="x" * 70_000_000), actors.InvalidMessageError, "A message on '/text' has"),
        ]
        for message, error, text in cases:
            with pytest.raises(error, match=text):
                publisher.publish(message)
        with pytest.raises(ValueError, match="limit must be at least 1"):
            thread.publisher(inner, limit=0)
        thread.call(inner.destroy)
        with pytest.raises(actors.NodeDestroyed):
            publisher.publish(String())
        assert (publisher.published, publisher.dropped) == (0, 0)


def test_a_publisher_that_is_destroyed_meanwhile_drops_what_waits(host: Host) -> None:
    """Messages that wait for a publisher that is destroyed are counted as dropped."""
    with NodeThread() as thread:
        pair = Pair(host, thread, 10)
        with blocked(thread, last=pair.inner.destroy):
            pair.publish(range(3))
        thread.call(lambda: None)
        assert (pair.publisher.published, pair.publisher.dropped, pair.publisher.queued) == (3, 3, 0)


def test_a_stopped_thread_accepts_no_message(host: Host) -> None:
    """Its nodes are destroyed; a publisher of another thread's node is refused, too."""
    node = host.thread.enter(host.node("node"))
    with NodeThread() as thread:
        pair = Pair(host, thread, 10)
        misplaced = thread.publisher(host.thread.call(lambda: node.create_publisher(Int64, "other", 10)))
    with pytest.raises(actors.NodeDestroyed):
        pair.publish([1])
    with pytest.raises(ThreadStopped):
        misplaced.publish(Int64())
    assert misplaced.published == 0


def test_stopping_sends_what_was_published(host: Host) -> None:
    """Everything accepted before `stop` arrives."""
    with NodeThread() as thread:
        pair = Pair(host, thread, 1000)
        with blocked(thread):
            pair.publish(range(1000))
    assert pair.received(1000) == list(range(1000))


def test_flush_waits_for_the_broker(host: Host) -> None:
    """Nothing waits afterwards; encoded messages are sent as they are."""
    with NodeThread() as thread:
        pair = Pair(host, thread, 10)
        pair.publisher.publish(b"\x81\xa4data\x07")
        pair.publisher.flush()
        assert (pair.publisher.queued, pair.inner.queued, pair.inner.published) == (0, 0, 1)
        assert pair.received(1) == [7]


def test_an_inactive_lifecycle_publisher_is_silent(host: Host) -> None:
    """A lifecycle publisher of an inactive node counts the messages that another thread publishes."""
    with NodeThread() as thread:
        node = thread.enter(actors.LifecycleNode("managed", url=host.url, use_global_arguments=False))
        inner = thread.call(lambda: node.create_lifecycle_publisher(Int64, "number", 10))
        publisher = thread.publisher(inner)
        publisher.publish(Int64(data=1))
        publisher.flush()
        assert (publisher.published, inner.published, inner.suppressed) == (1, 0, 1)

"""From subscriptions to the writer's thread: what is received is counted, and kept or dropped."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from actors.bags.recorder.buffers import OVERHEAD_BYTES, QueuedMessage, SnapshotRing
from actors.errors import NodeDestroyed

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.bags.recorder.recorded_topic import RecordedTopic
    from actors.bags.recorder.writer_thread import WriterThread
    from actors.endpoints.subscription.subscription import Subscription

TURN_MESSAGES: Final = 500
"""Messages of a topic taken in one turn of the loop: about a millisecond."""


class Source:
    """A topic that is recorded, with its subscription.

    Attributes:
        topic: The topic.
        subscription: Receives its messages, as msgpack.
        is_due: Whether taking goes on soon, or when there is room.
    """

    __slots__ = ("is_due", "subscription", "topic")

    def __init__(self, topic: RecordedTopic, subscription: Subscription[Any]) -> None:
        self.topic = topic
        self.subscription = subscription
        self.is_due = False

    @property
    def lost(self) -> int:
        """Messages that did not arrive, or waited too long in the subscription."""
        subscription = self.subscription
        return self.topic.counts.lost(
            subscription.lost + subscription.lost_on_break + subscription.dropped + subscription.expired
        )


class Intake:
    """Takes messages, and hands those of each turn of the loop to the writer's thread.

    Args:
        thread: Writes them.
        max_bytes: What may wait for it.
        lossless: Take nothing while the queue is full, so that KEEP_ALL publishers wait, rather than drop.
        ring: Keeps them instead, in snapshot mode.
        now_ns: Returns the log time, 0 if it is not known yet; None for the time of reception.
        is_paused: Whether nothing is recorded at first.

    Attributes:
        is_paused: Whether what is received is left out; that is no loss.
        arrived: Messages received, whether or not they are recorded.
        ring: As given.
    """

    def __init__(
        self,
        thread: WriterThread,
        *,
        max_bytes: int,
        lossless: bool,
        ring: SnapshotRing | None,
        now_ns: Callable[[], int] | None,
        is_paused: bool,
    ) -> None:
        self._thread = thread
        self._max_bytes = max_bytes
        self._lossless = lossless
        self._now_ns = now_ns
        self._loop = asyncio.get_running_loop()
        self._batch: list[QueuedMessage] = []
        """What has been taken in this turn."""
        self._batch_bytes = 0
        self.ring = ring
        self.is_paused = is_paused
        self.arrived = 0

    def begin(self, source: Source) -> None:
        """Take a topic's messages from now on."""
        source.subscription.set_on_ready(partial(self._take, source))

    def _take(self, source: Source) -> None:
        if not source.is_due:
            self._take_some(source)

    def _go_on(self, source: Source) -> None:
        source.is_due = False
        with suppress(NodeDestroyed):  # the topic is recorded no longer
            self._take_some(source)

    def _take_some(self, source: Source) -> None:
        for _ in range(TURN_MESSAGES):
            if self._lossless and not self._has_room:
                source.is_due = True
                self._thread.when_room(partial(self._go_on, source))
                return
            if not self._take_one(source):
                return
        source.is_due = True
        self._loop.call_soon(self._go_on, source)

    def _take_one(self, source: Source) -> bool:
        """Take the oldest message that waits; return whether there was one."""
        taken = source.subscription.take()
        if taken is None:
            return False
        self.arrived += 1
        data, info = taken
        gid, number, counts = info.publisher_gid, info.publication_sequence_number, source.topic.counts
        counts.note(gid, info.publisher_node, number)
        log_time_ns = info.received_timestamp if self._now_ns is None else self._now_ns()
        if self.is_paused or not log_time_ns:
            return True
        counts.received += 1
        if not (self._lossless or self.ring is not None or self._has_room):
            counts.drop(gid, number)
            return True
        if not self._batch:
            self._loop.call_soon(self.hand_over)
        self._batch.append(QueuedMessage(log_time_ns, source.topic, data, info.source_timestamp, number, gid))
        self._batch_bytes += len(data) + OVERHEAD_BYTES
        return True

    @property
    def _has_room(self) -> bool:
        return self._thread.queued_bytes + self._batch_bytes < self._max_bytes

    def hand_over(self) -> None:
        """Give what has been taken to the thread, or to the ring."""
        if self._batch:
            messages, size = self._batch, self._batch_bytes
            self._batch, self._batch_bytes = [], 0
            if self.ring is None:
                self._thread.put(messages, size)
            else:
                self.ring.add(messages, size)

    def write_snapshot(self) -> int:
        """Give what the ring has to the thread; return the number of messages."""
        assert self.ring is not None
        self.hand_over()
        size, messages = self.ring.size, self.ring.take()
        self._thread.put(messages, size)
        return len(messages)

    async def drain(self, source: Source) -> None:
        """Take what waits now in a subscription that is going to end."""
        for _ in range(source.subscription.queued):
            while self._lossless and not self._has_room and self._thread.error is None:
                self.hand_over()
                room = asyncio.Event()
                self._thread.when_room(room.set)
                await room.wait()
            if not self._take_one(source):
                break
        self.hand_over()

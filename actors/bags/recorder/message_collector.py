"""Takes messages from subscriptions, counts them, and hands them to the writer thread or drops them."""

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
"""Messages of a topic that are taken in one turn of the loop: about a millisecond of work."""


class Source:
    """A recorded topic with its subscription.

    Attributes:
        topic: The topic.
        subscription: Receives its messages, as msgpack.
        is_due: Whether taking is scheduled already: for the next turn of the loop, or for when there is room.
    """

    __slots__ = ("is_due", "subscription", "topic")

    def __init__(self, topic: RecordedTopic, subscription: Subscription[Any]) -> None:
        self.topic = topic
        self.subscription = subscription
        self.is_due = False

    @property
    def lost(self) -> int:
        """Number of messages that did not arrive, or were dropped in the subscription's queue."""
        subscription = self.subscription
        return self.topic.counts.lost(
            subscription.lost + subscription.lost_on_break + subscription.dropped + subscription.expired
        )


class MessageCollector:
    """Takes messages, and hands those of each turn of the loop to the writer thread at once.

    Args:
        thread: Writes the messages.
        max_bytes: Limit for the memory of messages that wait for the thread.
        lossless: At that limit, leave messages in the subscriptions, so that KEEP_ALL publishers wait;
            otherwise drop them.
        ring: Keeps the messages in snapshot mode, instead of the thread.
        now_ns: Returns the log time, 0 if it is not known yet; None to use the time of reception.
        is_paused: Whether to start paused.

    Attributes:
        is_paused: Whether received messages are discarded; they do not count as losses.
        arrived: Number of received messages, recorded or not.
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
        """The messages taken in this turn of the loop."""
        self._batch_bytes = 0
        self.ring = ring
        self.is_paused = is_paused
        self.arrived = 0

    def begin(self, source: Source) -> None:
        """Take the messages of a topic from now on."""
        source.subscription.set_on_ready(partial(self._take, source))

    def _take(self, source: Source) -> None:
        if not source.is_due:
            self._take_some(source)

    def _go_on(self, source: Source) -> None:
        source.is_due = False
        with suppress(NodeDestroyed):  # the recording ended meanwhile
            self._take_some(source)

    def _take_some(self, source: Source) -> None:
        taken = self._take_up_to(source, TURN_MESSAGES)
        if self._lossless and not self._has_room:
            source.is_due = True
            self._thread.when_room(partial(self._go_on, source))
        elif taken == TURN_MESSAGES or (self._lossless and source.subscription.queued):
            source.is_due = True
            self._loop.call_soon(self._go_on, source)

    def _take_up_to(self, source: Source, most: int) -> int:
        """Take the oldest messages of a subscription; if lossless, only while there is room for them.

        Returns:
            The number of messages taken.
        """
        take, topic, now_ns, batch = source.subscription.take, source.topic, self._now_ns, self._batch
        counts = topic.counts
        has_limit = self.ring is None
        # The thread makes room meanwhile; this counts from the next call on, as asking each time is slow.
        room = self._max_bytes - self._thread.queued_bytes - self._batch_bytes
        before = room
        count = 0
        while count < most and not (self._lossless and room <= 0):
            found = take()
            if found is None:
                break
            count += 1
            data, (publish_time_ns, log_time_ns, number, gid, node) = found
            counts.note(gid, node, number)
            if now_ns is not None:
                log_time_ns = now_ns()
            if self.is_paused or not log_time_ns:
                continue
            counts.received += 1
            if has_limit and room <= 0:
                counts.drop(gid, number)
                continue
            room -= len(data) + OVERHEAD_BYTES
            batch.append(QueuedMessage(log_time_ns, topic, data, publish_time_ns, number, gid))
        self.arrived += count
        if batch and not self._batch_bytes:
            self._loop.call_soon(self.hand_over)
        self._batch_bytes += before - room
        return count

    @property
    def _has_room(self) -> bool:
        return self._thread.queued_bytes + self._batch_bytes < self._max_bytes

    def hand_over(self) -> None:
        """Give the messages taken in this turn to the thread, or to the ring."""
        if self._batch:
            messages, size = self._batch, self._batch_bytes
            self._batch, self._batch_bytes = [], 0
            if self.ring is None:
                self._thread.put(messages, size)
            else:
                self.ring.add(messages, size)

    def write_snapshot(self) -> int:
        """Give the messages of the ring to the thread; return their number."""
        assert self.ring is not None
        self.hand_over()
        size, messages = self.ring.size, self.ring.pop_all()
        self._thread.put(messages, size)
        return len(messages)

    async def drain(self, source: Source) -> None:
        """Take the messages that wait in a subscription now, before it is destroyed."""
        left = source.subscription.queued
        while left:
            if self._lossless and not self._has_room:
                room = asyncio.Event()
                self._thread.when_room(room.set)
                await room.wait()
                continue
            taken = self._take_up_to(source, left)
            self.hand_over()
            if not taken:
                break
            left -= taken

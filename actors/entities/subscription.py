"""Subscriptions: runs come in, messages go to a callback or to `async for`.

A run that finds its reader idle is handed over whole, in one decode. At a busy reader only the last `depth`
messages of a run are kept (before they are decoded), and the queue drops its oldest beyond the depth; each
drop is counted. With KEEP_ALL nothing is dropped: the publisher gets credit as messages are taken.
"""

from __future__ import annotations

import asyncio
import time
from collections import OrderedDict, deque
from typing import TYPE_CHECKING, Any, Final, Generic, NamedTuple, TypeVar, cast

from actors.callbacks import as_coroutine, takes
from actors.core import Core, Entity
from actors.interfaces.codec import Codec, codec_for
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.message import Message, type_hash, type_name
from actors.mailbox import Turn
from actors.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from proto import frames
from proto.frames import Replay, Run
from proto.runs import cut, message_bytes, messages

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable, Coroutine, Sequence

    from actors.feeds import Inflow

M = TypeVar("M")

WINDOW_MESSAGES: Final = 32_768
WINDOW_BYTES: Final = 8 * 1024 * 1024
"""A KEEP_ALL subscription's credit for each publisher: what may wait here."""

BEST_EFFORT_KEEP_ALL_DEPTH: Final = 1000
"""KEEP_ALL without RELIABLE pushes nobody back, so it needs a depth after all."""

MAX_CONCURRENT: Final = 1000
"""Callbacks of one `concurrent=True` subscription that run at the same time; more messages wait."""

REMEMBERED_PUBLISHERS: Final = 1024
"""Publishers whose last sequence number is remembered after they have gone, against duplicates."""


class MessageInfo(NamedTuple):
    """What comes with a message: a callback's second argument."""

    source_timestamp: int
    """When its run was sent, in ns since the epoch, by the publisher's clock."""
    received_timestamp: int
    """When it came in, in ns since the epoch."""
    publication_sequence_number: int
    """Its number among the publisher's messages, from 0."""
    publisher_gid: bytes
    """The publisher's id, the same across reconnects."""
    publisher_node: str
    """The full name of the publisher's node."""


class _Batch:
    """Decoded messages of one run that wait."""

    __slots__ = ("end", "index", "inflow", "messages", "numbers", "received_ns", "size", "stamp_ns")

    def __init__(
        self,
        inflow: Inflow,
        run: Run | Replay,
        decoded: list[Any],
        numbers: Sequence[int],
        received_ns: int,
    ) -> None:
        self.inflow = inflow
        self.messages = decoded
        self.index = 0
        self.numbers = numbers
        self.stamp_ns = run.stamp_ns
        self.received_ns = received_ns
        self.end = 0
        self.size = 0

    def info(self) -> MessageInfo:
        """Return the message info of the message at `index`."""
        flow = self.inflow
        return MessageInfo(self.stamp_ns, self.received_ns, self.numbers[self.index], flow.gid, flow.node)


class Subscription(Entity, Generic[M]):
    """Hears messages on one topic. Made by `Node.create_subscription`.

    With a callback, messages go there. Without one, iterate: `async for msg in subscription`.

    Attributes:
        topic_name: The full name of the topic.
        qos_profile: Its QoS.
        received: Messages handed to the callback or the iterator.
        dropped: Messages dropped here because the reader was slower than the depth allows.
        lost: Messages that never came over an unbroken link: dropped by the broker or the publisher.
        lost_on_break: Messages that never came because a link broke.
        undecodable: Messages dropped because they were not valid.
    """

    def __init__(
        self,
        core: Core,
        msg_type: type[Message] | None,
        topic: str,
        callback: Callable[..., Any] | None,
        qos: QoSProfile,
        *,
        concurrent: bool,
        raw: bool,
    ) -> None:
        self._codec: Codec[Any] | None = None if raw or msg_type is None else codec_for(msg_type)
        self._with_info = callback is not None and takes(callback, (1, 2), "subscription") == 2
        super().__init__(core)
        self.msg_type = msg_type
        self.topic_name = topic
        self.qos_profile = qos
        self.posted = False
        self.received = self.dropped = self.lost = self.lost_on_break = self.undecodable = 0
        resolved = qos.resolved()
        keep_all = resolved.history == HistoryPolicy.KEEP_ALL
        self._credit = keep_all and resolved.reliability == ReliabilityPolicy.RELIABLE
        self._depth = BEST_EFFORT_KEEP_ALL_DEPTH if keep_all else max(1, resolved.depth)
        self._callback = callback
        self.timing = core.watch.of(callback or self.__aiter__, f"the subscription to '{topic}'")
        self._concurrent = concurrent
        self._batches: deque[_Batch] = deque()
        self._pending = 0
        self._running = 0
        self._waiter: asyncio.Future[None] | None = None
        self._seen: OrderedDict[bytes, int] = OrderedDict()
        self._inflows: dict[bytes, Inflow] = {}
        """By publisher, the inflow that counts: a publisher that has come back may overlap with itself."""
        core.link.add(self)
        core.link.feeds.add_reader(self.id, self)

    @property
    def topic(self) -> str:
        """The full name of the topic."""
        return self.topic_name

    @property
    def calls(self) -> int:
        """Source: how often the callback has been called."""
        return self.received

    @property
    def queued(self) -> int:
        """Messages that have come and wait for the callback or the iterator."""
        return self._pending

    def get_publisher_count(self) -> int:
        """Return how many publishers are matched now."""
        return self.peers

    # What comes in

    def attached(self, inflow: Inflow) -> None:
        """Reader: a publisher's runs will come. Known publishers go on where they stopped."""
        before = self._inflows.get(inflow.gid)
        if before is not None:
            self._remember(before)
        self._inflows[inflow.gid] = inflow
        seen = self._seen.get(inflow.gid)
        if seen is not None:
            inflow.missed = max(0, inflow.first_sequence - seen)
            self.lost_on_break += inflow.missed
            inflow.expected = max(seen, inflow.first_sequence)
        if self._credit:
            inflow.granted_sequence = inflow.first_sequence + WINDOW_MESSAGES
            inflow.granted_bytes = WINDOW_BYTES

    def asserted(self, inflow: Inflow) -> None:
        """Reader: a publisher is alive."""

    def forgotten(self, inflow: Inflow) -> None:
        """Reader: a publisher that was silent is back, or gone."""

    def detached(self, inflow: Inflow, *, silent: bool = False) -> None:
        """Reader: no more runs of this publisher; what is queued stays."""
        del silent
        if self._inflows.get(inflow.gid) is inflow:
            del self._inflows[inflow.gid]
            self._remember(inflow)

    def _remember(self, inflow: Inflow) -> None:
        self._seen[inflow.gid] = inflow.expected
        self._seen.move_to_end(inflow.gid)
        if len(self._seen) > REMEMBERED_PUBLISHERS:
            self._seen.popitem(last=False)

    def receive(self, inflow: Inflow, run: Run | Replay) -> None:
        """Reader: a run, or latched messages. What has been seen is discarded, gaps are counted."""
        if self._inflows.get(inflow.gid) is not inflow:
            return  # a leftover, counted as lost when the publisher came back
        start = 0
        if isinstance(run, Run):
            gap = run.first_sequence - inflow.expected
            if gap > 0:
                self.lost += gap
            start = max(0, -gap)
            inflow.expected = max(inflow.expected, run.first_sequence + run.length)
        else:
            start = max(0, self._seen.get(inflow.gid, 0) - run.first_sequence)
            found = min(inflow.missed, max(0, run.length - start))
            inflow.missed -= found
            self.lost_on_break -= found
            self._seen[inflow.gid] = max(self._seen.get(inflow.gid, 0), run.first_sequence + run.length)
        stop = run.length
        end, size = run.first_sequence + stop, message_bytes(run) if isinstance(run, Run) else 0
        if start >= stop:
            self._taken(inflow, end, size)
            return
        if not self._credit and not self._idle and stop - start > self._depth:
            self.dropped += stop - start - self._depth
            start = stop - self._depth
        if start:
            run = cut(_as_run(run), start, stop)
        decoded, numbers = self._decode(run)
        if not decoded:
            self._taken(inflow, end, size)
            return
        batch = _Batch(inflow, run, decoded, numbers, time.time_ns())
        batch.end, batch.size = end, size
        self._batches.append(batch)
        self._pending += len(decoded)
        self._wake()

    @property
    def _idle(self) -> bool:
        if self._pending:
            return False
        if self._callback is None:
            return self._waiter is not None and not self._waiter.done()
        return not self._running and (self._concurrent or self.core.mailbox.free)

    def _decode(self, run: Run | Replay) -> tuple[list[Any], Sequence[int]]:
        """Return the messages of a run, and their numbers."""
        numbers = range(run.first_sequence, run.first_sequence + run.length)
        codec = self._codec
        if codec is None:
            return [bytes(message) for message in messages(run)], numbers
        try:
            return codec.decode_run(run.payload), numbers
        except InvalidMessageError:
            return self._decode_each(codec, run)

    def _decode_each(self, codec: Codec[Any], run: Run | Replay) -> tuple[list[Any], Sequence[int]]:
        """A run with bad messages in it: keep the good ones."""
        good: list[Any] = []
        numbers: list[int] = []
        for number, message in enumerate(messages(run), run.first_sequence):
            try:
                good.append(codec.decode(message))
                numbers.append(number)
            except InvalidMessageError as error:
                self.undecodable += 1
                self.core.log.warning(
                    f"Dropped an invalid message on '{self.topic_name}': {error}", throttle_duration_sec=1.0
                )
        return good, numbers

    # What goes out

    def _wake(self) -> None:
        if self._callback is None:
            if self._waiter is not None and not self._waiter.done():
                # An idle iterator takes the run in the step it is woken for; what it has not taken by
                # then waits, and is held to the depth.
                self._waiter.set_result(None)
                asyncio.get_running_loop().call_soon(self._trim)
                return
        else:
            self.core.mailbox.post(self)
        self._trim()

    def _trim(self) -> None:
        """Drop the oldest beyond the depth."""
        if self._credit:
            return
        excess = self._pending - self._depth
        while excess > 0:
            batch = self._batches[0]
            gone = min(excess, len(batch.messages) - batch.index)
            batch.index += gone
            self._pending -= gone
            self.dropped += gone
            excess -= gone
            if batch.index == len(batch.messages):
                self._batches.popleft()

    def _pop(self) -> Any:
        """Take the oldest message."""
        batch = self._batches[0]
        message = batch.messages[batch.index]
        batch.index += 1
        self._pending -= 1
        self.received += 1
        if batch.index == len(batch.messages):
            self._finish(batch)
        return message

    def _finish(self, batch: _Batch) -> None:
        """All messages of the first batch have been taken."""
        self._batches.popleft()
        self._taken(batch.inflow, batch.end, batch.size)

    def _taken(self, inflow: Inflow, end: int, size: int) -> None:
        """A whole run is off our hands: give its publisher new credit when half of the old is used up."""
        if not self._credit or self._inflows.get(inflow.gid) is not inflow:
            return  # to grant after the session's end would be to grant to another publisher
        inflow.taken_bytes += size
        if (
            inflow.granted_sequence - end < WINDOW_MESSAGES // 2
            or inflow.granted_bytes - inflow.taken_bytes < WINDOW_BYTES // 2
        ):
            inflow.granted_sequence = max(inflow.granted_sequence, end + WINDOW_MESSAGES)
            inflow.granted_bytes = inflow.taken_bytes + WINDOW_BYTES
            channel = self.core.link.channel
            if channel is not None and not self.destroyed:
                channel.send(
                    frames.Grant(self.id, inflow.publisher, inflow.granted_sequence, inflow.granted_bytes)
                )

    def has_work(self) -> bool:
        """Source: whether a callback could run now."""
        limit = MAX_CONCURRENT if self._concurrent else 1
        return bool(self._batches) and self._running < limit and not self.destroyed

    def dispatch(self) -> Turn | None:
        """Source: run the callback for what waits, until it returns something to await."""
        while self.has_work():
            coroutine = self._run(self._batches[0])
            if coroutine is not None:
                self._running += 1
                turn = Turn(
                    self.core.mailbox, coroutine, self._ended, timing=self.timing, beside=self._concurrent
                )
                if not self._concurrent:
                    return turn
                self.core.mailbox.run_beside(turn)
        return None

    def _run(self, batch: _Batch) -> Coroutine[Any, Any, Any] | None:
        """Run the callback for the messages of a batch, to its end or to something to await."""
        callback, with_info, waiting = self._callback, self._with_info, batch.messages
        assert callback is not None
        size = len(waiting)
        while batch.index < size and not self.destroyed:
            message = waiting[batch.index]
            info = batch.info() if with_info else None
            batch.index += 1
            self._pending -= 1
            self.received += 1
            if batch.index == size:
                self._finish(batch)
            try:
                result = callback(message) if info is None else callback(message, info)
            except (Exception, asyncio.CancelledError) as error:  # noqa: BLE001 - the user's: logged, counted, the node lives on
                self.core.callback_failed(self.timing.what, error)
                continue
            if result is not None and (coroutine := as_coroutine(result)) is not None:
                return coroutine
        return None

    def _ended(self, result: object, error: BaseException | None) -> None:
        del result
        self._running -= 1
        if error is not None:
            self.core.callback_failed(self.timing.what, error)
        if self.has_work():
            self.core.mailbox.post(self)

    async def __aiter__(self) -> AsyncIterator[M]:
        """Iterate over messages as they come; ends when the subscription or its node is destroyed."""
        if self._callback is not None:
            raise TypeError("This subscription has a callback; make one without to iterate")
        loop = self.core.require_loop()
        while not self.destroyed:
            while self._batches:
                yield cast("M", self._pop())
            if self.destroyed:
                return
            if self._waiter is not None and not self._waiter.done():
                raise RuntimeError("Another task is iterating over this subscription")
            self._waiter = loop.create_future()
            try:
                await self._waiter
            finally:
                self._waiter = None

    def destroy(self) -> None:
        """Hear nothing more; what waits is discarded."""
        if self.destroyed:
            return
        super().destroy()
        self.core.link.feeds.remove_reader(self.id)
        self._batches.clear()
        self._pending = 0
        if self._waiter is not None and not self._waiter.done():
            self._waiter.set_result(None)

    def declaration(self) -> frames.Frame:
        """Endpoint: declare the subscription."""
        typed = self._codec is not None and self.msg_type is not None
        return frames.Subscription(
            self.id,
            self.core.id,
            self.topic_name,
            type_name(self.msg_type) if typed and self.msg_type else None,
            type_hash(self.msg_type) if typed and self.msg_type else None,
            self.qos_profile.to_wire(),
            WINDOW_MESSAGES if self._credit else 0,
            WINDOW_BYTES if self._credit else 0,
        )


def _as_run(run: Run | Replay) -> Run:
    """Return a replay as the run it carries, so that it can be cut."""
    return run if isinstance(run, Run) else Run(*run[1:], b"")

"""The thread that converts messages and writes them into a bag, and the queue in front of it.

The event loop queues the messages of each turn, and never waits for the disk. Only this thread calls the
bag's writer: to open, write, split and close. An error of the disk ends the recording: written messages are
kept, and the loop is notified once. The caller bounds the queue, by `queued_bytes`.
"""

from __future__ import annotations

import asyncio
import threading
import time
from collections import deque
from contextlib import suppress
from functools import partial
from operator import itemgetter
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any, Final, Protocol

from actors.bags.errors import BagError, BagWriteError
from actors.bags.recorder.buffers import FLUSH_SEC, FlushPlan
from actors.interfaces.errors import InvalidMessageError
from proto.untrusted_text import peer_text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from pathlib import Path

    from actors.bags.contents.records import BagTopic
    from actors.bags.recorder.buffers import QueuedMessage
    from actors.bags.recorder.recorded_topic import RecordedTopic

CHECKED_BYTES: Final = 64 * 1024
"""Bytes to write between two readings of the clock."""
LEAST_BYTES: Final = 200
"""Bytes that a smaller message counts as: converting it takes as long as one of this size."""


class BagWriter(Protocol):
    """What the thread needs of `actors.bags.writer.Writer`."""

    @property
    def file(self) -> Path:
        """The file that is being written."""
        ...

    def add_topic(self, topic: BagTopic) -> int:
        """Add a topic; return its number."""
        ...

    def write(
        self,
        number: int,
        data: bytes,
        log_time_ns: int,
        publish_time_ns: int,
        sequence: int = 0,
        *,
        latched_key: bytes | None = None,
    ) -> None:
        """Write a message; `lost` counts it if that fails."""
        ...

    def flush(self) -> None:
        """Close the open chunk, and hand everything to the operating system."""
        ...

    def split(self) -> None:
        """Finish the file, and start the next one."""
        ...

    def set_losses(self, losses: Mapping[str, int], details: Mapping[str, Any] | None = None) -> None:
        """Set the counts of messages that are missing in the bag."""
        ...

    def lost(self) -> dict[str, int]:
        """Return the number of messages that `write` accepted and that could not be written, by topic."""
        ...

    def close(self) -> None:
        """Complete the bag."""
        ...


class WriterThread:
    """Writes a bag in a thread of its own.

    All methods are called on the event loop.

    Args:
        open_bag: Opens the bag; called in the thread.
        write_through: Whether to flush after each batch of messages, rather than within half a second.
        on_failed: Called on the loop, once, when the bag cannot be written any more.
        on_split: Called on the loop with the paths of a finished file and of the next one.
        clock: Returns seconds.

    Attributes:
        error: The error that ended writing; None while there was none.
        flushed: Number of messages handed to the operating system, which survive a kill of the process.
    """

    def __init__(
        self,
        open_bag: Callable[[], BagWriter],
        *,
        write_through: bool = False,
        on_failed: Callable[[Exception], object],
        on_split: Callable[[str, str], object],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._open_bag = open_bag
        self._write_through = write_through
        self._on_failed, self._on_split = on_failed, on_split
        self._clock = clock
        self._loop = asyncio.get_running_loop()
        self._queue: SimpleQueue[Callable[[BagWriter], None] | None] = SimpleQueue()
        # Each of the two is changed by one thread only, so they need no lock.
        self._put_bytes = self._taken_bytes = 0
        self._waiting: deque[Callable[[], object]] = deque()
        """Functions to call on the loop when there is room again."""
        self._plan = FlushPlan(FLUSH_SEC)
        self._file = ""
        self._opened: asyncio.Future[None] = self._loop.create_future()
        self._ended: asyncio.Future[None] = self._loop.create_future()
        self._losses: Callable[[], Mapping[str, Mapping[str, Any]]] = dict
        self._topics: list[RecordedTopic] = []
        self._is_ending = False
        self.error: Exception | None = None
        self._written = self.flushed = 0
        self._thread = threading.Thread(target=self._run, name="bag writer", daemon=True)

    @property
    def file(self) -> str:
        """The path of the file that is being written."""
        return self._file

    @property
    def queued_bytes(self) -> int:
        """Memory of the queued messages, in bytes."""
        return self._put_bytes - self._taken_bytes

    async def open(self) -> None:
        """Start the thread, and wait until the bag is open.

        Raises:
            BagError: The bag cannot be opened.
        """
        self._thread.start()
        await asyncio.shield(self._opened)

    def add_topic(self, topic: RecordedTopic) -> None:
        """Add a topic, before its first message."""
        self._topics.append(topic)
        self._queue.put(partial(_add_topic, topic))

    def put(self, messages: Sequence[QueuedMessage], size: int) -> None:
        """Queue messages, without a limit: the caller compares `queued_bytes` with its own.

        Args:
            messages: The messages.
            size: Their memory in bytes.
        """
        self._put_bytes += size
        self._queue.put(partial(self._write, messages, size))

    def when_room(self, function: Callable[[], object]) -> None:
        """Call a function on the loop once some queued messages are written, or soon if none are queued."""
        self._waiting.append(function)
        # The thread may have emptied the queue before it could see the function.
        if not self.queued_bytes:
            self._loop.call_soon(self._tell_room)

    async def split(self) -> None:
        """Write all queued messages, then continue with the next file.

        Raises:
            BagError: The bag cannot be written, or the recording has ended.
        """
        await self._call(self._split)

    async def flush(self) -> None:
        """Wait until all queued messages have been handed to the operating system.

        Raises:
            BagError: The bag cannot be written, or the recording has ended.
        """
        await self._call(self._flush)

    async def close(self, losses: Callable[[], Mapping[str, Mapping[str, Any]]]) -> None:
        """Write all queued messages, complete the bag, and end the thread.

        Args:
            losses: Called in the thread after the last write; returns counts of missing messages, by topic.
        """
        self._losses = losses
        self._is_ending = True
        if self._thread.ident is None:  # it could not be started
            return
        self._queue.put(None)
        await asyncio.shield(self._ended)
        self._thread.join()

    async def _call(self, function: Callable[[BagWriter], None]) -> None:
        if self.error is not None:
            raise self.error
        if self._is_ending:
            raise BagError("The recording has ended")
        done: asyncio.Future[None] = self._loop.create_future()

        def call(bag: BagWriter) -> None:
            try:
                if self.error is not None:
                    raise self.error
                function(bag)
            except Exception as error:
                self._tell(_fail, done, error)
                raise
            self._tell(_finish, done)

        self._queue.put(call)
        await done

    # Called in the thread

    def _run(self) -> None:
        try:
            bag = self._open_bag()
            self._file = str(bag.file)
        except Exception as error:  # noqa: BLE001 - raised by `open`, whatever it is
            self.error = error
            self._tell(_fail, self._opened, error)
            self._tell(_finish, self._ended)
            return
        self._tell(_finish, self._opened)
        while self._step(bag):
            pass
        self._close(bag)
        self._tell(_finish, self._ended)

    def _step(self, bag: BagWriter) -> bool:
        """Run the next step of the queue, or flush if that is due; return False at the end of the queue."""
        try:
            step = self._queue.get(timeout=self._plan.wait_sec(self._clock()))
        except Empty:
            if not self._plan.is_due(self._clock()):
                return True
            step = self._flush
        if step is None:
            return False
        try:
            # After a failure, steps only count messages, and report the error to those that wait for them.
            step(bag)
            self._look_at_file(bag)
        except Exception as error:  # noqa: BLE001 - the loop reports it, and the recording ends
            self._failed(error)
        return True

    def _failed(self, error: Exception) -> None:
        if self.error is None:
            self.error = error
            self._plan.flushed()
            self._tell(self._on_failed, error)

    def _close(self, bag: BagWriter) -> None:
        try:
            losses = self._losses()
            totals = {name: each["lost"] + each["dropped"] + each["invalid"] for name, each in losses.items()}
            bag.set_losses(totals, losses)
            bag.close()
        except Exception as error:  # noqa: BLE001 - as in `_step`
            self._failed(error)
        lost = bag.lost()
        for topic in self._topics:
            count = lost.get(topic.name, 0)
            topic.counts.written -= count
            topic.counts.unwritten += count

    def _write(self, messages: Sequence[QueuedMessage], size: int, bag: BagWriter) -> None:
        # The messages of one turn are grouped by topic; the file has them in the order of reception.
        left = iter(sorted(messages, key=itemgetter(0)))
        try:
            if self.error is None:
                self._write_all(left, bag)
        finally:
            for each in left:  # the writer has failed
                each.topic.counts.unwritten += 1
            self._taken_bytes += size
            if self._waiting:
                self._tell(self._tell_room)

    def _write_all(self, messages: Iterator[QueuedMessage], bag: BagWriter) -> None:
        unchecked = 0
        for log_time_ns, topic, data, publish_time_ns, sequence, gid in messages:
            try:
                cdr = topic.to_cdr(data)
            except InvalidMessageError as error:
                topic.counts.invalid += 1
                topic.problem = peer_text(str(error))
                continue
            key = gid if topic.is_latched else None
            try:
                bag.write(topic.number, cdr, log_time_ns, publish_time_ns, sequence, latched_key=key)
            finally:  # also if it fails: `_close` subtracts all that the bag could not write
                topic.counts.written += 1
            self._written += 1
            unchecked += max(len(cdr), LEAST_BYTES)
            if unchecked >= CHECKED_BYTES:
                unchecked = 0
                self._note(bag)
        self._note(bag)
        if self._write_through:
            self._flush(bag)

    def _note(self, bag: BagWriter) -> None:
        now = self._clock()
        self._plan.note(now)
        if self._plan.is_due(now):
            self._flush(bag)

    def _flush(self, bag: BagWriter) -> None:
        self._plan.flushed()
        bag.flush()
        # After its folder is removed, an open file can still be written, and all of it is lost in the end.
        if not bag.file.exists():
            raise BagWriteError(f"{bag.file}: the file was removed during the recording")
        self.flushed = self._written

    def _split(self, bag: BagWriter) -> None:
        self._plan.flushed()
        bag.split()
        self.flushed = self._written

    def _look_at_file(self, bag: BagWriter) -> None:
        """Report a split, which `split` or a limit has caused."""
        file = str(bag.file)
        if file != self._file:
            closed, self._file = self._file, file
            self._tell(self._on_split, closed, file)

    def _tell(self, function: Callable[..., object], *arguments: object) -> None:
        with suppress(RuntimeError):  # the loop is closed
            self._loop.call_soon_threadsafe(function, *arguments)

    # Called on the loop

    def _tell_room(self) -> None:
        # A function that finds no room registers itself again.
        for _ in range(len(self._waiting)):
            self._waiting.popleft()()


def _add_topic(topic: RecordedTopic, bag: BagWriter) -> None:
    topic.number = bag.add_topic(topic.bag_topic)


def _finish(future: asyncio.Future[None]) -> None:
    if not future.done():
        future.set_result(None)


def _fail(future: asyncio.Future[None], error: Exception) -> None:
    if not future.done():
        future.set_exception(error)

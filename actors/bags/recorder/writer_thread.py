"""The thread that converts messages and writes them into a bag, and the bounded queue in front of it.

The loop puts what has arrived in one turn into the queue, and never waits for the disk. Everything that the
bag's writer does happens in this thread: opening, converting, splitting, closing. An error of the disk ends
the recording: what has been written is kept, and the loop is told once.
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

    from actors.bags.recorder.buffers import QueuedMessage
    from actors.bags.recorder.recorded_topic import RecordedTopic
    from actors.bags.records import BagTopic

CHECKED_BYTES: Final = 64 * 1024
"""Bytes written between two looks at the clock."""
LEAST_BYTES: Final = 200
"""What a message counts for that is smaller: converting it takes as long."""


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
        """Write a message; one that cannot be written is counted by the bag."""
        ...

    def flush(self) -> None:
        """Close the open chunk, and hand everything to the operating system."""
        ...

    def split(self) -> None:
        """Go on with the next file."""
        ...

    def set_losses(self, losses: Mapping[str, int], details: Mapping[str, Any] | None = None) -> None:
        """Set what is missing in the bag."""
        ...

    def lost(self) -> dict[str, int]:
        """Return the messages that were given to `write` and are in no file, by topic."""
        ...

    def close(self) -> None:
        """Complete the bag."""
        ...


class WriterThread:
    """Writes a bag in a thread of its own.

    Everything is called on the event loop.

    Args:
        open_bag: Opens the bag; called in the thread.
        write_through: Flush after each part of the queue, rather than at least every half a second.
        on_failed: Called on the loop, once, when the bag cannot be written any more.
        on_split: Called on the loop with the path of a file that is complete, and of the next one.
        clock: Returns seconds.

    Attributes:
        error: Why nothing is written any more; None while it is.
        flushed: Messages that the operating system has: they survive a kill of the process.
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
        # Two numbers, each of which one thread alone changes, need no lock.
        self._put_bytes = self._taken_bytes = 0
        self._waiting: deque[Callable[[], object]] = deque()
        """Called on the loop when there is room again."""
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
        """What waits in the queue."""
        return self._put_bytes - self._taken_bytes

    async def open(self) -> None:
        """Start the thread, and wait until the bag is open.

        Raises:
            BagError: It cannot be opened.
        """
        self._thread.start()
        await asyncio.shield(self._opened)

    def add_topic(self, topic: RecordedTopic) -> None:
        """Add a topic, before its first message."""
        self._topics.append(topic)
        self._queue.put(partial(_add_topic, topic))

    def put(self, messages: Sequence[QueuedMessage], size: int) -> None:
        """Queue messages; the caller looks after `queued_bytes`.

        Args:
            messages: The messages.
            size: What they take in memory, in bytes.
        """
        self._put_bytes += size
        self._queue.put(partial(self._write, messages, size))

    def when_room(self, function: Callable[[], object]) -> None:
        """Call a function on the loop once a part of the queue is written, or soon if it is empty."""
        self._waiting.append(function)
        # The thread may have emptied it before it could see that somebody waits.
        if not self.queued_bytes:
            self._loop.call_soon(self._tell_room)

    async def split(self) -> None:
        """Go on with the next file, after everything that is queued.

        Raises:
            BagError: That is not possible.
        """
        await self._call(self._split)

    async def flush(self) -> None:
        """Wait until everything that is queued has been handed to the operating system.

        Raises:
            BagError: That is not possible.
        """
        await self._call(self._flush)

    async def close(self, losses: Callable[[], Mapping[str, Mapping[str, Any]]]) -> None:
        """Write everything that is queued, complete the bag, and end the thread.

        Args:
            losses: Returns what is missing in the bag, by topic; called in the thread, when all is written.
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

    # In the thread

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
        """Do what is queued next, or flush; return whether the queue goes on."""
        try:
            step = self._queue.get(timeout=self._plan.wait_sec(self._clock()))
        except Empty:
            if not self._plan.is_due(self._clock()):
                return True
            step = self._flush
        if step is None:
            return False
        try:
            # After a failure, steps are gone through only to end those that wait for them.
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
        # Each topic's messages come together; files are in the order of reception.
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
            finally:  # what the bag could not write is taken back at the end
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
        # The file of a folder that was removed can be written for hours, and is nowhere in the end.
        if not bag.file.exists():
            raise BagWriteError(f"{bag.file}: has been removed while it was written")
        self.flushed = self._written

    def _split(self, bag: BagWriter) -> None:
        self._plan.flushed()
        bag.split()
        self.flushed = self._written

    def _look_at_file(self, bag: BagWriter) -> None:
        """Report a split, whatever has caused it."""
        file = str(bag.file)
        if file != self._file:
            closed, self._file = self._file, file
            self._tell(self._on_split, closed, file)

    def _tell(self, function: Callable[..., object], *arguments: object) -> None:
        with suppress(RuntimeError):  # the loop has been closed: nobody is left to tell
            self._loop.call_soon_threadsafe(function, *arguments)

    # On the loop again

    def _tell_room(self) -> None:
        # Those that find none wait again.
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

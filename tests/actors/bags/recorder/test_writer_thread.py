"""The writer thread, with a bag in memory and a clock that the test sets."""

from __future__ import annotations

import asyncio
import threading
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from actors.bags.errors import BagError, BagExistsError, BagFullError, BagWriteError
from actors.bags.recorder.buffers import FLUSH_SEC, OVERHEAD_BYTES, QueuedMessage
from actors.bags.recorder.losses import losses_of
from actors.bags.recorder.recorded_topic import RecordedTopic
from actors.bags.recorder.writer_thread import WriterThread
from actors.interfaces import cdr
from actors.interfaces.codec import codec_for
from actors.interfaces.std_msgs.msg import Int32
from actors.qos.profile import DurabilityPolicy, QoSProfile
from tests.waiting import until

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from actors.bags.contents.records import BagTopic

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Bag:
    """A writer in memory that notes its calls.

    Attributes:
        done: What has been called, with the values of messages.
        fails: Raised by the next call of a method of this name, or for a message with this value.
        failed: How many messages were not written.
        lets_write: Set while messages may be written.
    """

    def __init__(self, folder: Path) -> None:
        self.done: list[Any] = []
        self.losses: Mapping[str, Any] = {}
        self.fails: dict[str | int, Exception] = {}
        self.lets_write = threading.Event()
        self.lets_write.set()
        self.failed = 0
        self._folder, self._number = folder, 0
        self.file.touch()

    @property
    def file(self) -> Path:
        """The present file."""
        return self._folder / f"{self._number}.mcap"

    def _note(self, what: str | int, *rest: Any) -> None:
        if what in self.fails:
            self.failed += isinstance(what, int)
            raise self.fails.pop(what)
        self.done.append((what, *rest) if rest else what)

    def add_topic(self, topic: BagTopic) -> int:
        """Add a topic."""
        self._note("topic", topic.name)
        return 7

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
        """Write a message."""
        self.lets_write.wait()
        assert number == 7
        self._note(cdr.decode(Int32, data).data, log_time_ns, publish_time_ns, sequence, latched_key)

    def flush(self) -> None:
        """Flush."""
        self._note("flush")

    def split(self) -> None:
        """Split."""
        self._note("split")
        self._number += 1
        self.file.touch()

    def set_losses(self, losses: Mapping[str, int], details: Mapping[str, Any] | None = None) -> None:
        """Keep the losses."""
        del details
        self.losses = losses

    def lost(self) -> dict[str, int]:
        """Return the messages that were not written."""
        return {"/numbers": self.failed}

    def close(self) -> None:
        """Close."""
        self._note("close")


class Desk:
    """A thread, its bag, and what it has reported to the loop."""

    def __init__(self, bag: Bag, **options: Any) -> None:
        self.bag = bag
        self.now = 0.0
        self.errors: list[Exception] = []
        self.splits: list[tuple[str, str]] = []
        self.topic = RecordedTopic("/numbers", Int32, [QoSProfile(depth=1)])
        self.thread = WriterThread(
            lambda: bag,
            on_failed=self.errors.append,
            on_split=lambda closed, opened: self.splits.append((Path(closed).name, Path(opened).name)),
            clock=lambda: self.now,
            **options,
        )

    async def open(self) -> None:
        """Start the thread, and add the topic."""
        await self.thread.open()
        self.thread.add_topic(self.topic)

    async def looked_at_clock(self) -> None:
        """Wait until the thread has written everything, and noted when: it does so after it has counted."""
        await until(lambda: not self.thread.queued_bytes)

    def put(self, *numbers: int, topic: RecordedTopic | None = None) -> None:
        """Queue messages whose numbers are their log times."""
        encode: Callable[[Int32], bytes] = codec_for(Int32).encode
        messages = [
            QueuedMessage(each, topic or self.topic, encode(Int32(data=each)), each + 1, each + 2, b"gid")
            for each in numbers
        ]
        self.thread.put(messages, sum(len(each.data) + OVERHEAD_BYTES for each in messages))


async def test_messages_are_written_in_the_order_of_reception(tmp_path: Path) -> None:
    """The messages of a turn are queued topic by topic, and written by log time."""
    desk = Desk(Bag(tmp_path))
    await desk.open()
    desk.put(3, 1, 2)
    await desk.thread.close(dict)
    messages = [(each, each, each + 1, each + 2, None) for each in (1, 2, 3)]
    assert desk.bag.done == [("topic", "/numbers"), *messages, "close"]
    assert (desk.topic.counts.written, desk.thread.queued_bytes, desk.errors) == (3, 0, [])


async def test_a_chunk_is_written_in_time(tmp_path: Path) -> None:
    """A flush follows the first message within half a second, and not each message."""
    desk = Desk(Bag(tmp_path))
    await desk.open()
    desk.put(1)
    await desk.looked_at_clock()
    desk.now = FLUSH_SEC / 2
    desk.put(2)
    await desk.looked_at_clock()
    assert "flush" not in desk.bag.done
    desk.now = FLUSH_SEC
    desk.put(3)
    await until(lambda: desk.thread.flushed >= 2)  # the thread may look at its clock before the third comes
    assert "flush" in desk.bag.done
    await desk.thread.close(dict)


async def test_a_chunk_is_written_without_further_messages(tmp_path: Path) -> None:
    """Without further messages, the thread wakes up for a flush."""
    desk = Desk(Bag(tmp_path))
    await desk.open()
    desk.put(1)
    await desk.looked_at_clock()
    desk.now = FLUSH_SEC
    await until(lambda: "flush" in desk.bag.done)
    await desk.thread.close(dict)


def _is_flushed(desk: Desk, count: int) -> bool:
    return desk.thread.flushed == count


async def test_without_a_cache_everything_is_written_at_once(tmp_path: Path) -> None:
    """Each batch of messages is flushed."""
    desk = Desk(Bag(tmp_path), write_through=True)
    await desk.open()
    for number in (1, 2):
        desk.put(number)
        await until(partial(_is_flushed, desk, number))
    await desk.thread.close(dict)
    assert desk.bag.done.count("flush") == 2


async def test_latched_values_have_their_publisher(tmp_path: Path) -> None:
    """Messages of latched topics name their publishers, so that the next file repeats the newest of each."""
    desk = Desk(Bag(tmp_path))
    await desk.open()
    latched = RecordedTopic("/map", Int32, [QoSProfile(depth=1), LATCHED])
    desk.thread.add_topic(latched)
    desk.put(1, topic=latched)
    await desk.thread.close(dict)
    assert (1, 1, 2, 3, b"gid") in desk.bag.done


async def test_a_split_follows_what_is_queued(tmp_path: Path) -> None:
    """A split follows the queued messages, and is reported with both files."""
    desk = Desk(Bag(tmp_path))
    await desk.open()
    desk.put(1)
    await desk.thread.split()
    assert [each if isinstance(each, str) else each[0] for each in desk.bag.done] == ["topic", 1, "split"]
    await until(lambda: desk.splits == [("0.mcap", "1.mcap")])
    assert desk.thread.file.endswith("1.mcap")
    await desk.thread.close(dict)


async def test_losses_are_written_at_the_end(tmp_path: Path) -> None:
    """The bag gets the sum of all losses by topic."""
    desk = Desk(Bag(tmp_path))
    await desk.open()
    await desk.thread.close(lambda: {"/numbers": {"lost": 1, "dropped": 2, "invalid": 3, "publishers": {}}})
    assert desk.bag.losses == {"/numbers": 6}


async def test_losses_have_what_was_found_invalid_at_the_end(tmp_path: Path) -> None:
    """Messages in the queue at the end are converted before losses are counted."""
    desk = Desk(Bag(tmp_path))
    await desk.open()
    desk.bag.lets_write.clear()
    desk.put(1)
    desk.thread.put([QueuedMessage(2, desk.topic, b"\xc0", 2, 2, b"gid")], OVERHEAD_BYTES)
    ending = asyncio.create_task(desk.thread.close(lambda: losses_of({"/numbers": desk.topic.counts}, {})))
    desk.bag.lets_write.set()
    await ending
    assert desk.bag.losses == {"/numbers": 1}


async def test_messages_behind_an_error_are_counted(tmp_path: Path) -> None:
    """After a failure, the rest of the batch and later messages count as unwritten."""
    desk = Desk(Bag(tmp_path))
    desk.bag.fails[2] = BagFullError("full")
    await desk.open()
    desk.put(1, 2, 3, 4)
    desk.put(5)
    await desk.thread.close(lambda: losses_of({"/numbers": desk.topic.counts}, {}))
    assert (desk.topic.counts.written, desk.topic.counts.unwritten) == (1, 4)
    assert desk.bag.losses == {"/numbers": 3}


async def test_nothing_is_awaited_of_a_thread_that_has_ended(tmp_path: Path) -> None:
    """A split or a flush after the end raises an error."""
    desk = Desk(Bag(tmp_path))
    await desk.open()
    await desk.thread.close(dict)
    for late in (desk.thread.split, desk.thread.flush):
        with pytest.raises(BagError, match="has ended"):
            await late()


@pytest.mark.parametrize("step", [1, "flush", "split", "topic"])
async def test_an_error_ends_the_writing(tmp_path: Path, step: Any) -> None:
    """Case 42: the error is reported once, writing ends, the bag is closed, and the queue is emptied."""
    desk = Desk(Bag(tmp_path))
    desk.bag.fails[step] = BagFullError("full")
    await desk.open()
    desk.put(1)
    with pytest.raises(BagFullError):
        await (desk.thread.split() if step == "split" else desk.thread.flush())
    desk.put(2)
    with pytest.raises(BagFullError):
        await desk.thread.split()
    await desk.thread.close(dict)
    assert [str(each) for each in desk.errors] == ["full"]
    assert desk.bag.done[-1] == "close"
    assert all(each[0] != 2 for each in desk.bag.done)
    assert desk.thread.queued_bytes == 0


async def test_an_error_at_the_end_is_told(tmp_path: Path) -> None:
    """A disk may be full when the last chunk is written."""
    desk = Desk(Bag(tmp_path))
    desk.bag.fails["close"] = BagFullError("full")
    await desk.open()
    await desk.thread.close(dict)
    await until(lambda: bool(desk.errors))
    assert isinstance(desk.thread.error, BagFullError)


async def test_a_bag_that_cannot_be_opened(tmp_path: Path) -> None:
    """`open` raises the error, and the thread ends."""

    def fail() -> Bag:
        raise BagExistsError("exists")

    del tmp_path
    told: list[Any] = []
    thread = WriterThread(fail, on_failed=told.append, on_split=lambda closed, _: told.append(closed))
    with pytest.raises(BagExistsError):
        await thread.open()
    await thread.close(dict)
    assert not told


async def test_a_removed_file_is_noticed(tmp_path: Path) -> None:
    """A removed file is an error, although writing into it raises none."""
    desk = Desk(Bag(tmp_path))
    await desk.open()
    desk.bag.file.unlink()
    with pytest.raises(BagWriteError, match="removed"):
        await desk.thread.flush()
    await desk.thread.close(dict)


async def test_room_is_reported(tmp_path: Path) -> None:
    """The function is called after a batch is written, or at once if nothing is queued."""
    desk = Desk(Bag(tmp_path))
    await desk.open()
    room = asyncio.Event()
    desk.thread.when_room(room.set)
    await room.wait()
    room.clear()
    desk.bag.lets_write.clear()
    desk.put(1)
    desk.thread.when_room(room.set)
    assert desk.thread.queued_bytes > 0
    assert not room.is_set()
    desk.bag.lets_write.set()
    await room.wait()
    assert desk.thread.queued_bytes == 0
    await desk.thread.close(dict)

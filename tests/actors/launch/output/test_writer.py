"""Output that a thread writes: in order, bounded, never waited for, and counted when it is dropped."""

from __future__ import annotations

import errno
import os
import threading

import pytest

from actors.launch.output import writer
from actors.launch.output.writer import Batch, OutputWriter, UnattributedOutput, WriteQueue
from actors.launch.planning.events import Stream
from tests.actors.launch.output.threads import join_threads

DEADLINE_SEC = 30.0


def test_what_is_written_comes_in_order() -> None:
    """All of it, also what waits when it is closed."""
    reading, writing = os.pipe()
    output = OutputWriter(writing, lambda: None)
    for number in range(100):
        output.write(b"%d\n" % number)
    assert output.close(DEADLINE_SEC)
    os.close(writing)
    with os.fdopen(reading, "rb") as file:
        assert file.read() == b"".join(b"%d\n" % number for number in range(100))
    assert output.lost_lines == 0


def test_what_nobody_takes_is_counted_and_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    """More than may wait is dropped; the reader learns how much, once it reads again."""
    monkeypatch.setattr(writer, "MAX_QUEUED_BYTES", 1000)
    reading, writing = os.pipe()
    output = OutputWriter(writing, lambda: None)
    filler = b"x" * 999 + b"\n"
    for _ in range(1000):
        output.write(filler)
    lost = output.lost_lines
    assert lost > 0
    got: list[bytes] = []

    def read() -> None:
        with os.fdopen(reading, "rb") as file:
            got.append(file.read())

    reader = threading.Thread(target=read)
    reader.start()
    assert output.close(DEADLINE_SEC)
    os.close(writing)
    reader.join(DEADLINE_SEC)
    assert got[0].count(filler) == 1000 - lost
    assert b"lines are not shown: they came too fast\n" in got[0]


def test_closing_does_not_wait_for_a_reader_that_does_not_read() -> None:
    """Beyond the time that it is given."""
    reading, writing = os.pipe()
    output = OutputWriter(writing, lambda: None)
    output.write(b"x" * (1 << 20) + b"\n")
    assert not output.close(0.01)
    os.close(reading)  # lets the thread end
    join_threads("launch output")
    os.close(writing)


def test_a_reader_that_is_gone_is_reported() -> None:
    """Once; what comes after is counted."""
    reading, writing = os.pipe()
    os.close(reading)
    closed = threading.Event()
    output = OutputWriter(writing, closed.set)
    output.write(b"a\n")
    assert closed.wait(DEADLINE_SEC)
    output.write(b"b\n")
    assert output.lost_lines == 1
    assert not output.close(DEADLINE_SEC)
    os.close(writing)


def test_what_is_reported_of_lost_lines_can_be_chosen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where programs read, a line for people would be wrong."""
    monkeypatch.setattr(writer, "MAX_QUEUED_BYTES", 5)
    reading, writing = os.pipe()
    output = OutputWriter(writing, lambda: None, lambda lines: b"<%d>\n" % lines)
    output.write(b"too long\nfor it\n")
    assert output.close(DEADLINE_SEC)
    os.close(writing)
    with os.fdopen(reading, "rb") as file:
        assert file.read() == b"<2>\n"


def test_a_line_stays_below_all_others() -> None:
    """It is erased before each batch and drawn behind it; in the end it is gone. The width comes with it."""
    reading, writing = os.pipe()
    output = OutputWriter(writing, lambda: None)
    asked: list[int] = []

    def draw(columns: int) -> bytes:
        asked.append(columns)
        return b"status"

    output.set_status_line(draw)
    assert os.read(reading, 100) == b"status"
    output.write(b"a\nb\n")
    assert os.read(reading, 100) == b"\r\x1b[Ka\nb\nstatus"
    output.set_status_line(draw)
    output.set_status_line(lambda columns: b"other")
    assert os.read(reading, 100) == b"\r\x1b[Kother"
    assert output.close(DEADLINE_SEC)
    os.close(writing)
    with os.fdopen(reading, "rb") as file:
        assert file.read() == b"\r\x1b[K"
    assert set(asked) == {80}


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT])
def test_a_full_disk_is_reported_once_and_does_not_end_it(
    monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    """What has no room is counted; when there is room again the next line begins at its beginning."""
    reading, writing = os.pipe()
    told: list[OSError] = []
    answers: list[int | None] = [2, None, None]  # a piece is written, then there is no room, twice
    tried = threading.Semaphore(0)
    write = os.write

    def limited(descriptor: int, data: bytes | memoryview) -> int:
        if descriptor != writing or not answers:
            return write(descriptor, data)
        room = answers.pop(0)
        if room is None:
            tried.release()
            raise OSError(number, os.strerror(number))
        return write(descriptor, data[:room])

    monkeypatch.setattr("actors.launch.output.writer.os.write", limited)
    output = OutputWriter(writing, pytest.fail, on_disk_full=told.append)
    for line in (b"first\n", b"second\n"):
        output.write(line)
        assert tried.acquire(timeout=DEADLINE_SEC)
    output.write(b"third\n")
    assert not output.close(DEADLINE_SEC)
    os.close(writing)
    with os.fdopen(reading, "rb") as file:
        assert file.read() == b"fi\nthird\n"
    assert [error.errno for error in told] == [number]
    assert output.unwritten_lines == output.lost_lines == 2


def test_pieces_are_taken_in_batches() -> None:
    """As much as a batch holds, in order; then the end, and that again."""
    queue: WriteQueue[int] = WriteQueue()
    for number in range(3):
        queue.add(number, writer.BATCH_BYTES // 2, 1)
    queue.end()
    assert queue.next_batch() == Batch((0, 1))
    assert queue.next_batch() == Batch((2,))
    assert queue.next_batch() == queue.next_batch() == Batch(last=True)


def test_what_is_too_much_is_reported_when_there_is_room(monkeypatch: pytest.MonkeyPatch) -> None:
    """Once, behind what waits."""
    monkeypatch.setattr(writer, "MAX_QUEUED_BYTES", 10)
    queue: WriteQueue[str] = WriteQueue()
    queue.add("a", 10, 1)
    queue.add("b", 1, 3)
    assert queue.next_batch() == Batch(("a",))
    queue.add("c", 10, 1)
    assert queue.next_batch() == Batch(("c",))
    assert queue.next_batch() == Batch(lost_lines=3)
    queue.wake()
    assert queue.next_batch() == Batch()
    assert queue.lost_lines == 3


def test_nothing_is_kept_that_cannot_be_written() -> None:
    """What waits is lost with what comes later; and so is what comes after the end."""
    queue: WriteQueue[str] = WriteQueue()
    queue.add("a", 1, 2)
    queue.abandon()
    queue.add("b", 1, 3)
    assert queue.lost_lines == 5
    other: WriteQueue[str] = WriteQueue()
    other.end()
    other.add("c", 1, 1)
    assert other.lost_lines == 1


def test_only_whole_lines_are_passed_on() -> None:
    """Each stream for itself; the rest of a line at the end."""
    got: list[tuple[str, bytes]] = []
    output = UnattributedOutput(
        {
            Stream.STDOUT: lambda data: got.append(("out", data)),
            Stream.STDERR: lambda data: got.append(("err", data)),
        }
    )
    output.write(Stream.STDOUT, b"a ")
    output.write(Stream.STDERR, b"bad\n")
    output.write(Stream.STDOUT, b"line\nand another\nno end")
    assert got == [("err", b"bad\n"), ("out", b"a line\nand another\n")]
    output.end()
    assert got[2:] == [("out", b"no end\n")]


def test_threads_do_not_disturb_each_other() -> None:
    """No byte is lost, and nothing comes twice."""
    got = bytearray()
    output = UnattributedOutput({Stream.STDOUT: got.extend})

    def chatter() -> None:
        for _ in range(1000):
            output.write(Stream.STDOUT, b"ab\ncd")

    threads = [threading.Thread(target=chatter) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    output.end()
    assert len(got) == 4 * 1000 * 5 + 1

"""Requests and replies on their way out of other threads than the loop's."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

from actors.endpoints.entries import EntryBatch
from actors.endpoints.thread_entries import BURST, MAX_ENTRY_BYTES, ThreadEntries
from actors.session.thread_channel import ThreadChannel
from proto.wire.codec import decode
from proto.wire.codes import Status
from proto.wire.frames import Reply, ReplyEntry

if TYPE_CHECKING:
    from collections.abc import Callable


class Writing(ThreadChannel):
    """A channel that notes the frames that threads write, or refuses them."""

    def __init__(self, *, takes: bool = True) -> None:
        self.takes = takes
        self.tried = 0
        self.written: list[list[int]] = []

    def write_now(self, raw: bytes) -> bool:
        """Note a frame."""
        self.tried += 1
        if self.takes:
            self.written.append([each.call for each in cast("Reply", decode(raw)).entries])
        return self.takes


class Connection:
    """A link, and the endpoint whose replies it sends."""

    def __init__(self) -> None:
        self.channel = Writing()
        self.posted: list[Callable[[], object]] = []
        self.is_behind = False
        self.outgoing: EntryBatch[ReplyEntry] = EntryBatch()
        link: Any = self
        source: Any = self
        self.entries = ThreadEntries(link, self.outgoing, source, lambda entries: Reply(1, entries))

    def post(self, callback: Callable[[], object]) -> None:
        """Note what a thread asks of the loop."""
        self.posted.append(callback)

    def flush_later(self, source: object) -> None:
        """Do nothing: the tests look at what is collected."""

    def add(self, *calls: int, size: int = 1, last: bool = False) -> None:
        """Reply to calls."""
        for call in calls:
            entry = ReplyEntry(call, Status.OK, more=False, attributes=None, body=bytes(size))
            self.entries.add(entry, self.channel, last=last)

    def run(self) -> None:
        """Do what the loop was asked for."""
        while self.posted:
            self.posted.pop(0)()

    @property
    def collected(self) -> list[int]:
        """What the loop sends next."""
        return [each.call for each in self.outgoing.peek_all()]


def test_a_whole_frame_is_written_and_the_loop_sends_the_rest() -> None:
    """The loop is asked once."""
    link = Connection()
    link.add(*range(BURST + 3))
    assert link.channel.written == [list(range(BURST))]
    assert len(link.posted) == 1
    link.run()
    assert link.collected == [BURST, BURST + 1, BURST + 2]


def test_the_last_one_takes_the_others_along() -> None:
    """It leaves at once, in the same frame."""
    link = Connection()
    link.add(1, 2)
    link.add(3, last=True)
    assert link.channel.written == [[1, 2, 3]]
    link.run()
    assert not link.collected


def test_a_frame_is_as_large_as_a_thread_may_write() -> None:
    """Large entries have frames of their own."""
    link = Connection()
    link.add(1, 2, size=MAX_ENTRY_BYTES // 2)
    link.add(3, last=True)
    assert link.channel.written == [[1], [2, 3]]


def test_what_cannot_be_written_is_sent_by_the_loop_in_order() -> None:
    """Another frame waits there to be written."""
    link = Connection()
    link.channel.takes = False
    link.add(1, 2)
    link.add(3, last=True)
    link.add(4)
    link.run()
    assert link.collected == [1, 2, 3, 4]


def test_a_frame_that_cannot_be_written_is_not_tried_for_each_entry() -> None:
    """It is made again for each try."""
    link = Connection()
    link.channel.takes = False
    link.add(*range(BURST + 5))
    assert link.channel.tried == 1
    link.run()
    assert link.collected == list(range(BURST + 5))


def test_nothing_overtakes_what_the_loop_is_about_to_send() -> None:
    """It is still being collected."""
    link = Connection()
    link.add(1)
    link.run()
    link.add(2, last=True)
    assert not link.channel.written
    link.run()
    assert link.collected == [1, 2]


def test_nothing_overtakes_messages_that_the_loop_has_to_send() -> None:
    """The handler has published something, or logged a line."""
    link = Connection()
    link.is_behind = True
    link.add(1, last=True)
    assert not link.channel.written
    link.run()
    assert link.collected == [1]


def test_replies_of_a_session_that_has_ended_are_dropped() -> None:
    """In the next session their numbers are those of other calls."""
    link = Connection()
    link.add(1)
    link.channel = Writing()
    link.add(2, last=True)
    assert link.channel.written == [[2]]
    link.add(3)
    link.channel = Writing()
    link.run()
    assert not link.collected

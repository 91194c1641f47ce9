"""Feeds: which subscription of a link gets which publisher's runs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.session.attachments import Attachment, Attachments
from proto.wire.codes import DetachReason
from proto.wire.frames import Assert, Attached, Batch, Detached, Replay
from tests.seams.nodes import publishers_by_reader, readers_by_publisher, suspended_attachments

if TYPE_CHECKING:
    from collections.abc import Callable

GID = bytes(16)


class Ear:
    """A reader that records the calls it gets."""

    def __init__(self, name: str, diary: list[str]) -> None:
        self.name = name
        self.diary = diary
        self.on_receive: Callable[[], None] = lambda: None

    def receive(self, attachment: Attachment, batch: Batch | Replay) -> None:
        self.diary.append(f"{self.name} {type(batch).__name__} {attachment.publisher}")
        self.on_receive()

    def attached(self, attachment: Attachment) -> None:
        self.diary.append(f"{self.name} + {attachment.publisher}")

    def detached(self, attachment: Attachment, *, suspended: bool = False) -> None:
        self.diary.append(f"{self.name} {'~' if suspended else '-'} {attachment.publisher}")

    def suspension_ended(self) -> None:
        self.diary.append(f"{self.name} forgets")

    def asserted(self, attachment: Attachment) -> None:
        self.diary.append(f"{self.name} ! {attachment.publisher}")


def batch(publisher: int) -> Batch:
    return Batch(publisher, 0, 0, 1, None, None, b"\xdd\0\0\0\1\xc0", b"")


def attachments_of(count: int) -> tuple[Attachments, list[Ear], list[str]]:
    diary: list[str] = []
    attachments, ears = Attachments(), [Ear("abc"[number], diary) for number in range(count)]
    for number, ear in enumerate(ears, 1):
        attachments.add_reader(number, ear)
    return attachments, ears, diary


def test_a_run_goes_to_all_who_are_attached() -> None:
    """One run is handed to each attached subscription, in the order of attachment, and to no other."""
    attachments, _, diary = attachments_of(3)
    attachments.attached(Attached(7, (1, 2, 99), GID, 0, "/n", {}))
    attachments.attached(Attached(8, (3,), GID, 0, "/n", {}))
    attachments.batch_received(batch(7))
    attachments.batch_received(batch(9))
    assert diary == ["a + 7", "b + 7", "c + 8", "a Batch 7", "b Batch 7"]


def test_a_replay_goes_to_one() -> None:
    """Latched messages are for the subscription that they name."""
    attachments, _, diary = attachments_of(2)
    attachments.attached(Attached(7, (1, 2), GID, 0, "/n", {}))
    diary.clear()
    attachments.replay_received(Replay(2, *batch(7)[:-1]))
    attachments.replay_received(Replay(99, *batch(7)[:-1]))
    assert diary == ["b Replay 7"]


def test_detached_ends_it() -> None:
    """After DETACHED no run comes; the others go on; unknown ids are ignored."""
    attachments, _, diary = attachments_of(2)
    attachments.attached(Attached(7, (1, 2), GID, 0, "/n", {}))
    attachments.detached(Detached(7, (1, 99), 0))
    attachments.detached(Detached(6, (1,), 0))
    diary.clear()
    attachments.batch_received(batch(7))
    attachments.detached(Detached(7, (2,), 0))
    attachments.batch_received(batch(7))
    assert diary == ["b Batch 7", "b - 7"]
    assert readers_by_publisher(attachments) == {}


def test_attached_anew_counts_once() -> None:
    """A second ATTACHED for the same pair replaces the first: no run comes twice."""
    attachments, _, diary = attachments_of(1)
    attachments.attached(Attached(7, (1,), GID, 0, "/n", {}))
    attachments.attached(Attached(7, (1,), GID, 5, "/n", {}))
    attachments.batch_received(batch(7))
    assert diary == ["a + 7", "a - 7", "a + 7", "a Batch 7"]


def test_a_reader_may_leave_while_it_reads() -> None:
    """A callback that destroys a subscription does not disturb the run on its way to the others."""
    attachments, ears, diary = attachments_of(3)
    attachments.attached(Attached(7, (1, 2, 3), GID, 0, "/n", {}))
    ears[0].on_receive = lambda: attachments.remove_reader(1)
    diary.clear()
    attachments.batch_received(batch(7))
    attachments.batch_received(batch(7))
    assert diary == ["a Batch 7", "b Batch 7", "c Batch 7", "b Batch 7", "c Batch 7"]


def test_a_reader_that_leaves_is_looked_for_at_its_own_publishers_only() -> None:
    """Removing one of many costs what that one has attached, silent publishers included; others go on."""
    attachments, _, diary = attachments_of(3)
    for publisher in range(10):
        attachments.attached(Attached(publisher, (3,), GID, 0, "/n", {}))
    attachments.attached(Attached(20, (1, 2), GID, 0, "/n", {}))
    attachments.attached(Attached(21, (1,), GID, 0, "/n", {}))
    attachments.attached(Attached(22, (1,), GID, 0, "/n", {}))
    attachments.detached(Detached(21, (1,), DetachReason.SUSPENDED))
    attachments.detached(Detached(22, (1,), DetachReason.GONE))
    assert publishers_by_reader(attachments)[1] == {20, 21}
    untouched = {publisher: readers_by_publisher(attachments)[publisher] for publisher in range(10)}
    attachments.remove_reader(1)
    assert all(
        readers_by_publisher(attachments)[publisher] is of_publisher
        for publisher, of_publisher in untouched.items()
    )
    assert suspended_attachments(attachments) == {}
    diary.clear()
    attachments.batch_received(batch(20))
    assert diary == ["b Batch 20"]
    attachments.remove_reader(2)
    attachments.remove_reader(3)
    assert not readers_by_publisher(attachments)
    assert not publishers_by_reader(attachments)


def test_a_session_ends_all_attachments() -> None:
    """After `clear` publisher ids of the old session mean nothing."""
    attachments, _, diary = attachments_of(2)
    attachments.attached(Attached(7, (1,), GID, 0, "/n", {}))
    attachments.attached(Attached(8, (2,), GID, 0, "/n", {}))
    diary.clear()
    attachments.clear()
    attachments.batch_received(batch(7))
    assert diary == []
    assert (len(attachments), publishers_by_reader(attachments)) == (0, {})


def test_a_silent_publisher_is_forgotten_when_it_is_back_or_gone() -> None:
    """A suspension is distinguished from an end, and its own end is reported, however it ends."""
    attachments, _, diary = attachments_of(1)
    attachments.attached(Attached(7, (1,), GID, 0, "/n", {}))
    attachments.attached(Attached(8, (1,), GID, 0, "/n", {}))
    for publisher in (7, 8):
        attachments.detached(Detached(publisher, (1,), DetachReason.SUSPENDED))
    attachments.attached(Attached(7, (1,), GID, 0, "/n", {}))
    attachments.detached(Detached(8, (1,), DetachReason.GONE))
    attachments.detached(Detached(7, (1,), DetachReason.SUSPENDED))
    assert diary == [
        "a + 7",
        "a + 8",
        "a ~ 7",
        "a ~ 8",
        "a forgets",
        "a + 7",
        "a forgets",
        "a ~ 7",
    ]


def test_an_assertion_goes_to_all_who_are_attached() -> None:
    """A publisher's sign of life reaches its readers, and nobody else."""
    attachments, _, diary = attachments_of(2)
    attachments.attached(Attached(7, (2,), GID, 0, "/n", {}))
    attachments.asserted(Assert(7))
    attachments.asserted(Assert(8))
    assert diary == ["b + 7", "b ! 7"]


def test_nobody_is_remembered_for_a_subscription_that_has_gone() -> None:
    """Publishers that only it heard are forgotten at once, those that somebody else hears stay."""
    attachments, _, diary = attachments_of(2)
    attachments.attached(Attached(7, (1,), GID, 0, "/n", {}))
    attachments.attached(Attached(8, (1, 2), GID, 0, "/n", {}))
    attachments.remove_reader(1)
    assert len(attachments) == 1
    attachments.attached(Attached(9, (1,), GID, 0, "/n", {}))  # it has crossed the UNDECLARE
    assert len(attachments) == 1
    diary.clear()
    attachments.batch_received(batch(8))
    assert diary == ["b Batch 8"]

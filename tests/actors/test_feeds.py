"""Feeds: which subscription of a link gets which publisher's runs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.feeds import Feeds, Inflow
from proto.codes import DetachReason
from proto.frames import Assert, Attached, Detached, Replay, Run

if TYPE_CHECKING:
    from collections.abc import Callable

GID = bytes(16)


class Ear:
    """A reader that writes down what it is told."""

    def __init__(self, name: str, diary: list[str]) -> None:
        self.name = name
        self.diary = diary
        self.on_receive: Callable[[], None] = lambda: None

    def receive(self, inflow: Inflow, run: Run | Replay) -> None:
        self.diary.append(f"{self.name} {type(run).__name__} {inflow.publisher}")
        self.on_receive()

    def attached(self, inflow: Inflow) -> None:
        self.diary.append(f"{self.name} + {inflow.publisher}")

    def detached(self, inflow: Inflow, *, silent: bool = False) -> None:
        self.diary.append(f"{self.name} {'~' if silent else '-'} {inflow.publisher}")

    def forgotten(self, inflow: Inflow) -> None:
        self.diary.append(f"{self.name} forgets {inflow.publisher}")

    def asserted(self, inflow: Inflow) -> None:
        self.diary.append(f"{self.name} ! {inflow.publisher}")


def run(publisher: int) -> Run:
    return Run(publisher, 0, 0, 1, None, None, b"\xdd\0\0\0\1\xc0", b"")


def feeds_of(count: int) -> tuple[Feeds, list[Ear], list[str]]:
    diary: list[str] = []
    feeds, ears = Feeds(), [Ear("abc"[number], diary) for number in range(count)]
    for number, ear in enumerate(ears, 1):
        feeds.add_reader(number, ear)
    return feeds, ears, diary


def test_a_run_goes_to_all_who_are_attached() -> None:
    """One run is handed to each attached subscription, in the order of attachment, and to no other."""
    feeds, _, diary = feeds_of(3)
    feeds.attached(Attached(7, (1, 2, 99), GID, 0, "/n", {}))
    feeds.attached(Attached(8, (3,), GID, 0, "/n", {}))
    feeds.run_received(run(7))
    feeds.run_received(run(9))
    assert diary == ["a + 7", "b + 7", "c + 8", "a Run 7", "b Run 7"]


def test_a_replay_goes_to_one() -> None:
    """Latched messages are for the subscription that they name."""
    feeds, _, diary = feeds_of(2)
    feeds.attached(Attached(7, (1, 2), GID, 0, "/n", {}))
    diary.clear()
    feeds.replay_received(Replay(2, *run(7)[:-1]))
    feeds.replay_received(Replay(99, *run(7)[:-1]))
    assert diary == ["b Replay 7"]


def test_detached_ends_it() -> None:
    """After DETACHED no run comes; the others go on; unknown ids are ignored."""
    feeds, _, diary = feeds_of(2)
    feeds.attached(Attached(7, (1, 2), GID, 0, "/n", {}))
    feeds.detached(Detached(7, (1, 99), 0))
    feeds.detached(Detached(6, (1,), 0))
    diary.clear()
    feeds.run_received(run(7))
    feeds.detached(Detached(7, (2,), 0))
    feeds.run_received(run(7))
    assert diary == ["b Run 7", "b - 7"]
    assert feeds._inflows == {}


def test_attached_anew_counts_once() -> None:
    """A second ATTACHED for the same pair replaces the first: no run comes twice."""
    feeds, _, diary = feeds_of(1)
    feeds.attached(Attached(7, (1,), GID, 0, "/n", {}))
    feeds.attached(Attached(7, (1,), GID, 5, "/n", {}))
    feeds.run_received(run(7))
    assert diary == ["a + 7", "a - 7", "a + 7", "a Run 7"]


def test_a_reader_may_leave_while_it_reads() -> None:
    """A callback that destroys a subscription does not disturb the run on its way to the others."""
    feeds, ears, diary = feeds_of(3)
    feeds.attached(Attached(7, (1, 2, 3), GID, 0, "/n", {}))
    ears[0].on_receive = lambda: feeds.remove_reader(1)
    diary.clear()
    feeds.run_received(run(7))
    feeds.run_received(run(7))
    assert diary == ["a Run 7", "b Run 7", "c Run 7", "b Run 7", "c Run 7"]


def test_a_reader_that_leaves_is_looked_for_at_its_own_publishers_only() -> None:
    """Removing one of many costs what that one has attached, silent publishers included; others go on."""
    feeds, _, diary = feeds_of(3)
    for publisher in range(10):
        feeds.attached(Attached(publisher, (3,), GID, 0, "/n", {}))
    feeds.attached(Attached(20, (1, 2), GID, 0, "/n", {}))
    feeds.attached(Attached(21, (1,), GID, 0, "/n", {}))
    feeds.attached(Attached(22, (1,), GID, 0, "/n", {}))
    feeds.detached(Detached(21, (1,), DetachReason.SUSPENDED))
    feeds.detached(Detached(22, (1,), DetachReason.GONE))
    assert feeds._heard_by[1] == {20, 21}
    untouched = {publisher: feeds._inflows[publisher] for publisher in range(10)}
    feeds.remove_reader(1)
    assert all(feeds._inflows[publisher] is of_publisher for publisher, of_publisher in untouched.items())
    assert feeds._silent == {}
    diary.clear()
    feeds.run_received(run(20))
    assert diary == ["b Run 20"]
    feeds.remove_reader(2)
    feeds.remove_reader(3)
    assert not feeds._inflows
    assert not feeds._heard_by


def test_a_lost_session_detaches_all() -> None:
    """After `clear` every reader has been told, and old publisher ids mean nothing."""
    feeds, _, diary = feeds_of(2)
    feeds.attached(Attached(7, (1,), GID, 0, "/n", {}))
    feeds.attached(Attached(8, (2,), GID, 0, "/n", {}))
    diary.clear()
    feeds.clear()
    feeds.run_received(run(7))
    assert diary == ["a - 7", "b - 8"]
    assert feeds._heard_by == {}


def test_a_silent_publisher_is_forgotten_when_it_is_back_or_gone() -> None:
    """A suspension is told apart from an end, and its own end is told, however it ends."""
    feeds, _, diary = feeds_of(1)
    feeds.attached(Attached(7, (1,), GID, 0, "/n", {}))
    feeds.attached(Attached(8, (1,), GID, 0, "/n", {}))
    for publisher in (7, 8):
        feeds.detached(Detached(publisher, (1,), DetachReason.SUSPENDED))
    feeds.attached(Attached(7, (1,), GID, 0, "/n", {}))
    feeds.detached(Detached(8, (1,), DetachReason.GONE))
    feeds.detached(Detached(7, (1,), DetachReason.SUSPENDED))
    feeds.clear()
    feeds.clear()
    assert diary == [
        "a + 7",
        "a + 8",
        "a ~ 7",
        "a ~ 8",
        "a forgets 7",
        "a + 7",
        "a forgets 8",
        "a ~ 7",
        "a forgets 7",
    ]


def test_an_assertion_goes_to_all_who_are_attached() -> None:
    """A publisher's sign of life reaches its readers, and nobody else."""
    feeds, _, diary = feeds_of(2)
    feeds.attached(Attached(7, (2,), GID, 0, "/n", {}))
    feeds.asserted(Assert(7))
    feeds.asserted(Assert(8))
    assert diary == ["b + 7", "b ! 7"]


def test_nobody_is_remembered_for_a_subscription_that_has_gone() -> None:
    """Publishers that only it heard are forgotten at once, those that somebody else hears stay."""
    feeds, _, diary = feeds_of(2)
    feeds.attached(Attached(7, (1,), GID, 0, "/n", {}))
    feeds.attached(Attached(8, (1, 2), GID, 0, "/n", {}))
    feeds.remove_reader(1)
    assert len(feeds) == 1
    feeds.attached(Attached(9, (1,), GID, 0, "/n", {}))  # it has crossed the UNDECLARE
    assert len(feeds) == 1
    diary.clear()
    feeds.run_received(run(8))
    assert diary == ["b Run 8"]

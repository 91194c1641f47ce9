"""What of each publisher's messages has come: nothing twice, no gap uncounted."""

from __future__ import annotations

from typing import Any

from actors.endpoints.subscription import sequence_tracker as tracker_module
from actors.endpoints.subscription.sequence_tracker import SequenceTracker
from actors.session.attachments import Attachment
from proto.wire.frames import Attached, Batch, Replay


class FakeLostEvent:
    """Stands in for the event."""

    def __init__(self) -> None:
        self.lost = 0

    def add(self, *changes: int) -> None:
        self.lost += sum(changes)


def tracker_and_event(*, latched: bool = True) -> tuple[SequenceTracker, FakeLostEvent]:
    event: Any = FakeLostEvent()
    return SequenceTracker(event, latched=latched), event


def attachment(first: int, gid: bytes = b"g") -> Attachment:
    reader: Any = None
    return Attachment(reader, Attached(1, (1,), gid, first, "/n", {}))


def batch(first: int, length: int) -> Batch:
    return Batch(1, first, 0, length, None, None, b"", b"")


def replay(first: int, length: int) -> Replay:
    return Replay(1, 1, first, 0, length, None, None, b"")


def test_a_gap_is_lost_and_what_was_seen_is_skipped() -> None:
    """A jump upwards is counted and told; of a run that goes back only what is new counts."""
    tracker, event = tracker_and_event()
    flow = attachment(5)
    tracker.attached(flow)
    assert tracker.live(flow, batch(5, 3)) == 0
    assert tracker.live(flow, batch(10, 2)) == 0
    assert tracker.live(flow, batch(9, 5)) == 3
    assert (tracker.lost, event.lost, flow.expected) == (2, 2, 14)


def test_a_publisher_that_comes_back_goes_on_where_it_was() -> None:
    """What it said meanwhile was lost on the break, told when it is sure, and nothing comes twice."""
    tracker, event = tracker_and_event()
    first = attachment(0)
    tracker.attached(first)
    tracker.live(first, batch(0, 10))
    assert tracker.detached(first)
    again = attachment(15)
    tracker.attached(again)
    assert not first.current
    assert (tracker.lost_on_break, event.lost) == (5, 0)
    assert tracker.live(again, batch(15, 1)) == 0
    assert (tracker.lost_on_break, event.lost) == (5, 5)
    early = attachment(3)
    tracker.attached(early)
    assert tracker.live(early, batch(14, 4)) == 2


def test_latched_messages_make_a_break_good() -> None:
    """What comes as latched is not lost; the rest is, when live messages follow."""
    tracker, event = tracker_and_event()
    first = attachment(0)
    tracker.attached(first)
    tracker.live(first, batch(0, 10))
    tracker.detached(first)
    again = attachment(20)
    tracker.attached(again)
    assert tracker.lost_on_break == 10
    assert tracker.latched(again, replay(8, 7)) == 2
    assert (tracker.lost_on_break, event.lost) == (5, 0)
    assert tracker.latched(again, replay(10, 5)) == 5
    tracker.live(again, batch(20, 1))
    assert (tracker.lost_on_break, event.lost) == (5, 5)


def test_publishers_that_are_gone_are_forgotten_in_the_end() -> None:
    """So many are remembered, the latest; those that are there always are."""
    tracker, _ = tracker_and_event()
    for number in range(tracker_module.REMEMBERED_PUBLISHERS + 10):
        flow = attachment(0, number.to_bytes(4, "big"))
        tracker.attached(flow)
        tracker.detached(flow)
    assert len(tracker.known) == tracker_module.REMEMBERED_PUBLISHERS
    assert (9).to_bytes(4, "big") not in tracker.known
    assert (10).to_bytes(4, "big") in tracker.known
    assert not tracker.attachments


def test_latched_messages_that_a_break_held_up_come_after_it() -> None:
    """A link that breaks between the attachment and the replay costs nothing: nobody has seen these."""
    tracker, event = tracker_and_event()
    first = attachment(5)
    tracker.attached(first)
    tracker.detached(first)
    again = attachment(7)
    tracker.attached(again)
    assert tracker.lost_on_break == 2
    assert tracker.latched(again, replay(2, 4)) == 0
    assert tracker.latched(again, replay(6, 1)) == 0
    assert (tracker.lost_on_break, event.lost, again.received) == (0, 0, 7)
    assert tracker.live(again, batch(7, 1)) == 0


def test_what_a_new_broker_gets_again_is_new_to_those_who_never_had_it() -> None:
    """Latched messages that come as live ones count for a reader that wants them, and not for another."""
    for latched, skipped in ((True, 0), (False, 5)):
        tracker, _ = tracker_and_event(latched=latched)
        first = attachment(5)
        tracker.attached(first)
        tracker.detached(first)
        again = attachment(0)
        tracker.attached(again)
        assert tracker.live(again, batch(0, 5)) == skipped
        assert (again.due, again.expected) == (skipped, 5)


def test_a_message_is_received_or_lost_never_both() -> None:
    """What a break has cost, and latched messages make good two attachments later, is not lost any more."""
    tracker, event = tracker_and_event()
    first, second, third = attachment(0), attachment(10), attachment(12)
    tracker.attached(first)
    tracker.live(first, batch(0, 5))
    tracker.detached(first)
    tracker.attached(second)
    tracker.detached(second)
    tracker.attached(third)
    assert (tracker.lost_on_break, event.lost) == (7, 0)
    assert tracker.latched(third, replay(7, 4)) == 0
    assert (tracker.lost_on_break, event.lost) == (3, 2)
    assert tracker.live(third, batch(12, 1)) == 0
    assert (tracker.lost_on_break, event.lost) == (3, 3)


def test_a_new_broker_takes_back_what_a_break_has_cost() -> None:
    """If the publisher sends its latched messages again as live ones, they were not lost."""
    tracker, event = tracker_and_event()
    first, second, third = attachment(0), attachment(10), attachment(3)
    tracker.attached(first)
    tracker.live(first, batch(0, 5))
    tracker.detached(first)
    tracker.attached(second)
    assert tracker.lost_on_break == 5
    tracker.detached(second)
    tracker.attached(third)
    assert tracker.lost_on_break == 0
    assert tracker.live(third, batch(3, 9)) == 2
    assert (tracker.lost, tracker.lost_on_break, event.lost) == (0, 0, 0)


def test_a_volatile_subscription_is_not_made_good() -> None:
    """Nothing can bring it what it has missed, so that is reported at once when the publisher goes again."""
    tracker, event = tracker_and_event(latched=False)
    first, second = attachment(0), attachment(10)
    tracker.attached(first)
    tracker.live(first, batch(0, 5))
    tracker.detached(first)
    tracker.attached(second)
    tracker.detached(second)
    assert (tracker.lost_on_break, event.lost) == (5, 5)
    third = attachment(3)
    tracker.attached(third)
    assert tracker.live(third, batch(3, 9)) == 7
    assert tracker.lost_on_break == 5

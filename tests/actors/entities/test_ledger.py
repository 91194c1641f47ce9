"""What of each publisher's messages has come: nothing twice, no gap uncounted."""

from __future__ import annotations

from typing import Any

from actors.entities import ledger as ledger_module
from actors.entities.ledger import Ledger
from actors.feeds import Inflow
from proto.frames import Attached, Replay, Run


class Told:
    """Stands in for the event."""

    def __init__(self) -> None:
        self.lost = 0

    def add(self, *changes: int) -> None:
        self.lost += sum(changes)


def ledger_and_event(*, latched: bool = True) -> tuple[Ledger, Told]:
    event: Any = Told()
    return Ledger(event, latched=latched), event


def inflow(first: int, gid: bytes = b"g") -> Inflow:
    reader: Any = None
    return Inflow(reader, Attached(1, (1,), gid, first, "/n", {}))


def run(first: int, length: int) -> Run:
    return Run(1, first, 0, length, None, None, b"", b"")


def replay(first: int, length: int) -> Replay:
    return Replay(1, 1, first, 0, length, None, None, b"")


def test_a_gap_is_lost_and_what_was_seen_is_skipped() -> None:
    """A jump upwards is counted and told; of a run that goes back only what is new counts."""
    ledger, event = ledger_and_event()
    flow = inflow(5)
    ledger.attached(flow)
    assert ledger.live(flow, run(5, 3)) == 0
    assert ledger.live(flow, run(10, 2)) == 0
    assert ledger.live(flow, run(9, 5)) == 3
    assert (ledger.lost, event.lost, flow.expected) == (2, 2, 14)


def test_a_publisher_that_comes_back_goes_on_where_it_was() -> None:
    """What it said meanwhile was lost on the break, told when it is sure, and nothing comes twice."""
    ledger, event = ledger_and_event()
    first = inflow(0)
    ledger.attached(first)
    ledger.live(first, run(0, 10))
    assert ledger.detached(first)
    again = inflow(15)
    ledger.attached(again)
    assert not ledger.counts(first)
    assert (ledger.lost_on_break, event.lost) == (5, 0)
    assert ledger.live(again, run(15, 1)) == 0
    assert (ledger.lost_on_break, event.lost) == (5, 5)
    early = inflow(3)
    ledger.attached(early)
    assert ledger.live(early, run(14, 4)) == 2


def test_latched_messages_make_a_break_good() -> None:
    """What comes as latched is not lost; the rest is, when live messages follow."""
    ledger, event = ledger_and_event()
    first = inflow(0)
    ledger.attached(first)
    ledger.live(first, run(0, 10))
    ledger.detached(first)
    again = inflow(20)
    ledger.attached(again)
    assert ledger.lost_on_break == 10
    assert ledger.latched(again, replay(8, 7)) == 2
    assert (ledger.lost_on_break, event.lost) == (5, 0)
    assert ledger.latched(again, replay(10, 5)) == 5
    ledger.live(again, run(20, 1))
    assert (ledger.lost_on_break, event.lost) == (5, 5)


def test_publishers_that_are_gone_are_forgotten_in_the_end() -> None:
    """So many are remembered, the latest; those that are there always are."""
    ledger, _ = ledger_and_event()
    for number in range(ledger_module.REMEMBERED_PUBLISHERS + 10):
        flow = inflow(0, number.to_bytes(4, "big"))
        ledger.attached(flow)
        ledger.detached(flow)
    assert len(ledger.known) == ledger_module.REMEMBERED_PUBLISHERS
    assert (9).to_bytes(4, "big") not in ledger.known
    assert (10).to_bytes(4, "big") in ledger.known
    assert not ledger.inflows


def test_latched_messages_that_a_break_held_up_come_after_it() -> None:
    """A link that breaks between the attachment and the replay costs nothing: nobody has seen these."""
    ledger, event = ledger_and_event()
    first = inflow(5)
    ledger.attached(first)
    ledger.detached(first)
    again = inflow(7)
    ledger.attached(again)
    assert ledger.lost_on_break == 2
    assert ledger.latched(again, replay(2, 4)) == 0
    assert ledger.latched(again, replay(6, 1)) == 0
    assert (ledger.lost_on_break, event.lost, again.received) == (0, 0, 7)
    assert ledger.live(again, run(7, 1)) == 0


def test_what_a_new_broker_gets_again_is_new_to_those_who_never_had_it() -> None:
    """Latched messages that come as live ones count for a reader that wants them, and not for another."""
    for latched, skipped in ((True, 0), (False, 5)):
        ledger, _ = ledger_and_event(latched=latched)
        first = inflow(5)
        ledger.attached(first)
        ledger.detached(first)
        again = inflow(0)
        ledger.attached(again)
        assert ledger.live(again, run(0, 5)) == skipped
        assert (again.due, again.expected) == (skipped, 5)


def test_a_message_is_received_or_lost_never_both() -> None:
    """What a break has cost, and latched messages make good two attachments later, is not lost any more."""
    ledger, event = ledger_and_event()
    first, second, third = inflow(0), inflow(10), inflow(12)
    ledger.attached(first)
    ledger.live(first, run(0, 5))
    ledger.detached(first)
    ledger.attached(second)
    ledger.detached(second)
    ledger.attached(third)
    assert (ledger.lost_on_break, event.lost) == (7, 0)
    assert ledger.latched(third, replay(7, 4)) == 0
    assert (ledger.lost_on_break, event.lost) == (3, 2)
    assert ledger.live(third, run(12, 1)) == 0
    assert (ledger.lost_on_break, event.lost) == (3, 3)


def test_a_new_broker_takes_back_what_a_break_has_cost() -> None:
    """If the publisher sends its latched messages again as live ones, they were not lost."""
    ledger, event = ledger_and_event()
    first, second, third = inflow(0), inflow(10), inflow(3)
    ledger.attached(first)
    ledger.live(first, run(0, 5))
    ledger.detached(first)
    ledger.attached(second)
    assert ledger.lost_on_break == 5
    ledger.detached(second)
    ledger.attached(third)
    assert ledger.lost_on_break == 0
    assert ledger.live(third, run(3, 9)) == 2
    assert (ledger.lost, ledger.lost_on_break, event.lost) == (0, 0, 0)


def test_a_volatile_subscription_is_not_made_good() -> None:
    """Nothing can bring it what it has missed, so that is told at once when the publisher goes again."""
    ledger, event = ledger_and_event(latched=False)
    first, second = inflow(0), inflow(10)
    ledger.attached(first)
    ledger.live(first, run(0, 5))
    ledger.detached(first)
    ledger.attached(second)
    ledger.detached(second)
    assert (ledger.lost_on_break, event.lost) == (5, 5)
    third = inflow(3)
    ledger.attached(third)
    assert ledger.live(third, run(3, 9)) == 7
    assert ledger.lost_on_break == 5

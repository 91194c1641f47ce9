"""What of each publisher's messages has come to one subscription: nothing twice, and no gap uncounted.

Numbers are the publisher's. They go on over reconnects, so a publisher that comes back is held to what was
seen of it, and what is missing then was lost on the break. Latched messages may still make that good until
the first live run comes.
"""

from __future__ import annotations

from collections import OrderedDict
from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from actors.events import Event
    from actors.feeds import Inflow
    from proto.frames import Replay, Run

REMEMBERED_PUBLISHERS: Final = 1024
"""Publishers whose last sequence number is remembered after they have gone, against duplicates."""


class Known(NamedTuple):
    """What is remembered of a publisher that is not attached."""

    covered: int
    """The number after the last one that has come or is counted where it was lost."""
    received: int
    """The number after the last one that has come: latched ones between the two may still come ..."""
    given_up: bool
    """... unless they have been counted as lost."""


class Ledger:
    """One subscription's.

    Args:
        message_lost: Told of messages that will not come.
        latched: Whether the subscription wants messages from before it was there.

    Attributes:
        inflows: By publisher, the inflow that counts: one that has come back may overlap with itself.
        known: By publisher, where it stopped when it was last detached.
        lost: Messages that never came over an unbroken link.
        lost_on_break: Messages that never came because a link broke.
    """

    __slots__ = ("_message_lost", "_wants_latched", "inflows", "known", "lost", "lost_on_break")

    def __init__(self, message_lost: Event, *, latched: bool) -> None:
        self.inflows: dict[bytes, Inflow] = {}
        self.known: OrderedDict[bytes, Known] = OrderedDict()
        self.lost = self.lost_on_break = 0
        self._message_lost = message_lost
        self._wants_latched = latched

    def counts(self, inflow: Inflow) -> bool:
        """Tell whether this is its publisher's inflow now; another is a leftover, counted as lost."""
        return self.inflows.get(inflow.gid) is inflow

    def attached(self, inflow: Inflow) -> None:
        """A publisher's runs will come. A known one goes on where it stopped."""
        before = self.inflows.get(inflow.gid)
        if before is not None:
            self._remember(before, given_up=before.missed > 0)
        self.inflows[inflow.gid] = inflow
        known = self.known.get(inflow.gid)
        if known is not None:
            inflow.missed = max(0, inflow.first_sequence - known.covered)
            self.lost_on_break += inflow.missed
            # What a broker that has restarted gets again comes as live: latched messages, too.
            seen = known.covered if known.given_up or not self._wants_latched else known.received
            inflow.expected = max(seen, inflow.first_sequence)
            inflow.received = known.received

    def detached(self, inflow: Inflow) -> bool:
        """No more runs of this publisher will come; return whether its inflow counted."""
        given_up = inflow.missed > 0
        self._give_up_missed(inflow)
        if not self.counts(inflow):
            return False
        del self.inflows[inflow.gid]
        self._remember(inflow, given_up=given_up)
        return True

    def _remember(self, inflow: Inflow, *, given_up: bool) -> None:
        self.known[inflow.gid] = Known(inflow.expected, inflow.received, given_up)
        self.known.move_to_end(inflow.gid)
        while len(self.known) > max(REMEMBERED_PUBLISHERS, len(self.inflows)):
            self.known.popitem(last=False)

    def live(self, inflow: Inflow, run: Run) -> int:
        """A live run has come; return how many of its messages have been seen."""
        if inflow.missed:
            self._give_up_missed(inflow)
        gap = run.first_sequence - inflow.expected
        if gap > 0:
            self.lost += gap
            self._message_lost.add(gap)
        inflow.expected = inflow.received = max(inflow.expected, run.first_sequence + run.length)
        return max(0, -gap)

    def latched(self, inflow: Inflow, replay: Replay) -> int:
        """Latched messages have come; return how many of them have been seen."""
        end = replay.first_sequence + replay.length
        first_new = max(inflow.received, replay.first_sequence)
        first_missed = inflow.first_sequence - inflow.missed
        found = max(0, min(end, inflow.first_sequence) - max(first_new, first_missed))
        inflow.missed -= found
        self.lost_on_break -= found
        inflow.received = max(inflow.received, end)
        return first_new - replay.first_sequence

    def _give_up_missed(self, inflow: Inflow) -> None:
        """What latched messages could still have made good is lost: live ones follow, or nothing."""
        self._message_lost.add(inflow.missed)
        inflow.missed = 0

"""What of each publisher's messages has come to one subscription: nothing twice, and no gap uncounted.

Numbers are the publisher's, and go on over reconnects. A publisher that comes back is held to what has come
of it: what is missing until its runs begin anew was lost on the break. For a subscription that wants latched
messages that is open until the first live run comes: they may make it good, now or at the next attachment.
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

    received: int
    """The number after the last message that has come, or that can come no more."""
    due: int
    """The number of the first message that was for this subscription."""
    missed: int
    """Messages counted as lost that may still come."""


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

    def attached(self, inflow: Inflow) -> bool:
        """A publisher's runs will come. A known one goes on where it stopped.

        Returns:
            Whether an earlier inflow of the publisher counted until now.
        """
        before = self.inflows.get(inflow.gid)
        if before is not None:
            self._remember(before)
        self.inflows[inflow.gid] = inflow
        known = self.known.get(inflow.gid)
        if known is not None:
            inflow.received = known.received
            inflow.expected = max(known.received, inflow.first_sequence)
            # From a new broker latched messages come as live ones: they are for it, too.
            inflow.due = min(known.due, inflow.expected)
            inflow.missed = max(0, inflow.first_sequence - max(known.received, known.due))
            self.lost_on_break += inflow.missed - known.missed
        return before is not None

    def detached(self, inflow: Inflow) -> bool:
        """No more runs of this publisher will come; return whether its inflow counted."""
        if not self.counts(inflow):
            return False
        del self.inflows[inflow.gid]
        self._remember(inflow)
        return True

    def _remember(self, inflow: Inflow) -> None:
        if self._wants_latched:
            known = Known(inflow.received, inflow.due, inflow.missed)
        else:
            self._give_up_missed(inflow, inflow.missed)
            known = Known(inflow.expected, inflow.due, 0)
        self.known[inflow.gid] = known
        self.known.move_to_end(inflow.gid)
        while len(self.known) > max(REMEMBERED_PUBLISHERS, len(self.inflows)):
            self.known.popitem(last=False)

    def live(self, inflow: Inflow, run: Run) -> int:
        """A live run has come; return how many of its messages have been seen."""
        if inflow.missed:
            self._give_up_missed(inflow, inflow.missed)
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
        # The oldest come first: what was missed before them will not come.
        older = max(0, min(first_new, inflow.first_sequence) - max(inflow.received, inflow.due))
        self._give_up_missed(inflow, older)
        found = max(0, min(end, inflow.first_sequence) - max(first_new, inflow.due))
        inflow.missed -= found
        self.lost_on_break -= found
        inflow.received = max(inflow.received, end)
        return first_new - replay.first_sequence

    def _give_up_missed(self, inflow: Inflow, count: int) -> None:
        """So many of those that latched messages could have made good are lost."""
        self._message_lost.add(count)
        inflow.missed -= count

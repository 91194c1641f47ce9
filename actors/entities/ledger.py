"""What of each publisher's messages has come to one subscription: nothing twice, and no gap uncounted.

Numbers are the publisher's. They go on over reconnects, so a publisher that comes back is held to what was
seen of it, and what is missing then was lost on the break. Latched messages may still make that good until
the first live run comes.
"""

from __future__ import annotations

from collections import OrderedDict
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from actors.events import Event
    from actors.feeds import Inflow
    from proto.frames import Replay, Run

REMEMBERED_PUBLISHERS: Final = 1024
"""Publishers whose last sequence number is remembered after they have gone, against duplicates."""


class Ledger:
    """One subscription's.

    Args:
        message_lost: Told of messages that will not come.

    Attributes:
        inflows: By publisher, the inflow that counts: one that has come back may overlap with itself.
        seen: By publisher, the number that was next when it was last detached, or when latched messages came.
        lost: Messages that never came over an unbroken link.
        lost_on_break: Messages that never came because a link broke.
    """

    __slots__ = ("_message_lost", "inflows", "lost", "lost_on_break", "seen")

    def __init__(self, message_lost: Event) -> None:
        self.inflows: dict[bytes, Inflow] = {}
        self.seen: OrderedDict[bytes, int] = OrderedDict()
        self.lost = self.lost_on_break = 0
        self._message_lost = message_lost

    def counts(self, inflow: Inflow) -> bool:
        """Tell whether this is its publisher's inflow now; another is a leftover, counted as lost."""
        return self.inflows.get(inflow.gid) is inflow

    def attached(self, inflow: Inflow) -> None:
        """A publisher's runs will come. A known one goes on where it stopped."""
        before = self.inflows.get(inflow.gid)
        if before is not None:
            self._remember(before)
        self.inflows[inflow.gid] = inflow
        seen = self.seen.get(inflow.gid)
        if seen is not None:
            inflow.missed = max(0, inflow.first_sequence - seen)
            self.lost_on_break += inflow.missed
            inflow.expected = max(seen, inflow.first_sequence)

    def detached(self, inflow: Inflow) -> bool:
        """No more runs of this publisher will come; return whether its inflow counted."""
        self._give_up_missed(inflow)
        if not self.counts(inflow):
            return False
        del self.inflows[inflow.gid]
        self._remember(inflow)
        return True

    def _remember(self, inflow: Inflow) -> None:
        self.seen[inflow.gid] = inflow.expected
        self.seen.move_to_end(inflow.gid)
        while len(self.seen) > max(REMEMBERED_PUBLISHERS, len(self.inflows)):
            self.seen.popitem(last=False)

    def live(self, inflow: Inflow, run: Run) -> int:
        """A live run has come; return how many of its messages have been seen."""
        if inflow.missed:
            self._give_up_missed(inflow)
        gap = run.first_sequence - inflow.expected
        if gap > 0:
            self.lost += gap
            self._message_lost.add(gap)
        inflow.expected = max(inflow.expected, run.first_sequence + run.length)
        return max(0, -gap)

    def latched(self, inflow: Inflow, replay: Replay) -> int:
        """Latched messages have come; return how many of them have been seen."""
        seen = self.seen.get(inflow.gid, 0)
        start = max(0, seen - replay.first_sequence)
        found = min(inflow.missed, max(0, replay.length - start))
        inflow.missed -= found
        self.lost_on_break -= found
        self.seen[inflow.gid] = max(seen, replay.first_sequence + replay.length)
        return start

    def _give_up_missed(self, inflow: Inflow) -> None:
        """What latched messages could still have made good is lost: live ones follow, or nothing."""
        self._message_lost.add(inflow.missed)
        inflow.missed = 0

"""Grants: when a KEEP_ALL subscription gives its publishers credit.

A publisher begins with none. It gets a window when it is attached, and more as the reader takes what came.
While messages of publishers that are not attached any more wait, nobody gets any: they may fill the whole
window by themselves. So however many publishers come and go, what waits is what was granted before the first
of those that wait left.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.entities.window import Windows

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.entities.backlog import Batch
    from actors.entities.ledger import Ledger
    from actors.feeds import Inflow

DECLARED: Final = (0, 0)
"""What SUBSCRIPTION says: messages and bytes that a publisher may send from its attachment on.

It would hold for every later publisher, also while leftovers wait. So a first message costs a way to the
subscription and back."""


class Grants:
    """One subscription's.

    Args:
        ledger: Knows the inflows that count.
        send: Sends a GRANT of what an inflow says.
    """

    __slots__ = ("_ledger", "_leftover", "_send", "_windows")

    def __init__(self, ledger: Ledger, send: Callable[[Inflow], None]) -> None:
        self._ledger = ledger
        self._send = send
        self._windows = Windows()
        self._leftover: Batch | None = None
        """The newest of what had come when a publisher was detached, while some of that waits."""

    @property
    def limit(self) -> int:
        """The most messages that the publishers that are attached may have waiting."""
        return self._windows.messages * max(1, len(self._ledger.inflows))

    def attached(self, inflow: Inflow) -> None:
        """A publisher is there."""
        self._windows.attached(inflow)
        self._windows.divide(len(self._ledger.inflows))
        self._open(inflow)

    def detached(self, newest: Batch | None) -> None:
        """A publisher is not there any more; `newest` has come last of what waits."""
        self._windows.divide(len(self._ledger.inflows))
        self._leftover = newest

    def finished(self, batch: Batch) -> None:
        """The reader has taken a batch."""
        was_last = batch is self._leftover
        if was_last:
            self._leftover = None
        self.taken(batch.inflow, batch.end, batch.size)
        if was_last:
            for inflow in self._ledger.inflows.values():
                self._open(inflow)

    def taken(self, inflow: Inflow, end: int, size: int) -> None:
        """A whole run is off our hands: give its publisher new credit when half of the old is used up."""
        # To grant after the session's end would be to grant to another publisher.
        if self._ledger.counts(inflow) and self._windows.taken(inflow, end, size):
            self._open(inflow)

    def _open(self, inflow: Inflow) -> None:
        """Let a publisher have a whole window, unless leftovers wait."""
        if self._leftover is None and self._windows.open(inflow):
            self._send(inflow)

"""Grants: when a KEEP_ALL subscription gives its publishers credit.

A publisher gets some when it is attached, and more as the reader takes what has come. While messages of
publishers that are not attached any more wait, nobody gets any: they may fill the whole window by themselves.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.entities.window import Windows

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.entities.backlog import Batch
    from actors.entities.ledger import Ledger
    from actors.feeds import Inflow


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
        """The newest of what publishers have sent that are not attached any more, while some of it waits."""

    @property
    def limit(self) -> int:
        """The most messages that may come before the reader has taken any."""
        return self._windows.messages * max(1, len(self._ledger.inflows))

    def declare(self) -> tuple[int, int]:
        """Return what SUBSCRIPTION says: messages and bytes that a publisher may send from the start."""
        return self._windows.declare(crowded=self._leftover is not None)

    def attached(self, inflow: Inflow) -> None:
        """A publisher is there."""
        self._windows.attached(inflow)
        self._windows.divide(len(self._ledger.inflows))
        if self._leftover is None and self._windows.open(inflow):
            self._send(inflow)

    def detached(self, newest: Batch | None) -> None:
        """A publisher is not there any more; `newest` has come last of what waits."""
        self._windows.divide(len(self._ledger.inflows))
        self._leftover = newest

    def finished(self, batch: Batch) -> None:
        """The reader has taken a batch."""
        self.taken(batch.inflow, batch.end, batch.size)
        if batch is self._leftover:
            self._leftover = None
            for inflow in self._ledger.inflows.values():
                if self._windows.open(inflow):
                    self._send(inflow)

    def taken(self, inflow: Inflow, end: int, size: int) -> None:
        """A whole run is off our hands: give its publisher new credit when half of the old is used up."""
        # To grant after the session's end would be to grant to another publisher.
        if self._ledger.counts(inflow) and self._windows.taken(inflow, end, size):
            self._send(inflow)

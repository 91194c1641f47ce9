"""Grants: when a KEEP_ALL subscription gives its publishers credit.

A publisher begins with none. It gets a window when it is attached, and more as the reader takes what came.
While messages of publishers that are not attached any more wait, nobody gets any: they may fill the whole
window by themselves. So however many publishers come and go, what waits is what was granted before the first
of those that wait left.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.endpoints.flow_control.window import CreditWindows

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.endpoints.subscription.backlog import QueuedBatch
    from actors.endpoints.subscription.sequence_tracker import SequenceTracker
    from actors.session.attachments import Attachment

DECLARED: Final = (0, 0)
"""What SUBSCRIPTION says: messages and bytes that a publisher may send from its attachment on.

It would hold for every later publisher, also while leftovers wait. So a first message costs a way to the
subscription and back."""


class CreditGrants:
    """One subscription's.

    Args:
        tracker: Knows the inflows that count.
        send: Sends a GRANT of what an inflow says.
    """

    __slots__ = ("_leftover", "_send", "_tracker", "_windows")

    def __init__(self, tracker: SequenceTracker, send: Callable[[Attachment], None]) -> None:
        self._tracker = tracker
        self._send = send
        self._windows = CreditWindows()
        self._leftover: QueuedBatch | None = None
        """The newest of what had come when a publisher was detached, while some of that waits."""

    @property
    def limit(self) -> int:
        """The most messages that the publishers that are attached may have waiting."""
        return self._windows.messages * max(1, len(self._tracker.attachments))

    def attached(self, attachment: Attachment) -> None:
        """A publisher is there."""
        self._windows.attached(attachment)
        self._windows.divide(len(self._tracker.attachments))
        self._open(attachment)

    def detached(self, newest: QueuedBatch | None) -> None:
        """A publisher is not there any more; `newest` has come last of what waits."""
        self._windows.divide(len(self._tracker.attachments))
        self._leftover = newest

    def finished(self, queued_batch: QueuedBatch) -> None:
        """The reader has taken a batch."""
        was_last = queued_batch is self._leftover
        if was_last:
            self._leftover = None
        self.taken(queued_batch.attachment, queued_batch.end, queued_batch.size)
        if was_last:
            for attachment in self._tracker.attachments.values():
                self._open(attachment)

    def taken(self, attachment: Attachment, end: int, size: int) -> None:
        """A whole run is off our hands: give its publisher new credit when half of the old is used up."""
        # To grant after the session's end would be to grant to another publisher.
        if attachment.counts and self._windows.taken(attachment, end, size):
            self._open(attachment)

    def _open(self, attachment: Attachment) -> None:
        """Let a publisher have a whole window, unless leftovers wait."""
        if self._leftover is None and self._windows.open(attachment):
            self._send(attachment)

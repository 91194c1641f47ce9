"""When a KEEP_ALL subscription grants credit to its publishers, and how much.

A publisher begins without credit. It is granted a window when it is attached, and more as the consumer takes
messages. A window is how much one publisher may send before the consumer has taken it. Everything granted may
wait on the subscription's link at once, so the window of each publisher is smaller if there are many.

While messages of detached publishers wait, no credit is granted: they may fill the whole window by
themselves. This bounds the messages that wait, however many publishers are attached one after the other.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from proto.limits import MAX_U64

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.endpoints.subscription.backlog import QueuedBatch
    from actors.endpoints.subscription.sequence_tracker import SequenceTracker
    from actors.session.attachments import Attachment

DECLARED: Final = (0, 0)
"""The SUBSCRIPTION frame's credit: messages and bytes that a publisher may send from its attachment on.

It would hold for every later publisher, also while messages of detached ones wait. Without it the first
message needs a round trip to the subscription."""

LEAST_MESSAGES: Final = 256
LEAST_BYTES: Final = 64 * 1024
"""The smallest window of a publisher."""

WINDOW_MESSAGES: Final = 32_768
WINDOW_BYTES: Final = 8 * 1024 * 1024
"""The window of one among few publishers."""

SHARED_MESSAGES: Final = 65_536
SHARED_BYTES: Final = 32 * 1024 * 1024
"""The windows of many publishers together, unless the smallest windows add up to more."""


class CreditWindows:
    """The windows of one subscription.

    Attributes:
        messages, bytes: The window of each publisher, as of its next grant.
    """

    __slots__ = ("bytes", "messages")

    def __init__(self) -> None:
        self.messages = WINDOW_MESSAGES
        self.bytes = WINDOW_BYTES

    def divide(self, publishers: int) -> None:
        """Set the windows for a number of publishers."""
        share = max(1, publishers)
        self.messages = min(WINDOW_MESSAGES, max(LEAST_MESSAGES, SHARED_MESSAGES // share))
        self.bytes = min(WINDOW_BYTES, max(LEAST_BYTES, SHARED_BYTES // share))

    def attached(self, attachment: Attachment) -> None:
        """Begin without credit, behind what earlier attachments of the publisher have received."""
        # A publisher that comes back may begin with numbers that have arrived, such as latched messages, and
        # the broker need not send them again: a window from there might never grant the first new message.
        attachment.taken_sequence = attachment.granted_sequence = attachment.expected
        attachment.granted_bytes = 0

    def open(self, attachment: Attachment) -> bool:
        """Grant a whole window; return whether that is new credit, for a GRANT."""
        before = attachment.granted_sequence, attachment.granted_bytes
        # A publisher of another implementation may number its messages up to the greatest number.
        limit = min(attachment.taken_sequence + self.messages, MAX_U64)
        attachment.granted_sequence = max(attachment.granted_sequence, limit)
        attachment.granted_bytes = max(attachment.granted_bytes, attachment.taken_bytes + self.bytes)
        return (attachment.granted_sequence, attachment.granted_bytes) != before

    def consumed(self, attachment: Attachment, end: int, size: int) -> bool:
        """Note messages consumed below `end`, of `size` bytes; return whether half the window is used up."""
        attachment.taken_bytes += size
        if end > attachment.taken_sequence:  # noqa: PLR1730 - max() takes longer, and this is the hot path
            attachment.taken_sequence = end
        return (
            attachment.granted_sequence - end < self.messages // 2
            or attachment.granted_bytes - attachment.taken_bytes < self.bytes // 2
        )


class SubscriptionCredit:
    """The credit of one subscription.

    Args:
        tracker: Has the current attachments.
        send: Sends a GRANT of an attachment's credit.
    """

    __slots__ = ("_last_detached", "_send", "_stalled", "_taken", "_tracker", "_windows")

    def __init__(self, tracker: SequenceTracker, send: Callable[[Attachment], None]) -> None:
        self._tracker = tracker
        self._send = send
        self._windows = CreditWindows()
        self._last_detached: QueuedBatch | None = None
        """The newest batch at the moment when a publisher was detached, while it waits."""

        self._stalled: list[Attachment] = []
        """The attachments whose credit the broker has suspended."""
        self._taken = 0

    @property
    def limit(self) -> int:
        """How many messages of the attached publishers may wait."""
        return self._windows.messages * max(1, len(self._tracker.attachments))

    def attached(self, attachment: Attachment) -> None:
        """Grant a new publisher its first window."""
        self._windows.attached(attachment)
        self._windows.divide(len(self._tracker.attachments))
        self._open(attachment)

    def stalled(self, attachments: list[Attachment], newest: QueuedBatch | None) -> None:
        """Note that the broker sends nothing on these attachments until it gets a GRANT."""
        self._stalled = attachments
        self.detached(newest)

    def report_progress(self, taken: int, pending: int) -> None:
        """Send a GRANT if messages have been taken since the last call: a slow consumer has not stalled.

        Args:
            taken: Messages taken so far.
            pending: Messages that wait.
        """
        if taken == self._taken or not (pending or self._stalled):
            return
        self._taken = taken
        waiting = self._stalled or [each for each in self._tracker.attachments.values() if each.keep_all]
        if waiting:
            self._send(waiting[0])
        self._stalled = []

    def detached(self, newest: QueuedBatch | None) -> None:
        """Grant nothing more before `newest`, the newest batch that waits, has been taken."""
        self._windows.divide(len(self._tracker.attachments))
        self._last_detached = newest

    def finished(self, queued_batch: QueuedBatch) -> None:
        """Note that the consumer has taken a batch."""
        was_last = queued_batch is self._last_detached
        if was_last:
            self._last_detached = None
        self.consumed(queued_batch.attachment, queued_batch.end, queued_batch.size)
        if was_last:
            for attachment in self._tracker.attachments.values():
                self._open(attachment)

    def consumed(self, attachment: Attachment, end: int, size: int) -> None:
        """Note that a whole batch is done: grant its publisher new credit when half of the old is used up."""
        # After the end of the session its id may be another publisher's.
        if attachment.current and self._windows.consumed(attachment, end, size):
            self._open(attachment)

    def _open(self, attachment: Attachment) -> None:
        """Grant a publisher a whole window, unless messages of detached publishers wait."""
        if self._last_detached is None and self._windows.open(attachment):
            self._send(attachment)

"""Windows: what a KEEP_ALL subscription lets its publishers send before its reader has taken it.

All that is granted may wait on the subscription's link at once. So what a publisher is granted is less, the
more there are.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from proto.limits import MAX_U64

if TYPE_CHECKING:
    from actors.session.attachments import Attachment

LEAST_MESSAGES: Final = 256
LEAST_BYTES: Final = 64 * 1024
"""The least that a publisher's window ever is."""

WINDOW_MESSAGES: Final = 32_768
WINDOW_BYTES: Final = 8 * 1024 * 1024
"""The window of one among few publishers."""

SHARED_MESSAGES: Final = 65_536
SHARED_BYTES: Final = 32 * 1024 * 1024
"""What many publishers' windows are together, apart from the least that each has."""


class CreditWindows:
    """The windows of one subscription.

    Attributes:
        messages, bytes: What each publisher's window is now, when it is granted anew.
    """

    __slots__ = ("bytes", "messages")

    def __init__(self) -> None:
        self.messages = WINDOW_MESSAGES
        self.bytes = WINDOW_BYTES

    def divide(self, publishers: int) -> None:
        """There are so many publishers now."""
        share = max(1, publishers)
        self.messages = min(WINDOW_MESSAGES, max(LEAST_MESSAGES, SHARED_MESSAGES // share))
        self.bytes = min(WINDOW_BYTES, max(LEAST_BYTES, SHARED_BYTES // share))

    def attached(self, attachment: Attachment) -> None:
        """A publisher has been attached: it has nothing yet."""
        attachment.taken_sequence = attachment.granted_sequence = attachment.first_sequence
        attachment.granted_bytes = 0

    def open(self, attachment: Attachment) -> bool:
        """Let a publisher have the whole window; tell whether to send a GRANT, which the inflow says."""
        before = attachment.granted_sequence, attachment.granted_bytes
        limit = min(attachment.taken_sequence + self.messages, MAX_U64)  # a stranger's numbers may be there
        attachment.granted_sequence = max(attachment.granted_sequence, limit)
        attachment.granted_bytes = max(attachment.granted_bytes, attachment.taken_bytes + self.bytes)
        return (attachment.granted_sequence, attachment.granted_bytes) != before

    def taken(self, attachment: Attachment, end: int, size: int) -> bool:
        """The reader has taken what is below `end`, `size` bytes; tell whether half the window is used up."""
        attachment.taken_bytes += size
        if end > attachment.taken_sequence:  # noqa: PLR1730 - max() takes longer, and this is the hot path
            attachment.taken_sequence = end
        return (
            attachment.granted_sequence - end < self.messages // 2
            or attachment.granted_bytes - attachment.taken_bytes < self.bytes // 2
        )

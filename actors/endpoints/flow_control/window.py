"""Windows: how much a KEEP_ALL subscription lets its publishers send before its consumer has taken it.

Everything granted may wait on the subscription's link at once. The more publishers there are, the smaller is
the window of each.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from proto.limits import MAX_U64

if TYPE_CHECKING:
    from actors.session.attachments import Attachment

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
        """Begin without credit."""
        attachment.taken_sequence = attachment.granted_sequence = attachment.first_sequence
        attachment.granted_bytes = 0

    def open(self, attachment: Attachment) -> bool:
        """Grant a whole window; return whether that is new credit, for a GRANT."""
        before = attachment.granted_sequence, attachment.granted_bytes
        limit = min(
            attachment.taken_sequence + self.messages, MAX_U64
        )  # the numbers of another implementation may be there
        attachment.granted_sequence = max(attachment.granted_sequence, limit)
        attachment.granted_bytes = max(attachment.granted_bytes, attachment.taken_bytes + self.bytes)
        return (attachment.granted_sequence, attachment.granted_bytes) != before

    def taken(self, attachment: Attachment, end: int, size: int) -> bool:
        """Note messages taken below `end`, of `size` bytes; return whether half the window is used up."""
        attachment.taken_bytes += size
        if end > attachment.taken_sequence:  # noqa: PLR1730 - max() takes longer, and this is the hot path
            attachment.taken_sequence = end
        return (
            attachment.granted_sequence - end < self.messages // 2
            or attachment.granted_bytes - attachment.taken_bytes < self.bytes // 2
        )

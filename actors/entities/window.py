"""Windows: what a KEEP_ALL subscription lets its publishers send before its reader has taken it.

All that is granted may wait on the subscription's link at once. So what a publisher is granted is less, the
more there are.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from proto.limits import MAX_U64

if TYPE_CHECKING:
    from actors.feeds import Inflow

LEAST_MESSAGES: Final = 256
LEAST_BYTES: Final = 64 * 1024
"""The least that a publisher's window ever is."""

WINDOW_MESSAGES: Final = 32_768
WINDOW_BYTES: Final = 8 * 1024 * 1024
"""The window of one among few publishers."""

SHARED_MESSAGES: Final = 65_536
SHARED_BYTES: Final = 32 * 1024 * 1024
"""What many publishers' windows are together, apart from the least that each has."""


class Windows:
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

    def attached(self, inflow: Inflow) -> None:
        """A publisher has been attached: it has nothing yet."""
        inflow.taken_sequence = inflow.granted_sequence = inflow.first_sequence
        inflow.granted_bytes = 0

    def open(self, inflow: Inflow) -> bool:
        """Let a publisher have the whole window; tell whether to send a GRANT, which the inflow says."""
        before = inflow.granted_sequence, inflow.granted_bytes
        limit = min(inflow.taken_sequence + self.messages, MAX_U64)  # a stranger's numbers may be there
        inflow.granted_sequence = max(inflow.granted_sequence, limit)
        inflow.granted_bytes = max(inflow.granted_bytes, inflow.taken_bytes + self.bytes)
        return (inflow.granted_sequence, inflow.granted_bytes) != before

    def taken(self, inflow: Inflow, end: int, size: int) -> bool:
        """The reader has taken what is below `end`, `size` bytes; tell whether half the window is used up."""
        inflow.taken_bytes += size
        inflow.taken_sequence = max(inflow.taken_sequence, end)
        return (
            inflow.granted_sequence - end < self.messages // 2
            or inflow.granted_bytes - inflow.taken_bytes < self.bytes // 2
        )

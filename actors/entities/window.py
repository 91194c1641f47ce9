"""Windows: what a KEEP_ALL subscription lets its publishers send before its reader has taken it.

All that is granted may wait on the subscription's link at once. So the declaration, made before anybody knows
how many publishers there are, grants little, and what is granted then is less, the more there are.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from proto.limits import MAX_U64

if TYPE_CHECKING:
    from actors.feeds import Inflow

FIRST_MESSAGES: Final = 256
FIRST_BYTES: Final = 64 * 1024
"""A publisher's window when it is matched, and the least it ever is."""

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

    __slots__ = ("_declared", "bytes", "messages")

    def __init__(self) -> None:
        self._declared = self.first
        self.messages = WINDOW_MESSAGES
        self.bytes = WINDOW_BYTES

    @property
    def first(self) -> tuple[int, int]:
        """Messages and bytes of the least window."""
        return min(FIRST_MESSAGES, WINDOW_MESSAGES), min(FIRST_BYTES, WINDOW_BYTES)

    def divide(self, publishers: int) -> None:
        """There are so many publishers now."""
        messages, size = self.first
        share = max(1, publishers)
        self.messages = max(messages, min(WINDOW_MESSAGES, SHARED_MESSAGES // share))
        self.bytes = max(size, min(WINDOW_BYTES, SHARED_BYTES // share))

    def declare(self, *, crowded: bool) -> tuple[int, int]:
        """Return what SUBSCRIPTION says: messages and bytes that a publisher may send from its attachment on.

        Args:
            crowded: What earlier publishers, or the same ones before a break, have sent waits still: nobody
                may add to it before it has been taken.
        """
        self._declared = (0, 0) if crowded else self.first
        return self._declared

    def attached(self, inflow: Inflow) -> None:
        """A publisher has been attached: it has what was declared."""
        messages, size = self._declared
        inflow.taken_sequence = inflow.first_sequence
        inflow.granted_sequence = min(inflow.first_sequence + messages, MAX_U64)
        inflow.granted_bytes = size

    def open(self, inflow: Inflow) -> bool:
        """Let a publisher have the whole window; tell whether to send a GRANT, which the inflow says."""
        before = inflow.granted_sequence, inflow.granted_bytes
        limit = min(inflow.taken_sequence + self.messages, MAX_U64)  # a stranger's numbers may be there
        inflow.granted_sequence = max(inflow.granted_sequence, limit)
        inflow.granted_bytes = max(inflow.granted_bytes, inflow.taken_bytes + self.bytes)
        return (inflow.granted_sequence, inflow.granted_bytes) != before

    def taken(self, inflow: Inflow, end: int, size: int) -> bool:
        """The reader has taken what is below `end`, `size` bytes; tell whether to send a GRANT.

        That is so when half of the window is used up. The inflow says what to grant.
        """
        inflow.taken_bytes += size
        inflow.taken_sequence = max(inflow.taken_sequence, end)
        if (
            inflow.granted_sequence - end >= self.messages // 2
            and inflow.granted_bytes - inflow.taken_bytes >= self.bytes // 2
        ):
            return False
        return self.open(inflow)

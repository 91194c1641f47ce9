"""How long messages in shared memory wait for others before the broker is told of them."""

from __future__ import annotations

import math
from typing import Final

LINGER_SEC: Final = 0.001
"""The longest wait of a message."""

LINGER_BYTES: Final = 1024 * 1024
"""The most that waits."""


class Linger:
    """Lets messages that follow others at once wait for one loop turn more, since to wake the broker is dear.

    A turn that adds another one prolongs the wait. The limits are checked at the end of a turn, so that a
    turn's messages are never parted.

    Attributes:
        size: Bytes of the messages that wait.
    """

    __slots__ = ("_added", "_left", "_until", "size")

    def __init__(self) -> None:
        self.size = 0
        self._added = False
        self._until = 0.0
        self._left = -math.inf
        """When the last ones were sent."""

    def add(self, size: int, now: float) -> None:
        """Count a message; it may wait if others were sent less than `LINGER_SEC` ago.

        Args:
            size: Its bytes.
            now: The loop's time in seconds.
        """
        if not self.size:
            self._until = now + LINGER_SEC
        self.size += size
        self._added = now - self._left < LINGER_SEC

    def goes_on(self, now: float) -> bool:
        """Return whether to wait for the next turn; called once at the end of each."""
        added, self._added = self._added, False
        return added and self.size < LINGER_BYTES and now < self._until

    def end(self, now: float) -> None:
        """Note that the messages are sent."""
        self.size = 0
        self._added = False
        self._left = now

"""How long messages in shared memory wait for others before the broker is told of them."""

from __future__ import annotations

from typing import Final

LINGER_SEC: Final = 0.001
"""The longest wait of a message."""

LINGER_BYTES: Final = 1024 * 1024
"""The most that waits."""


class Linger:
    """Lets messages wait for one loop turn more if this turn has added one, since to wake the broker is dear.

    Both limits are checked at the end of a turn, so that a turn's messages are never parted.
    """

    __slots__ = ("_added", "_bytes", "_until")

    def __init__(self) -> None:
        self._added = False
        self._bytes = 0
        self._until = 0.0

    def add(self, size: int, now: float) -> None:
        """Count a message that may wait: its bytes, and the loop's time in seconds."""
        if not self._bytes:
            self._until = now + LINGER_SEC
        self._bytes += size
        self._added = True

    def goes_on(self, now: float) -> bool:
        """Return whether to wait for the next turn; called once at the end of each."""
        added, self._added = self._added, False
        return added and self._bytes < LINGER_BYTES and now < self._until

    def end(self) -> None:
        """Forget the messages that have waited: they are sent."""
        self._added = False
        self._bytes = 0

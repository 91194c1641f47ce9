"""How many connections a broker takes, and how it refuses others.

A broker without free descriptors cannot even refuse: depending on the loop, clients wait or are disconnected
without an error, and the log fills. So some descriptors stay free, and each refused client is told why.
"""

from __future__ import annotations

import logging
from typing import Final

from proto.aio import process

logger: Final = logging.getLogger("callboard.broker")

RESERVED_FILES: Final = 2048
"""Descriptors for everything except links: standard streams, the loop, the listening socket, and connections
that are being refused. At most half of the limit."""

COMPLAINT_PERIOD_S: Final = 10.0
"""Refusals are logged at most once in this time, with their number."""

MAX_BACKLOG: Final = 1024
"""Connections that the kernel holds until the broker accepts them."""


class Capacity:
    """The limit on a broker's connections.

    Args:
        wanted: Connections that its options allow.

    Attributes:
        most: Connections that the broker takes.
        backlog: Connections that the kernel may hold for it. asyncio's own loop accepts as many in a row
            before any of them can be refused, so twice as many must fit: refused ones take a while to close.
        refused: Connections turned away so far.
    """

    def __init__(self, wanted: int) -> None:
        files = process.raise_file_limit(0)
        reserved = min(RESERVED_FILES, files // 2)
        self.most = min(wanted, files - reserved)
        self.backlog = min(MAX_BACKLOG, max(1, reserved // 2))
        self.refused = 0
        self._logged_at: float | None = None
        self._unlogged = 0
        self._remedy = "--max-connections" if self.most == wanted else "the limit of open files (ulimit -n)"

    def refuse(self, now: float) -> str:
        """Count a refused connection; log it if nothing has been logged for a while.

        Args:
            now: Loop time.

        Returns:
            The text for the client.
        """
        self.refused += 1
        self._unlogged += 1
        if self._logged_at is None or now - self._logged_at >= COMPLAINT_PERIOD_S:
            text = "Refused %d connections: %d are open, and %s allows no more"
            logger.warning(text, self._unlogged, self.most, self._remedy)
            self._logged_at, self._unlogged = now, 0
        return f"this broker takes {self.most} connections"

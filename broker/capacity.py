"""How many connections a broker takes, and what it says when there are more.

A broker without free descriptors cannot even refuse: depending on the loop, callers wait unanswered or are
cut off without a word, and the log fills. So some descriptors stay free, and who is too many is told why.
"""

from __future__ import annotations

import logging
from typing import Final

from proto.aio import process

logger: Final = logging.getLogger("callboard.broker")

RESERVED_FILES: Final = 2048
"""Descriptors for what is no link: the standard ones, the loop's, the listening socket, and connections that
are being refused. Of a small limit, half."""

COMPLAINT_PERIOD_S: Final = 10.0
"""However many are refused, the log says so once in this time."""

MAX_BACKLOG: Final = 1024
"""Connections that the kernel holds for us until we accept them."""


class Capacity:
    """How full a broker may get.

    Args:
        wanted: Connections that its options allow.

    Attributes:
        most: Connections that it takes.
        backlog: Connections that the kernel may hold for it. asyncio's own loop accepts as many in a row,
            before any of them can be refused: so they must fit, twice, as a refused one takes a while to go.
        refused: Connections turned away so far.
    """

    def __init__(self, wanted: int) -> None:
        files = process.raise_file_limit(0)
        reserved = min(RESERVED_FILES, files // 2)
        self.most = min(wanted, files - reserved)
        self.backlog = min(MAX_BACKLOG, max(1, reserved // 2))
        self.refused = 0
        self._said_at: float | None = None
        self._unsaid = 0
        self._remedy = "--max-connections" if self.most == wanted else "the limit of open files (ulimit -n)"

    def refuse(self, now: float) -> str:
        """Count one that is turned away; log it if nothing has been logged for a while.

        Returns:
            What to tell it.
        """
        self.refused += 1
        self._unsaid += 1
        if self._said_at is None or now - self._said_at >= COMPLAINT_PERIOD_S:
            text = "Refused %d connections: %d are open, and %s allows no more"
            logger.warning(text, self._unsaid, self.most, self._remedy)
            self._said_at, self._unsaid = now, 0
        return f"this broker takes {self.most} connections"

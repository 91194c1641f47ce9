"""Log lines about refused connections, of which there can be thousands a second."""

from __future__ import annotations

from typing import Final

from broker.link import logger

COMPLAINT_PERIOD_S: Final = 10.0
"""Refusals for one reason are logged at most once in this time, with their number."""


class RefusalLog:
    """The refusals for one reason.

    Args:
        text: The line; its first `%d` is the number of refusals since the line before.
    """

    def __init__(self, text: str) -> None:
        self._text = text
        self._logged_at: float | None = None
        self._unlogged = 0

    def add(self, now: float, *arguments: object) -> None:
        """Count a refusal; log it if nothing has been logged for a while.

        Args:
            now: Loop time.
            arguments: What else the line shows.
        """
        self._unlogged += 1
        if self._logged_at is None or now - self._logged_at >= COMPLAINT_PERIOD_S:
            logger.warning(self._text, self._unlogged, *arguments)
            self._logged_at, self._unlogged = now, 0

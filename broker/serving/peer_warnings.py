"""The broker's warnings about its peers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from broker.serving.link import logger
from proto.limited_log import LimitedLog

if TYPE_CHECKING:
    from collections.abc import Callable


class PeerWarnings:
    """Logs warnings that peers cause, in one run of a broker: a few lines for each reason, then only counts.

    Args:
        clock: Returns the time in seconds.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self._limit = LimitedLog(_warn_of_omitted, clock)

    def warn(self, reason: str, text: str, *values: object) -> None:
        """Log a warning, or count it.

        Args:
            reason: The kind of warning, as the line with the count names it, such as "failures of TLS".
            text: The warning, with a %s for each value.
            values: Its values.
        """
        if self._limit.admits(reason):
            logger.warning(text, *values)

    def report_omitted(self, *, at_once: bool = False) -> None:
        """Log how many warnings were not logged, if there are any.

        Args:
            at_once: Whether to ignore the limit, because the broker ends.
        """
        self._limit.report_omitted(at_once=at_once)


def _warn_of_omitted(omitted: int, reason: str) -> None:
    logger.warning("… and %d more like this: %s", omitted, reason)

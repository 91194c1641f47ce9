"""The broker's log lines about nodes and their endpoints that come and go."""

from __future__ import annotations

import logging
from collections import deque
from typing import TYPE_CHECKING, Final

from broker.link import logger
from broker.records import NodeRecord
from proto.names import is_hidden

if TYPE_CHECKING:
    from collections.abc import Callable

    from broker.link import Link
    from broker.records import Endpoint

MAX_LINES_PER_SEC: Final = 100
"""Lines above debug level in any second. A start of some dozen nodes is logged in full; a client that opens
and closes nodes in a loop cannot fill the log."""


class PresenceLog:
    """Logs which nodes and endpoints come and go, in one run of a broker.

    Changes beyond `MAX_LINES_PER_SEC` are counted, and the count is logged as soon as the limit allows a line
    again. Lines at debug level are not limited.

    Args:
        level: Level for nodes that are not hidden; everything else is logged at debug.
        clock: Returns the time in seconds.
    """

    def __init__(self, level: int, clock: Callable[[], float]) -> None:
        self._level = level
        self._clock = clock
        self._logged_at: deque[float] = deque(maxlen=MAX_LINES_PER_SEC)
        self._omitted = 0

    def log_change(self, domain: int, link: Link | None, endpoint: Endpoint, reason: str | None) -> None:
        """Log that an endpoint has come or gone.

        Args:
            domain: The graph's number.
            link: The endpoint's link, if it is known.
            endpoint: A node, publisher, subscription, service or client.
            reason: None if it has been declared; otherwise why it has gone, "" if its connection has ended.
        """
        is_node = isinstance(endpoint, NodeRecord)
        level = logging.DEBUG if not is_node or is_hidden(endpoint.name) else self._level
        if not logger.isEnabledFor(level):
            return
        if level > logging.DEBUG:
            self.report_omitted()
            if self._omitted or not self._may_log():
                self._omitted += 1
                return
        address = "?" if link is None else link.address
        place = f"{address}, domain {domain}" if domain else address
        if not is_node:
            verb = "declared" if reason is None else "removed"
            kind = endpoint.kind.name.lower()
            logger.log(level, "Node %s %s the %s %s", endpoint.node_name, verb, kind, endpoint.name)
        elif reason is None:
            logger.log(level, "Node %s joined (%s)", endpoint.name, place)
        else:
            died = not reason and link is not None and not link.left
            reason = reason or ("" if link is None else link.ending)
            logger.log(level, "Node %s %s (%s): %s", endpoint.name, "died" if died else "left", place, reason)

    def report_omitted(self, *, at_once: bool = False) -> None:
        """Log how many changes were not logged, if there are any.

        Args:
            at_once: Whether to ignore the limit, because the broker ends.
        """
        if self._omitted and (at_once or self._may_log()):
            text = "… and %d more changes: nodes come and go faster than they are logged"
            logger.log(self._level, text, self._omitted)
            self._omitted = 0

    def _may_log(self) -> bool:
        """Return whether the limit allows a line now, and count the line if it does."""
        now, logged_at = self._clock(), self._logged_at
        if len(logged_at) == MAX_LINES_PER_SEC and now - logged_at[0] < 1.0:
            return False
        logged_at.append(now)
        return True

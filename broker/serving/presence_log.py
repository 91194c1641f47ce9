"""The broker's log lines about nodes and their endpoints that come and go."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Final

from broker.routing.records import NodeRecord
from broker.serving.link import logger
from proto.limited_log import LimitedLog
from proto.wire.mesh_keys import broker_id
from proto.wire.names import is_hidden

if TYPE_CHECKING:
    from collections.abc import Callable

    from broker.routing.records import Endpoint
    from broker.serving.link import Link

MAX_LINES_PER_SEC: Final = 100
"""Lines above debug level in any second. A start of some dozen nodes is logged in full; a client that opens
and closes nodes in a loop cannot fill the log."""


class PresenceLog:
    """Logs which nodes and endpoints come and go, in one run of a broker.

    Changes beyond `MAX_LINES_PER_SEC` are counted, and the count is logged once a second. Lines at debug
    level are not limited.

    Args:
        level: Level for nodes that are not hidden; everything else is logged at debug.
        clock: Returns the time in seconds.
    """

    def __init__(self, level: int, clock: Callable[[], float]) -> None:
        self._level = level
        self._limit = LimitedLog(self._log_omitted, clock, max_lines=MAX_LINES_PER_SEC, period_sec=1.0)

    def log_change(self, domain: int, link: Link | None, endpoint: Endpoint, reason: str | None) -> None:
        """Log that an endpoint has come or gone.

        Args:
            domain: The graph's number.
            link: The endpoint's link; None if the endpoint belongs to another broker of the mesh.
            endpoint: A node, publisher, subscription, service or client.
            reason: None if the endpoint has been declared; otherwise why it was removed, "" if its connection
                has ended.
        """
        is_node = isinstance(endpoint, NodeRecord)
        level = logging.DEBUG if not is_node or is_hidden(endpoint.name) else self._level
        # Before the limit, which must count only lines that would be logged.
        if not logger.isEnabledFor(level):
            return
        if level > logging.DEBUG and not self._limit.admits("changes"):
            return
        mesh = f"broker {broker_id(endpoint.broker)}" if endpoint.mirrored else "?"
        address = mesh if link is None else link.address
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
        self._limit.report_omitted(at_once=at_once)

    def _log_omitted(self, omitted: int, _reason: str) -> None:
        text = "… and %d more changes: nodes come and go faster than they are logged"
        logger.log(self._level, text, omitted)

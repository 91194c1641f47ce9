"""The broker's log lines about nodes and their endpoints that come and go."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from broker.link import logger
from broker.records import NodeRecord
from proto.names import is_hidden

if TYPE_CHECKING:
    from broker.link import Link
    from broker.records import Endpoint


def log_change(level: int, domain: int, link: Link | None, endpoint: Endpoint, reason: str | None) -> None:
    """Log that an endpoint has come or gone.

    Args:
        level: Level for nodes that are not hidden; everything else is logged at debug.
        domain: The graph's number.
        link: The endpoint's link, if it is known.
        endpoint: A node, publisher, subscription, service or client.
        reason: None if it has been declared; otherwise why it has gone, "" if its connection has ended.
    """
    is_node = isinstance(endpoint, NodeRecord)
    if not is_node or is_hidden(endpoint.name):
        level = logging.DEBUG
    if not logger.isEnabledFor(level):
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

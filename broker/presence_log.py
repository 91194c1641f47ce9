"""What the log says when nodes and their endpoints come and go."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Final

from broker.records import NodeRecord
from proto.names import is_hidden

if TYPE_CHECKING:
    from broker.connection import Connection
    from broker.records import Endpoint

logger: Final = logging.getLogger("callboard.broker")


def log_change(domain: int, connection: Connection | None, endpoint: Endpoint, reason: str | None) -> None:
    """Log that an endpoint has come or gone: nodes at info, hidden nodes and all else at debug.

    Args:
        domain: The graph's number.
        connection: The endpoint's.
        endpoint: A node, publisher, subscription, service or client.
        reason: None if it has been declared; why it has gone; "" if its connection has ended.
    """
    is_node = isinstance(endpoint, NodeRecord)
    level = logging.INFO if is_node and not is_hidden(endpoint.name) else logging.DEBUG
    if not logger.isEnabledFor(level):
        return
    address = "?" if connection is None else connection.address
    where = f"{address}, domain {domain}" if domain else address
    if not is_node:
        verb = "declared" if reason is None else "removed"
        kind = endpoint.kind.name.lower()
        logger.log(level, "Node %s %s the %s %s", endpoint.node_name, verb, kind, endpoint.name)
    elif reason is None:
        logger.log(level, "Node %s joined (%s)", endpoint.name, where)
    else:
        died = not reason and connection is not None and not connection.left
        reason = reason or ("" if connection is None else connection.ending)
        logger.log(level, "Node %s %s (%s): %s", endpoint.name, "died" if died else "left", where, reason)

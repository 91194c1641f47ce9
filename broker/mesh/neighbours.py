"""Says in the log whether a broker has found the brokers that it should join.

Zenoh opens a session also when nobody answers, or when the others refuse it, and tries again for ever.
"""

from __future__ import annotations

import asyncio
import logging
import re
import socket
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

logger: Final = logging.getLogger("callboard.broker")

PERIOD_SEC: Final = 0.5
GRACE_SEC: Final = 3.0
"""How long a broker may be without others before the log says so."""

PROBE_SEC: Final = 2.0


async def watch(neighbours: Callable[[], Sequence[str]], endpoints: Sequence[str]) -> None:
    """Log when the last neighbour has gone, or none has come, and when there is one.

    Args:
        neighbours: Returns the ids of the routers and brokers with which there is a connection.
        endpoints: Where there should be one.
    """
    alone_sec, reported, connected = 0.0, False, False
    while True:
        number = len(neighbours())
        if number:
            if not connected:
                logger.info("Mesh: connected (direct connections with other brokers or routers: %d)", number)
            alone_sec, reported, connected = 0.0, False, True
        elif not reported:
            alone_sec += PERIOD_SEC
            if connected or alone_sec > GRACE_SEC:
                reported, connected = True, False
                for endpoint in endpoints:
                    reason = await asyncio.to_thread(_probe, endpoint)
                    logger.warning("Mesh: no connection with %s: %s; trying again", endpoint, reason)
        await asyncio.sleep(PERIOD_SEC)


def _probe(endpoint: str) -> str:
    """Return why there may be no connection; blocks."""
    protocol, _, rest = endpoint.partition("/")
    host, _, port = re.split(r"[?#]", rest)[0].rpartition(":")
    if protocol not in {"tcp", "tls"} or not port.isdecimal():
        return "nobody answers there, or it does not let this broker in"
    try:
        socket.create_connection((host.strip("[]"), int(port)), PROBE_SEC).close()
    except (OSError, UnicodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "this is no name of a host"
        return f"nobody answers there ({reason or error})"
    return "it does not let this broker in (another password in --mesh-auth, TLS, or it is no Zenoh)"

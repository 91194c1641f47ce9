"""Logs whether a broker is connected with the brokers that it should join.

Zenoh opens a session even if nobody answers or the others refuse it, and then tries again forever, in
silence.
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
"""Seconds between two checks of the connections."""

GRACE_SEC: Final = 3.0
"""How long connections may be missing before the log says so."""

PROBE_SEC: Final = 2.0
"""How long a test connection may take; a host that drops packets never answers."""


async def watch(neighbours: Callable[[], Sequence[str]], endpoints: Sequence[str]) -> None:
    """Log when there is a first connection, when the last one has ended, and when none has been made.

    If there are fewer connections than endpoints, log at which endpoints nobody answers.

    Args:
        neighbours: Returns the ids of the routers and brokers with which there is a connection.
        endpoints: The addresses of Zenoh to which this broker should be connected.
    """
    before, since_sec, reported = 0, 0.0, False
    while True:
        number = len(neighbours())
        if number and not before:
            logger.info("Mesh: connected (direct connections with other brokers or routers: %d)", number)
        if number != before:
            since_sec, reported = 0.0, False
        since_sec += PERIOD_SEC
        alone = number == 0
        if number < len(endpoints) and not reported and ((alone and before) or since_sec > GRACE_SEC):
            reported = True
            await _report(endpoints, alone=alone)
        before = number
        await asyncio.sleep(PERIOD_SEC)


async def _report(endpoints: Sequence[str], *, alone: bool) -> None:
    """Log the endpoints without a connection.

    Which connection belongs to which endpoint is not known. So an endpoint where somebody answers is named
    only if there is no connection at all.
    """
    for endpoint in endpoints:
        reason, answers = await asyncio.to_thread(_probe, endpoint)
        if alone or not answers:
            logger.warning("Mesh: no connection with %s: %s; trying again", endpoint, reason)


def address_of(endpoint: str) -> tuple[str, str, str]:
    """Return the protocol, host and port of an endpoint of Zenoh, without its options."""
    protocol, _, rest = endpoint.partition("/")
    host, _, port = re.split(r"[?#]", rest)[0].rpartition(":")
    return protocol, host.strip("[]"), port


def _probe(endpoint: str) -> tuple[str, bool]:
    """Return why there may be no connection, and whether somebody may answer there; blocks."""
    protocol, host, port = address_of(endpoint)
    if protocol not in {"tcp", "tls"} or not port.isdecimal():
        return "nobody answers there, or it does not let this broker in", True
    try:
        socket.create_connection((host, int(port)), PROBE_SEC).close()
    except (OSError, UnicodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "this is not a host name"
        return f"nobody answers there ({reason or error})", False
    reasons = "another password in --mesh-auth, TLS, or it is not Zenoh"
    return f"it does not let this broker in ({reasons})", True

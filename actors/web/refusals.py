"""What the web server refuses or ends because of a limit: counted for `/metrics`, and logged."""

from __future__ import annotations

import logging
from enum import Enum
from typing import TYPE_CHECKING, Final

from prometheus_client import CollectorRegistry, Counter, Gauge, generate_latest

from actors.logging.limited_lines import LimitedLines

if TYPE_CHECKING:
    from collections.abc import Callable

logger: Final = logging.getLogger("callboard.web")


class Refusal(Enum):
    """A limit: the label in `callboard_web_refusals_total`, and the words in the log."""

    CONNECTIONS = "connections", "more connections than may be open"
    ROOM = "made_room", "a connection was closed to make room for another one"
    SILENT = "silent", "a connection sent nothing in time"
    TLS = "tls", "TLS failed"
    UNREAD = "unread", "a client did not read in time"
    UNREAD_BYTES = "unread_bytes", "a connection was closed because too much was not read"
    MALFORMED = "malformed", "a request is not HTTP"
    STREAMS = "streams", "more browsers and streams than may be open"
    BODIES = "bodies", "more bodies of requests than are kept"
    TOKENS = "tokens", "a token was not accepted"

    @property
    def label(self) -> str:
        """Its name in the metrics."""
        return self.value[0]

    @property
    def words(self) -> str:
        """The sentence of the log."""
        return self.value[1]


class Refusals:
    """Counts and logs them for one server.

    Args:
        connections: Returns how many connections are open.
    """

    def __init__(self, connections: Callable[[], float]) -> None:
        self._log = LimitedLines(logger.warning)
        self._registry = CollectorRegistry()
        Gauge(
            "callboard_web_connections",
            "Open connections of the web server, from the moment that they are accepted",
            registry=self._registry,
        ).set_function(connections)
        counter = Counter(
            "callboard_web_refusals",
            "What the web server has refused or ended because of a limit, by reason",
            labelnames=("reason",),
            registry=self._registry,
        )
        self._drops = Counter(
            "callboard_web_dropped_messages",
            "Messages that live tools did not get, because they read too slowly",
            registry=self._registry,
        )
        self._counters = {each: counter.labels(each.label) for each in Refusal}

    def count(self, refusal: Refusal, source: object) -> None:
        """Count one.

        Args:
            refusal: Which.
            source: The user or address.
        """
        self._counters[refusal].inc()
        if self._log.admits(refusal.words):
            logger.warning("%s: %s", source, refusal.words)

    def count_drops(self, count: int) -> None:
        """Count messages that a live tool did not get, because it reads too slowly."""
        self._drops.inc(count)

    def admits_fault(self) -> bool:
        """Return whether to log the traceback of a request that has failed here: a client may repeat it."""
        return self._log.admits("faults of requests")

    def text(self) -> bytes:
        """Return the counts in Prometheus' text format."""
        return generate_latest(self._registry)

    def close(self) -> None:
        """Log how many lines were left out."""
        self._log.close()

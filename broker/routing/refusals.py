"""Counts and reports what the limits of a graph refuse: declarations, watches and INSPECTs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from proto.errors import ErrorCode, ProtocolError

if TYPE_CHECKING:
    from collections.abc import Callable

    from broker.routing.records import Peer


class Refusals:
    """What a limit of one graph has refused.

    Args:
        report: See `Router`.

    Attributes:
        count: How many.
    """

    def __init__(self, report: Callable[[Peer, str, str], None]) -> None:
        self.count = 0
        self._report = report

    def add(self, peer: Peer, text: str) -> None:
        """Count a refusal, and have it logged."""
        self.count += 1
        self._report(peer, "declarations and watches", text)

    def error(self, text: str) -> ProtocolError:
        """Count a refusal that ends its link; return the error, whose receiver logs it."""
        self.count += 1
        return ProtocolError(ErrorCode.LIMIT, text)

"""Counts and reports what the limits of a graph refuse."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from broker.records import Peer


class Refusals:
    """Declarations and watches that a limit has refused.

    Attributes:
        count: How many.
        on_limit: Called with the peer and the text for each.
    """

    def __init__(self) -> None:
        self.count = 0
        self.on_limit: Callable[[Peer, str], None] | None = None

    def add(self, peer: Peer, text: str) -> None:
        """Count a refusal, and have it logged."""
        self.count += 1
        if self.on_limit is not None:
            self.on_limit(peer, text)

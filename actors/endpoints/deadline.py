"""A deadline: messages of a publisher, or for a subscription, within a period of each other, or it is missed.

Both ends watch theirs by themselves. It holds from `begin` on: a publisher's from its first message, a
subscription's while a publisher is matched.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.callbacks.watchdogs import Watchdog

if TYPE_CHECKING:
    from actors.endpoints.context import NodeContext
    from actors.endpoints.events import Event
    from actors.time.types import Duration


class Deadline:
    """One publisher's or subscription's.

    Args:
        context: The node.
        period: What may pass between two messages; 0 for any time.
        missed: Counts the periods without a message.

    Attributes:
        wanted: Whether there is something to watch.
    """

    __slots__ = ("_context", "_missed", "_period_s", "_watchdog", "wanted")

    def __init__(self, context: NodeContext, period: Duration, missed: Event) -> None:
        self._context = context
        self._missed = missed
        self._period_s = period.nanoseconds / 1e9
        self._watchdog: Watchdog | None = None
        self.wanted = self._period_s > 0

    def begin(self) -> None:
        """It holds from now on. If it does already, or the node does not run, nothing changes."""
        loop = self._context.link.loop
        if self._watchdog is None and self.wanted and loop is not None:
            self._watchdog = Watchdog(loop, self._period_s, self._missed.add)
            self._watchdog.reset()

    def met(self) -> None:
        """A message has been published, or has come."""
        if self._watchdog is not None:
            self._watchdog.reset()

    def end(self) -> None:
        """It does not hold any more, until it begins again."""
        if self._watchdog is not None:
            self._watchdog.stop()
            self._watchdog = None

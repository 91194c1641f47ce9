"""The deadline of a publisher or a subscription: the longest time between two messages.

Each end checks its own. It holds from `begin` on: a publisher's from its first message, a subscription's
while a publisher is matched.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.callbacks.watchdogs import Watchdog

if TYPE_CHECKING:
    from actors.endpoints.context import NodeContext
    from actors.endpoints.events import Event
    from actors.time.types import Duration


class Deadline:
    """The deadline of one publisher or subscription.

    Args:
        context: The node.
        period: The longest time between two messages; 0 for no deadline.
        missed: Counts the periods without a message.

    Attributes:
        wanted: Whether there is a deadline.
    """

    __slots__ = ("_context", "_missed", "_period_s", "_watchdog", "wanted")

    def __init__(self, context: NodeContext, period: Duration, missed: Event) -> None:
        self._context = context
        self._missed = missed
        self._period_s = period.nanoseconds / 1e9
        self._watchdog: Watchdog | None = None
        self.wanted = self._period_s > 0

    def begin(self) -> None:
        """Let the deadline hold from now on, if the node runs and it does not hold yet."""
        loop = self._context.link.loop
        if self._watchdog is None and self.wanted and loop is not None:
            self._watchdog = Watchdog(loop, self._period_s, self._missed.add)
            self._watchdog.reset()

    def met(self) -> None:
        """Note that a message was published or received."""
        if self._watchdog is not None:
            self._watchdog.reset()

    def end(self) -> None:
        """Let the deadline hold no more, until it begins again."""
        if self._watchdog is not None:
            self._watchdog.stop()
            self._watchdog = None

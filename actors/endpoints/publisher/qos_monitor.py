"""What a publisher promises about time, and whether it keeps it: its deadline and, by hand, its lease.

Both are judged where they are made, so that the publisher itself is told; its readers judge by what they see.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.callbacks.watchdogs import Watchdog
from actors.endpoints.deadline import Deadline
from actors.qos.profile import LivelinessPolicy

if TYPE_CHECKING:
    from actors.endpoints.context import NodeContext
    from actors.endpoints.events import PublisherEvents
    from actors.qos.profile import QoSProfile


class QoSMonitor:
    """One publisher's.

    Args:
        context: The node.
        qos: The publisher's resolved profile.
        events: Told of what has not been kept.

    Attributes:
        any: Whether there is something to keep.
        by_hand: Whether readers want to be told that it is alive.
    """

    def __init__(self, context: NodeContext, qos: QoSProfile, events: PublisherEvents) -> None:
        self._context = context
        self._events = events
        self.by_hand = qos.liveliness is LivelinessPolicy.MANUAL_BY_TOPIC
        self._deadline = Deadline(context, qos.deadline, events.deadline)
        self._lease_s = qos.liveliness_lease_duration.nanoseconds / 1e9 if self.by_hand else 0.0
        self.any = self._deadline.wanted or self._lease_s > 0
        self._lease: Watchdog | None = None
        self._over = False

    def published(self) -> None:
        """A message has been published: from the first one on the deadline holds."""
        self._deadline.begin()
        self._deadline.met()
        self.shown()

    def shown(self) -> None:
        """It has shown itself: from the first session on the lease holds."""
        if self._over:
            return
        loop = self._context.link.loop
        if self._lease is None and self._lease_s and loop is not None:
            self._lease = Watchdog(loop, self._lease_s, self._events.liveliness.add, once=True)
        if self._lease is not None:
            self._lease.reset()

    def stop(self) -> None:
        """It is destroyed: nothing is promised any more."""
        self.any = False
        self._over = True
        self._deadline.end()
        if self._lease is not None:
            self._lease.stop()

"""Whether a publisher keeps its QoS: its deadline and, with MANUAL_BY_TOPIC, its lease.

Each end checks by itself: the publisher here, its readers by what they receive.
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
    """The monitor of one publisher.

    Args:
        context: The node.
        qos: The publisher's resolved profile.
        events: Counts missed deadlines and lost liveliness.

    Attributes:
        active: Whether there is something to check.
    """

    def __init__(self, context: NodeContext, qos: QoSProfile, events: PublisherEvents) -> None:
        self._context = context
        self._events = events
        manual = qos.liveliness is LivelinessPolicy.MANUAL_BY_TOPIC
        self._deadline = Deadline(context, qos.deadline, events.deadline)
        self._lease_s = qos.liveliness_lease_duration.nanoseconds / 1e9 if manual else 0.0
        self.active = self._deadline.wanted or self._lease_s > 0
        self._lease: Watchdog | None = None
        self._stopped = False

    def published(self) -> None:
        """Note a published message: the deadline holds from the first one on."""
        self._deadline.begin()
        self._deadline.met()
        self.asserted()

    def asserted(self) -> None:
        """Note a sign of life: the lease holds from the first session on."""
        if self._stopped:
            return
        loop = self._context.link.loop
        if self._lease is None and self._lease_s and loop is not None:
            self._lease = Watchdog(loop, self._lease_s, self._events.liveliness.add, once=True)
        if self._lease is not None:
            self._lease.reset()

    def stop(self) -> None:
        """Check nothing more: the publisher is destroyed."""
        self.active = False
        self._stopped = True
        self._deadline.end()
        if self._lease is not None:
            self._lease.stop()

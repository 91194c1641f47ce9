"""Which of a subscription's publishers are alive.

A MANUAL_BY_TOPIC publisher counts as not alive when it has neither published nor asserted itself within its
lease. Any other is alive as long as the broker receives signs of life on its link: while it is suspended it
counts as not alive, and when it is gone it no longer counts.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from actors.callbacks.watchdogs import Watchdog

if TYPE_CHECKING:
    from actors.endpoints.context import NodeContext
    from actors.endpoints.events import Event
    from actors.session.attachments import Attachment


class Liveliness:
    """The publishers of one subscription.

    Args:
        context: The node.
        event: Counts those alive and those not alive.
    """

    def __init__(self, context: NodeContext, event: Event) -> None:
        self._context = context
        self._event = event
        self._leases: dict[Attachment, Watchdog] = {}
        self._dead: dict[Attachment, None] = {}

    def attached(self, attachment: Attachment) -> bool:
        """Count a publisher as alive; return whether it has a lease, so that `mark_alive` must be called."""
        self._event.add(1, 0)
        loop = self._context.link.loop
        if not attachment.lease_s or loop is None:
            return False
        lease = self._leases[attachment] = Watchdog(
            loop, attachment.lease_s, partial(self._expired, attachment), once=True
        )
        lease.reset()
        return True

    def _expired(self, attachment: Attachment, periods: int) -> None:
        del periods
        self._dead[attachment] = None
        self._event.add(-1, 1)

    def mark_alive(self, attachment: Attachment) -> None:
        """Record a publisher's sign of life."""
        lease = self._leases.get(attachment)
        if lease is not None:
            lease.reset()
            if attachment in self._dead:
                del self._dead[attachment]
                self._event.add(1, -1)

    def detached(self, attachment: Attachment, *, suspended: bool) -> None:
        """Remove a publisher; a suspended one counts as not alive until `suspension_ended`."""
        lease = self._leases.pop(attachment, None)
        if lease is not None:
            lease.stop()
        was_dead = attachment in self._dead
        self._dead.pop(attachment, None)
        self._event.add(was_dead - 1, suspended - was_dead)

    def suspension_ended(self) -> None:
        """Remove a suspended publisher: it is attached again, or gone for good."""
        self._event.add(0, -1)

    def session_ended(self) -> None:
        """Remove every publisher."""
        alive, not_alive = self._event.counts
        self._event.add(-alive, -not_alive)
        self.stop()

    def stop(self) -> None:
        """Watch no publisher any more."""
        for lease in self._leases.values():
            lease.stop()
        self._leases.clear()
        self._dead.clear()

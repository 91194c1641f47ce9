"""Which of a subscription's publishers are alive.

A publisher that shows itself by hand (MANUAL_BY_TOPIC) is taken for dead when it has neither published nor
asserted itself within its lease. Any other lives as long as the broker hears from its link: while it is
suspended there it counts as not alive, and when it has gone it does not count at all.
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
        """A publisher is there; return whether it must be watched: tell `heard` of its signs of life."""
        self._event.add(1, 0)
        loop = self._context.link.loop
        if not attachment.lease_s or loop is None:
            return False
        lease = self._leases[attachment] = Watchdog(
            loop, attachment.lease_s, partial(self._silent, attachment), once=True
        )
        lease.reset()
        return True

    def _silent(self, attachment: Attachment, periods: int) -> None:
        del periods
        self._dead[attachment] = None
        self._event.add(-1, 1)

    def heard(self, attachment: Attachment) -> None:
        """A publisher has shown itself."""
        lease = self._leases.get(attachment)
        if lease is not None:
            lease.reset()
            if attachment in self._dead:
                del self._dead[attachment]
                self._event.add(1, -1)

    def detached(self, attachment: Attachment, *, silent: bool) -> None:
        """A publisher is not there any more; if it is only silent, `forgotten` will tell how that ends."""
        lease = self._leases.pop(attachment, None)
        if lease is not None:
            lease.stop()
        was_dead = attachment in self._dead
        self._dead.pop(attachment, None)
        self._event.add(was_dead - 1, silent - was_dead)

    def forgotten(self) -> None:
        """A silent publisher is attached anew, or has gone for good."""
        self._event.add(0, -1)

    def stop(self) -> None:
        """Watch nobody any more."""
        for lease in self._leases.values():
            lease.stop()
        self._leases.clear()
        self._dead.clear()

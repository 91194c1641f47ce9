"""Which of a subscription's publishers are alive.

A publisher that shows itself by hand (MANUAL_BY_TOPIC) is taken for dead when it has neither published nor
asserted itself within its lease. Any other lives as long as the broker hears from its link: while it is
suspended there it counts as not alive, and when it has gone it does not count at all.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from actors.watchdogs import Watchdog

if TYPE_CHECKING:
    from actors.core import Core
    from actors.events import Event
    from actors.feeds import Inflow


class Liveliness:
    """The publishers of one subscription.

    Args:
        core: The node.
        event: Counts those alive and those not alive.
    """

    def __init__(self, core: Core, event: Event) -> None:
        self._core = core
        self._event = event
        self._leases: dict[Inflow, Watchdog] = {}
        self._dead: dict[Inflow, None] = {}

    def attached(self, inflow: Inflow) -> bool:
        """A publisher is there; return whether it must be watched: tell `heard` of its signs of life."""
        self._event.add(1, 0)
        loop = self._core.link.loop
        if not inflow.lease_s or loop is None:
            return False
        lease = self._leases[inflow] = Watchdog(
            loop, inflow.lease_s, partial(self._silent, inflow), once=True
        )
        lease.feed()
        return True

    def _silent(self, inflow: Inflow, periods: int) -> None:
        del periods
        self._dead[inflow] = None
        self._event.add(-1, 1)

    def heard(self, inflow: Inflow) -> None:
        """A publisher has shown itself."""
        lease = self._leases.get(inflow)
        if lease is not None:
            lease.feed()
            if inflow in self._dead:
                del self._dead[inflow]
                self._event.add(1, -1)

    def detached(self, inflow: Inflow, *, silent: bool) -> None:
        """A publisher is not there any more; if it is only silent, `forgotten` will tell how that ends."""
        lease = self._leases.pop(inflow, None)
        if lease is not None:
            lease.stop()
        was_dead = inflow in self._dead
        self._dead.pop(inflow, None)
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

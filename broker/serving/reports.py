"""Reports of graph changes, once per loop turn, and the answers to PINGs, which follow them."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Protocol

from broker.routing.deliveries import Send
from proto.wire.frames import Pong

if TYPE_CHECKING:
    from collections.abc import Iterable

    from broker.routing.deliveries import Delivery
    from broker.routing.router import Router
    from broker.serving.link import Link
    from proto.aio.read_budget import ReadBudget


class ReportingDispatcher(Protocol):
    """What reports use of the dispatcher, which owns them."""

    @property
    def budget(self) -> ReadBudget | None:
        """Limits the work of one loop turn."""
        ...

    @property
    def joined(self) -> Iterable[Router]:
        """The routers of all graphs."""
        ...

    def deliver(self, router: Router, deliveries: list[Delivery]) -> None:
        """Put deliveries into the outboxes of their links."""
        ...

    def flush(self) -> None:
        """Write to every link with new deliveries."""
        ...


class Reports:
    """Lets the routers report changes once per loop turn, however many frames have caused them.

    Args:
        dispatcher: The links and graphs.
    """

    def __init__(self, dispatcher: ReportingDispatcher) -> None:
        self._dispatcher = dispatcher
        self._due = False
        self._pings: list[tuple[Link, int]] = []
        """PINGs to answer after the reports that are due."""

    def report_soon(self) -> None:
        """Report changes of the graphs in the next loop turn, once, however many there are."""
        if not self._due:
            self._due = True
            asyncio.get_running_loop().call_soon(self._report_in_turn)

    def _report_in_turn(self) -> None:
        if not self._due:
            return
        budget = self._dispatcher.budget
        began = 0.0 if budget is None else budget.clock()
        self.report()
        if budget is not None:
            budget.spend(budget.clock() - began)

    def report(self) -> None:
        """Report changes of the graphs now, and answer the PINGs that were received after them."""
        self._due = False
        dispatcher = self._dispatcher
        for router in tuple(dispatcher.joined):
            dispatcher.deliver(router, router.report())
            if router.graph.asked:
                self.report_soon()
        pings, self._pings = self._pings, []
        for link, token in pings:
            self._pong(link, token)
        dispatcher.flush()

    def answer_ping(self, link: Link, token: int) -> None:
        """Send PONG after everything that the frames before the PING have caused."""
        if self._due:
            self._pings.append((link, token))
        else:
            self._pong(link, token)

    def _pong(self, link: Link, token: int) -> None:
        if link.router is not None:
            self._dispatcher.deliver(link.router, [Send(link.peer, Pong(token))])

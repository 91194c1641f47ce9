"""How a broker stops: nothing new is accepted, what has been accepted reaches its readers, and then goodbye.

    calls        no new ones, but of who is answering one; those get their answers, up to `drain_timeout_sec`
    messages     every publisher is held, by credit; what is on its way comes in, and goes out
    goodbye      behind everything else on each link; who has read it has read all, and closes

The second and third step have what is left of `drain_timeout_sec`, and at least LAST_STEP_SEC each. Nobody is
waited for who is silent for the keepalive limit: while it stops, a broker looks closely at every link.
"""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Final

from broker.connection import logger
from proto.errors import ErrorCode

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from broker.connection import Connection
    from broker.server import Broker

LAST_STEP_SEC: Final = 1.0
"""Enough for queues that nobody blocks; not more than `drain_timeout_sec` either."""


class Drain:
    """One stop of one broker.

    Args:
        broker: Told to deliver what the routers have to say.
        connections: Its connections, as they come and go.
    """

    def __init__(self, broker: Broker, connections: Iterable[Connection]) -> None:
        self._broker = broker
        self._connections = connections
        self._changed = asyncio.Event()
        self._behind: dict[Connection, None] = {}
        """Those from which something may come that they sent before they were held."""

    def changed(self) -> None:
        """Something has come, left or closed: look again."""
        self._changed.set()

    def caught_up(self, connection: Connection) -> None:
        """What a connection sent before it was held has come."""
        self._behind.pop(connection, None)
        self._changed.set()

    async def run(self, timeout_sec: float) -> None:
        """Go through the steps. Cancelled, it leaves the rest undone."""
        loop = asyncio.get_running_loop()
        deadline = loop.time() + timeout_sec
        least = min(LAST_STEP_SEC, timeout_sec)
        for connection in tuple(self._connections):
            if connection.router is None:
                connection.turn_away(ErrorCode.SHUTDOWN, "the broker is stopping")
        for router in self._broker.routers():
            router.refuse_calls()
        if not await self._until(self._answered, deadline):
            logger.warning("%d calls were not answered in time", self._pending())
        self._hold()
        deadline = max(deadline, loop.time() + least)
        await self._until(self._heard, min(deadline, loop.time() + self._broker.options.keepalive_sec))
        if not await self._until(self._delivered, deadline):
            unread = sum(each.has_unsent for each in self._connections)
            logger.warning("%d links did not read in time what waits for them", unread)
        for connection in tuple(self._connections):
            connection.say_goodbye()
        deadline = max(deadline, loop.time() + least)
        if not await self._until(self._closed, deadline):
            logger.warning("%d links did not close in time", len(tuple(self._connections)))

    def _answered(self) -> bool:
        return not self._pending()

    def _pending(self) -> int:
        return sum(router.services.pending for router in self._broker.routers())

    def _hold(self) -> None:
        for router in self._broker.routers():
            self._broker.deliver(router, router.hold_publishers())
        self._behind = dict.fromkeys(each for each in self._connections if each.ask_to_catch_up())
        self._broker.flush()

    # Looked at in each turn of the loop, with up to ten thousand links: so nothing is added up here.

    def _heard(self) -> bool:
        return not any(each.channel.connected and each.suspended_at is None for each in self._behind)

    def _delivered(self) -> bool:
        return not any(each.has_unsent for each in self._connections)

    def _closed(self) -> bool:
        return all(each.suspended_at is not None for each in self._connections)

    async def _until(self, condition: Callable[[], bool], deadline: float) -> bool:
        try:
            async with asyncio.timeout_at(deadline):
                while not condition():
                    self._changed.clear()
                    await self._changed.wait()
        except TimeoutError:
            return False
        return True

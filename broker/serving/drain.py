"""How a broker stops: it accepts nothing new, delivers what it has accepted, and says goodbye.

    calls        no new ones, except those that the answer to another needs; pending calls get their answers,
                 up to `drain_timeout_sec`
    messages     no more credit is granted; messages that have been sent arrive and are delivered
    goodbye      comes last on each link; a client that has read it has read everything, and closes

The second and third step have the rest of `drain_timeout_sec`, and at least LAST_STEP_SEC each. No step waits
for a link that is silent for the keepalive limit: during a stop the periodic check covers every link.
"""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Final

from broker.serving.link import logger
from proto.errors import ErrorCode

if TYPE_CHECKING:
    from collections.abc import Callable

    from broker.serving.dispatcher import Dispatcher

LAST_STEP_SEC: Final = 1.0
"""Enough for queues that nobody blocks; at most `drain_timeout_sec`."""


class Drain:
    """One stop of one broker. From its creation on the broker takes no new links.

    Args:
        dispatcher: The links and graphs.
    """

    def __init__(self, dispatcher: Dispatcher) -> None:
        self._dispatcher = dispatcher
        self._changed = asyncio.Event()
        dispatcher.draining = True
        dispatcher.on_progress = self._changed.set

    async def run(self, timeout_sec: float) -> None:
        """Go through the steps. If it is cancelled, the rest is left undone."""
        dispatcher, loop = self._dispatcher, asyncio.get_running_loop()
        deadline = loop.time() + timeout_sec
        least = min(LAST_STEP_SEC, timeout_sec)
        # Clients in their handshake have nothing to lose, and would only delay the stop.
        for link in tuple(dispatcher.links):
            if link.router is None:
                link.refuse(ErrorCode.SHUTDOWN, "the broker is stopping")
        for router in dispatcher.joined:
            router.calls.closed = True  # except those that pending ones need for their answers
        if not await self._until(self._calls_answered, deadline):
            logger.warning("%d calls were not answered in time", self._pending_calls())
        # Publishers go on while calls are answered, because an answer may depend on their messages.
        self._hold()
        deadline = max(deadline, loop.time() + least)
        await self._until(self._caught_up, min(deadline, loop.time() + dispatcher.options.keepalive_sec))
        if not await self._until(self._delivered, deadline):
            unread = sum(link.has_unsent for link in dispatcher.links)
            mesh = " and the mesh" if dispatcher.mesh_has_unsent else ""
            logger.warning("%d links%s did not read their pending messages in time", unread, mesh)
        # Reports that are due must be sent before GOODBYE, the last frame of a session.
        dispatcher.reports.report()
        for link in tuple(dispatcher.links):
            link.send_goodbye()
        deadline = max(deadline, loop.time() + least)
        if not await self._until(self._closed, deadline):
            logger.warning("%d links did not close in time", len(dispatcher.links))

    def _pending_calls(self) -> int:
        return sum(router.calls.pending for router in self._dispatcher.joined)

    def _calls_answered(self) -> bool:
        return not self._pending_calls()

    def _hold(self) -> None:
        for router in self._dispatcher.joined:
            self._dispatcher.deliver(router, router.hold_publishers())
        for link in self._dispatcher.links:
            link.request_catch_up()
        self._dispatcher.flush()

    # Evaluated in each loop iteration for up to ten thousand links: each stops at the first unfinished one.

    def _caught_up(self) -> bool:
        links = self._dispatcher.links
        return not any(link.behind and link.channel.connected and link.suspended_at is None for link in links)

    def _delivered(self) -> bool:
        dispatcher = self._dispatcher
        return not dispatcher.mesh_has_unsent and not any(link.has_unsent for link in dispatcher.links)

    def _closed(self) -> bool:
        return all(link.suspended_at is not None for link in self._dispatcher.links)

    async def _until(self, condition: Callable[[], bool], deadline: float) -> bool:
        try:
            async with asyncio.timeout_at(deadline):
                while not condition():
                    self._changed.clear()
                    await self._changed.wait()
        except TimeoutError:
            return False
        return True

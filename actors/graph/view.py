"""The graph as a node sees it: asked from the broker, which knows.

Queries are coroutines because the answer is the broker's, taken after everything the node has declared.
"""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Final, Protocol

from actors.diagnostics.records import Size
from actors.endpoints.context import NodeContext, in_flight
from actors.errors import BrokerUnreachable
from actors.graph.queries import QUERY_TIMEOUT_SEC, answered, connected
from actors.graph.snapshot import GraphSnapshot
from proto import frames

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

SECOND_LOOK_SEC: Final = 1.0
"""How much longer than asked a wait may take because the broker has not answered at all: one that is there
needs milliseconds."""

FIRST_QUESTION: Final = 1 << 31
"""Ids of questions begin here; those below are the link's."""


class GraphListener(Protocol):
    """Something that has asked for the graph."""

    def received(self, frame: frames.Graph) -> None:
        """A piece, or a change, has come."""
        ...


class GraphView:
    """Asks the broker for the graph over a node's link."""

    def __init__(self, context: NodeContext) -> None:
        self._context = context
        self._next_id = FIRST_QUESTION
        self.listeners: dict[int, GraphListener] = {}
        """By the id of what they have asked."""
        self._definitions: dict[str, list[asyncio.Future[bytes | None]]] = {}
        context.link.handle(frames.Graph, self._received)
        context.link.handle(frames.Definition, self._described)

    def sizes(self) -> Iterator[Size]:
        """Say how full its maps are."""
        yield Size(name="graph questions", size=len(self.listeners))
        yield Size(name="definitions asked for", size=len(self._definitions))

    def _received(self, frame: frames.Graph) -> None:
        watch = self.listeners.get(frame.watch)
        if watch is not None:
            watch.received(frame)
            self._context.link.wake()

    def _described(self, frame: frames.Definition) -> None:
        for waiter in self._definitions.pop(frame.type_hash, []):
            if not waiter.done():
                waiter.set_result(frame.definition)
        self._context.link.wake()

    async def snapshot(self, timeout_sec: float = QUERY_TIMEOUT_SEC) -> GraphSnapshot:
        """Return the graph as it is now, what this node has declared included.

        Raises:
            BrokerUnreachable: No broker within `timeout_sec`, or the link broke meanwhile.
        """
        watch = self._open(keep=False)
        await self._wait(lambda: watch.complete, watch, timeout_sec)
        return watch.snapshot

    async def wait_for(self, condition: Callable[[GraphSnapshot], bool], timeout_sec: float | None) -> bool:
        """Wait until the graph fulfils a condition; False if `timeout_sec` (None: no limit) passes first.

        A broker that had no time to answer gets a second more to say how things are.
        """
        context, link = self._context, self._context.link
        context.require_loop()
        watch: _Watch | None = None
        try:
            with in_flight():
                async with asyncio.timeout(None if timeout_sec is None else max(0.0, timeout_sec)):
                    while True:
                        if watch is None or watch.session != link.connections:
                            self._close(watch)
                            watch = self._open(keep=True) if link.connected else None
                        if watch is not None and watch.complete and condition(watch.snapshot):
                            return True
                        await link.changed()
                        context.require_alive()
        except TimeoutError:
            # A watch that had no time to answer has not been asked: look once.
            if watch is None or watch.complete:
                return False
            try:
                return condition(await self.snapshot(SECOND_LOOK_SEC))
            except BrokerUnreachable:
                return False
        finally:
            self._close(watch)

    async def describe(self, type_hash: str, timeout_sec: float = QUERY_TIMEOUT_SEC) -> bytes | None:
        """Return the definition behind a type hash, if the broker has seen it.

        Raises:
            BrokerUnreachable: No broker within `timeout_sec`, or the link broke meanwhile.
        """
        await connected(self._context, timeout_sec)
        link = self._context.link
        assert link.channel is not None
        session = link.connections
        waiter: asyncio.Future[bytes | None] = self._context.require_loop().create_future()
        self._definitions.setdefault(type_hash, []).append(waiter)
        try:
            link.channel.send(frames.Describe(type_hash))
            await answered(self._context, waiter.done, session, timeout_sec)
        finally:
            self._give_up(type_hash, waiter)
        return waiter.result()

    def _give_up(self, type_hash: str, waiter: asyncio.Future[bytes | None]) -> None:
        """Nobody waits any more for this answer, which may not have come."""
        waiters = self._definitions.get(type_hash, [])
        if waiter in waiters:
            waiters.remove(waiter)
            if not waiters:
                del self._definitions[type_hash]

    async def _wait(self, condition: Callable[[], bool], watch: _Watch, timeout_sec: float) -> None:
        link = self._context.link
        try:
            await connected(self._context, timeout_sec)
            if watch.session != link.connections:
                self._ask(watch)
            await answered(self._context, condition, watch.session, timeout_sec)
        finally:
            self._close(watch)

    def _open(self, *, keep: bool) -> _Watch:
        self._next_id += 1
        watch = _Watch(self._next_id, keep=keep)
        self.listeners[watch.id] = watch
        self._ask(watch)
        return watch

    def _ask(self, watch: _Watch) -> None:
        link = self._context.link
        if link.channel is not None:
            watch.session = link.connections
            link.channel.send(frames.Watch(watch.id, watch.keep))

    def _close(self, watch: _Watch | None) -> None:
        if watch is None:
            return
        self.listeners.pop(watch.id, None)
        link = self._context.link
        if watch.keep and link.channel is not None and watch.session == link.connections:
            link.channel.send(frames.Unwatch(watch.id))


class _Watch:
    """One question to the broker."""

    def __init__(self, watch_id: int, *, keep: bool) -> None:
        self.id = watch_id
        self.keep = keep
        self.session = 0
        self.complete = False
        self.snapshot = GraphSnapshot()

    def received(self, frame: frames.Graph) -> None:
        """A piece came."""
        self.snapshot.apply(frame)
        if not frame.more:
            self.complete = True

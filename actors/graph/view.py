"""The broker's view of the graph, its numbers and the types it knows, queried over a node's link.

Queries are coroutines because the answer is the broker's, made after everything that the node has declared.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.endpoints.context import NodeContext, in_flight, time_limit
from actors.errors import BrokerUnreachable, WaitTimeout
from actors.graph.snapshot import GraphSnapshot
from proto.wire import frames
from proto.wire.type_hash import hash_of

if TYPE_CHECKING:
    import asyncio
    from collections.abc import Callable

    from actors.graph.broker_report import BrokerReport
    from actors.time.timeout import Timeout


QUERY_TIMEOUT_SEC: Final = 5.0


async def connected(context: NodeContext, timeout_sec: float) -> float:
    """Wait until there is a first session; return how much of `timeout_sec` is left for the answer.

    Raises:
        BrokerUnreachable: There was no session within `timeout_sec`, or the last one was lost.
    """
    link = context.link
    # As for calls: scripts may start before their broker, but a session that was lost is an error at once.
    if link.connections and not link.connected:
        raise BrokerUnreachable(f"No broker at {link.broker_urls}")
    # One deadline for both waits: connecting must not double the time that the caller has given.
    deadline = context.require_loop().time() + timeout_sec
    try:
        await context.wait_until(lambda: link.connected, "No session", timeout_sec)
    except WaitTimeout as error:
        raise BrokerUnreachable(f"No broker at {link.broker_urls}") from error
    return deadline - context.require_loop().time()


async def answered(
    context: NodeContext, condition: Callable[[], bool], session: int, timeout_sec: float
) -> None:
    """Wait until the broker has answered a query of a session.

    Raises:
        BrokerUnreachable: It did not within `timeout_sec`, or the link broke meanwhile.
    """
    link = context.link
    try:
        await context.wait_until(
            # An answer belongs to a session. After a reconnect nobody would send it.
            lambda: condition() or link.connections != session or not link.connected,
            "No answer",
            timeout_sec,
        )
    except WaitTimeout as error:
        raise BrokerUnreachable(f"No answer from the broker at {link.broker_urls}") from error
    if not condition():
        raise BrokerUnreachable(f"The link to the broker at {link.broker_urls} broke")


LAST_QUERY_TIMEOUT_SEC: Final = 1.0
"""How much longer than asked a wait may take if the broker has not answered at all; a live one needs
milliseconds."""


class BrokerView:
    """A node's queries to its broker.

    Each raises BrokerUnreachable if there is no answer within `timeout_sec`, or if the link breaks meanwhile.
    """

    def __init__(self, context: NodeContext) -> None:
        self._context = context
        self._definitions: dict[str, list[asyncio.Future[bytes | None]]] = {}

    async def snapshot(self, timeout_sec: float = QUERY_TIMEOUT_SEC) -> GraphSnapshot:
        """Return the graph as it is now, including everything that this node has declared."""
        link = self._context.link
        # Before the wait for a session: if there is one already, the query leaves in this very loop turn.
        watch = _Watch(self._context, keep=False)
        try:
            left = await connected(self._context, timeout_sec)
            # Made before there was a session, or that session has ended meanwhile.
            if watch.session != link.connections:
                watch.ask()
            await answered(self._context, lambda: watch.complete, watch.session, left)
        finally:
            watch.close()
        return watch.snapshot

    async def wait_for(self, condition: Callable[[GraphSnapshot], bool], timeout_sec: Timeout) -> bool:
        """Wait until the graph fulfils a condition; return False after `timeout_sec`.

        A broker that had no time to answer gets a second more.
        """
        context, link = self._context, self._context.link
        context.require_loop()
        watch: _Watch | None = None
        try:
            with in_flight():
                async with time_limit(context.limit_sec(timeout_sec)):
                    while True:
                        if watch is None or watch.session != link.connections:
                            if watch is not None:
                                watch.close()
                            watch = _Watch(context, keep=True) if link.connected else None
                        if watch is not None and watch.refusal:
                            raise BrokerUnreachable(f"The broker does not report changes: {watch.refusal}")
                        if watch is not None and watch.complete and condition(watch.snapshot):
                            return True
                        await link.changed()
                        context.require_alive()
        except TimeoutError:
            # There is no session, or the whole graph is here and does not fulfil the condition.
            if watch is None or watch.complete:
                return False
            try:
                # A timeout of zero, or a few milliseconds, ends before the broker could answer. "Not now"
                # should be the broker's answer, and not this machine's.
                return condition(await self.snapshot(LAST_QUERY_TIMEOUT_SEC))
            except BrokerUnreachable:
                return False
        finally:
            if watch is not None:
                watch.close()

    async def describe(self, type_hash: str, timeout_sec: float = QUERY_TIMEOUT_SEC) -> bytes | None:
        """Return the definition with a type hash; None if the broker does not know it."""
        context, link = self._context, self._context.link
        left = await connected(context, timeout_sec)
        assert link.channel is not None
        waiter: asyncio.Future[bytes | None] = context.require_loop().create_future()
        # Answers carry the hash and no query's number: several queries for one type share the answer.
        waiters = self._definitions.setdefault(type_hash, [])
        waiters.append(waiter)
        link.answers[type_hash] = self._described
        try:
            link.channel.send(frames.Describe(type_hash))
            await answered(context, waiter.done, link.connections, left)
        finally:
            waiters.remove(waiter)
            if not waiters:
                self._definitions.pop(type_hash, None)
                link.answers.pop(type_hash, None)
        definition = waiter.result()
        # Checked, because classes are made of it: a wrong definition would decode messages into wrong
        # fields.
        return definition if definition is None or hash_of(definition) == type_hash else None

    def _described(self, frame: frames.Definition) -> None:
        for waiter in self._definitions.get(frame.type_hash, ()):
            if not waiter.done():
                waiter.set_result(frame.definition)

    async def report(self, timeout_sec: float = QUERY_TIMEOUT_SEC) -> BrokerReport:
        """Return the broker's numbers."""
        from actors.graph.broker_report import ReportParts  # noqa: PLC0415 - seldom needed

        link, parts = self._context.link, ReportParts()
        left = await connected(self._context, timeout_sec)
        assert link.channel is not None
        query = link.new_id()
        link.answers[query] = parts.add
        try:
            link.channel.send(frames.Inspect(query))
            await answered(self._context, lambda: parts.complete, link.connections, left)
        finally:
            del link.answers[query]
        return parts.report()


class _Watch:
    """One query of the graph, answered once or, with `keep`, until it is closed."""

    def __init__(self, context: NodeContext, *, keep: bool) -> None:
        self._link = context.link
        self._id = self._link.new_id()
        self._keep = keep
        self.session = 0
        self.complete = False
        self.refusal = ""
        self.snapshot = GraphSnapshot()
        self._link.answers[self._id] = self._received
        self.ask()

    def ask(self) -> None:
        """Send the query, if there is a session."""
        if self._link.channel is not None:
            self.session = self._link.connections
            self._link.channel.send(frames.Watch(self._id, self._keep))

    def _received(self, frame: frames.Graph | frames.Refused) -> None:
        if isinstance(frame, frames.Refused):
            self.refusal = frame.text
            return
        self.snapshot.apply(frame)
        if not frame.more:
            self.complete = True

    def close(self) -> None:
        """Ignore further answers, and end a query that is kept."""
        link = self._link
        link.answers.pop(self._id, None)
        if self._keep and link.channel is not None and self.session == link.connections:
            link.channel.send(frames.Unwatch(self._id))

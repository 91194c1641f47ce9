"""The graph as a node sees it: asked from the broker, which knows.

Queries are coroutines because the answer is the broker's, taken after everything the node has declared.
"""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, Protocol

from actors.asking import QUERY_TIMEOUT_SEC, answered, connected
from actors.core import Core, in_flight
from actors.diagnostics import Size
from actors.errors import BrokerUnreachable
from actors.qos import QoSProfile
from proto import frames
from proto.codes import EntryKind
from proto.frames import GraphEntry
from proto.names import split_node_name

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

NamesAndTypes = list[tuple[str, list[str]]]

SECOND_LOOK_SEC: Final = 1.0
"""How much longer than asked a wait may take because the broker has not answered at all: one that is there
needs milliseconds."""

FIRST_QUESTION: Final = 1 << 31
"""Ids of questions begin here; those below are the link's."""


@dataclass(frozen=True, kw_only=True, slots=True)
class EndpointInfo:
    """One publisher or subscription of a topic (rclpy's TopicEndpointInfo)."""

    node_name: str
    node_namespace: str
    topic_type: str
    topic_type_hash: str
    endpoint_type: EntryKind
    endpoint_id: int
    """The broker's number for it; stands where ROS 2 has a GID."""
    qos_profile: QoSProfile


@dataclass(slots=True)
class GraphPicture:
    """The graph at one moment."""

    entries: dict[int, GraphEntry] = field(default_factory=dict[int, GraphEntry])
    suspended: dict[int, GraphEntry] = field(default_factory=dict[int, GraphEntry])
    """What has left because its link is silent, and may return."""

    def apply(self, frame: frames.Graph) -> None:
        """Take in a piece or a change."""
        silent = set(frame.suspended)
        for key in frame.removed:
            entry = self.entries.pop(key, None)
            self.suspended.pop(key, None)
            if entry is not None and key in silent:
                self.suspended[key] = entry
        for entry in frame.added:
            self.entries[entry.key] = entry
            self.suspended.pop(entry.key, None)

    def nodes(self) -> list[str]:
        """Return the full names of all nodes, sorted."""
        return sorted(entry.node for entry in self.of_kind(EntryKind.NODE))

    def of_kind(self, *kinds: EntryKind) -> Iterable[GraphEntry]:
        """Return the entries of these kinds."""
        return [entry for entry in self.entries.values() if entry.kind in kinds]

    def names_and_types(self, *kinds: EntryKind, node: str | None = None) -> NamesAndTypes:
        """Return each name with the sorted types seen on it, sorted by name."""
        found: dict[str, set[str]] = {}
        for entry in self.of_kind(*kinds):
            if node is None or entry.node == node:
                found.setdefault(entry.name, set()).update({entry.type_name} - {""})
        return sorted((name, sorted(types)) for name, types in found.items())

    def count(self, kind: EntryKind, name: str) -> int:
        """Return how many endpoints of a kind a name has."""
        return sum(entry.name == name for entry in self.of_kind(kind))

    def endpoints(self, kind: EntryKind, name: str) -> list[EndpointInfo]:
        """Return the endpoints of a kind on a topic."""
        return [_endpoint(entry) for entry in self.of_kind(kind) if entry.name == name]


def _endpoint(entry: GraphEntry) -> EndpointInfo:
    namespace, name = split_node_name(entry.node)
    return EndpointInfo(
        node_name=name,
        node_namespace=namespace,
        topic_type=entry.type_name,
        topic_type_hash=entry.type_hash,
        endpoint_type=EntryKind(entry.kind),
        endpoint_id=entry.key,
        qos_profile=_profile(entry.qos),
    )


def _profile(qos: Mapping[str, object]) -> QoSProfile:
    return QoSProfile.from_wire(qos)


class GraphListener(Protocol):
    """Something that has asked for the graph."""

    def received(self, frame: frames.Graph) -> None:
        """A piece, or a change, has come."""
        ...


class GraphView:
    """Asks the broker for the graph over a node's link."""

    def __init__(self, core: Core) -> None:
        self._core = core
        self._next_id = FIRST_QUESTION
        self.listeners: dict[int, GraphListener] = {}
        """By the id of what they have asked."""
        self._definitions: dict[str, list[asyncio.Future[bytes | None]]] = {}
        core.link.handle(frames.Graph, self._received)
        core.link.handle(frames.Definition, self._described)

    def sizes(self) -> Iterator[Size]:
        """Say how full its maps are."""
        yield Size(name="graph questions", size=len(self.listeners))
        yield Size(name="definitions asked for", size=len(self._definitions))

    def _received(self, frame: frames.Graph) -> None:
        watch = self.listeners.get(frame.watch)
        if watch is not None:
            watch.received(frame)
            self._core.link.wake()

    def _described(self, frame: frames.Definition) -> None:
        for waiter in self._definitions.pop(frame.type_hash, []):
            if not waiter.done():
                waiter.set_result(frame.definition)
        self._core.link.wake()

    async def snapshot(self, timeout_sec: float = QUERY_TIMEOUT_SEC) -> GraphPicture:
        """Return the graph as it is now, what this node has declared included.

        Raises:
            BrokerUnreachable: No broker within `timeout_sec`, or the link broke meanwhile.
        """
        watch = self._open(keep=False)
        await self._wait(lambda: watch.complete, watch, timeout_sec)
        return watch.picture

    async def wait_for(self, condition: Callable[[GraphPicture], bool], timeout_sec: float | None) -> bool:
        """Wait until the graph fulfils a condition; False if `timeout_sec` (None: no limit) passes first.

        A broker that had no time to answer gets a second more to say how things are.
        """
        core, link = self._core, self._core.link
        core.require_loop()
        watch: _Watch | None = None
        try:
            with in_flight():
                async with asyncio.timeout(None if timeout_sec is None else max(0.0, timeout_sec)):
                    while True:
                        if watch is None or watch.session != link.connections:
                            self._close(watch)
                            watch = self._open(keep=True) if link.connected else None
                        if watch is not None and watch.complete and condition(watch.picture):
                            return True
                        await link.changed()
                        core.require_alive()
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
        await connected(self._core, timeout_sec)
        link = self._core.link
        assert link.channel is not None
        session = link.connections
        waiter: asyncio.Future[bytes | None] = self._core.require_loop().create_future()
        self._definitions.setdefault(type_hash, []).append(waiter)
        try:
            link.channel.send(frames.Describe(type_hash))
            await answered(self._core, waiter.done, session, timeout_sec)
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
        link = self._core.link
        try:
            await connected(self._core, timeout_sec)
            if watch.session != link.connections:
                self._ask(watch)
            await answered(self._core, condition, watch.session, timeout_sec)
        finally:
            self._close(watch)

    def _open(self, *, keep: bool) -> _Watch:
        self._next_id += 1
        watch = _Watch(self._next_id, keep=keep)
        self.listeners[watch.id] = watch
        self._ask(watch)
        return watch

    def _ask(self, watch: _Watch) -> None:
        link = self._core.link
        if link.channel is not None:
            watch.session = link.connections
            link.channel.send(frames.Watch(watch.id, watch.keep))

    def _close(self, watch: _Watch | None) -> None:
        if watch is None:
            return
        self.listeners.pop(watch.id, None)
        link = self._core.link
        if watch.keep and link.channel is not None and watch.session == link.connections:
            link.channel.send(frames.Unwatch(watch.id))


class _Watch:
    """One question to the broker."""

    def __init__(self, watch_id: int, *, keep: bool) -> None:
        self.id = watch_id
        self.keep = keep
        self.session = 0
        self.complete = False
        self.picture = GraphPicture()

    def received(self, frame: frames.Graph) -> None:
        """A piece came."""
        self.picture.apply(frame)
        if not frame.more:
            self.complete = True

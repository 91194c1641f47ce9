"""The graph's changes, one after the other: who comes, goes, falls silent and returns.

What is compared is what the consumer has seen with what is there now. So a slow consumer costs no queue: what
came and went meanwhile it does not see, and what it sees adds up to the truth.
"""

from __future__ import annotations

import asyncio
from collections import defaultdict
from enum import Enum
from itertools import count
from typing import TYPE_CHECKING, NamedTuple

from actors.endpoints.context import Entity, NodeContext
from actors.graph.snapshot import GraphSnapshot
from proto import frames
from proto.codes import EntryKind

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from actors.graph.view import GraphListener
    from proto.frames import GraphEntry


class GraphChangeKind(Enum):
    """What has happened to a node or an endpoint."""

    APPEARED = "appeared"
    DISAPPEARED = "disappeared"
    SUSPENDED = "suspended"
    """It is silent, and not in the graph until it RETURNED or, when its link is closed, DISAPPEARED."""
    RETURNED = "returned"


class GraphChange(NamedTuple):
    """One change.

    `entry_kind` says what it is: NODE, PUBLISHER, SUBSCRIPTION, SERVICE or CLIENT; `node` is the full name of
    the node; `name` that of the topic or service, and `type_name` its type, both empty for a node.
    """

    kind: GraphChangeKind
    entry_kind: EntryKind
    node: str
    name: str
    type_name: str


class GraphWatch(Entity):
    """Iterate over the changes of the graph: `async for change in node.watch_graph()`. One consumer.

    It begins with everything that is there, as APPEARED. It goes on over reconnects: what is still there then
    is no change. It ends when it is destroyed, or its node.
    """

    def __init__(self, context: NodeContext, listeners: dict[int, GraphListener]) -> None:
        super().__init__(context)
        self._listeners = listeners
        self.snapshot = GraphSnapshot()
        self._complete = False
        self._restarted = False
        self._seen: dict[int, GraphEntry] = {}
        self._silent: dict[int, GraphEntry] = {}
        self._news = asyncio.Event()
        context.link.add(self)
        listeners[self.id] = self

    def received(self, frame: frames.Graph) -> None:
        """A piece of the graph, or a change, has come."""
        self.snapshot.apply(frame)
        if not frame.more:
            self._complete = True
            self._news.set()

    async def __aiter__(self) -> AsyncIterator[GraphChange]:
        """Iterate."""
        async for changes in self.batches():
            for change in changes:
                yield change

    async def batches(self) -> AsyncIterator[list[GraphChange]]:
        """Iterate over the changes, at each step those that have come together.

        When it yields, `snapshot` is complete, and what they add up to.
        """
        self.context.require_loop()
        while not self.destroyed:
            self._news.clear()
            if self._complete and (changes := self._compare()):
                yield changes
            if not self.destroyed:
                await self._news.wait()

    def _compare(self) -> list[GraphChange]:
        """Return what has changed since the last call."""
        now, suspended = self.snapshot.entries, self.snapshot.suspended
        if self._restarted:
            self._restarted = False
            self._seen, self._silent = _recognized(now, self._seen, self._silent)
        gone = [(key, entry) for key, entry in self._seen.items() if key not in now]
        over = [(key, entry) for key, entry in self._silent.items() if key not in now.keys() | suspended]
        new = [(key, entry) for key, entry in now.items() if key not in self._seen]
        kinds = GraphChangeKind
        changes = [
            *((kinds.SUSPENDED if key in suspended else kinds.DISAPPEARED, entry) for key, entry in gone),
            *((kinds.DISAPPEARED, entry) for _, entry in over),
            *((kinds.RETURNED if key in self._silent else kinds.APPEARED, entry) for key, entry in new),
        ]
        told = self._seen.keys() | self._silent
        self._seen = dict(now)
        self._silent = {key: entry for key, entry in suspended.items() if key in told}
        return [
            GraphChange(kind, EntryKind(entry.kind), entry.node, entry.name, entry.type_name)
            for kind, entry in changes
        ]

    def declaration(self) -> frames.Frame:
        """Endpoint: ask for the graph."""
        self.snapshot = GraphSnapshot()
        self._complete = False
        self._restarted = bool(self._seen or self._silent)
        return frames.Watch(self.id, keep=True)

    def link_lost(self) -> None:
        """Endpoint: nobody knows what is there until there is a broker again."""
        super().link_lost()
        self._complete = False

    def destroy(self) -> None:
        """End the watch, and the iteration."""
        if self.destroyed:
            return
        self.destroyed = True
        self._news.set()
        self.context.entities.pop(self, None)
        self._listeners.pop(self.id, None)
        link = self.context.link
        link.remove(self, announce=False)
        if link.channel is not None:
            link.channel.send(frames.Unwatch(self.id))


def _recognized(now: dict[int, GraphEntry], *before: dict[int, GraphEntry]) -> list[dict[int, GraphEntry]]:
    """Return what was there before under the keys it has now; another broker numbers anew.

    What is not there any more gets keys that nothing has.
    """
    free: defaultdict[tuple[object, ...], list[int]] = defaultdict(list)
    for key, entry in now.items():
        free[entry[1:5]].append(key)
    nobody = count(-1, -1)
    return [
        {free[entry[1:5]].pop(0) if free[entry[1:5]] else next(nobody): entry for entry in entries.values()}
        for entries in before
    ]

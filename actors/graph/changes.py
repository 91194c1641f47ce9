"""The graph's changes: nodes and endpoints that appear, disappear, are suspended or return.

The graph that the consumer has seen is compared with the graph of now. A slow consumer therefore needs no
queue: it does not see endpoints that appeared and disappeared meanwhile, and the changes add up to the graph.
"""

from __future__ import annotations

import asyncio
from collections import defaultdict, deque
from enum import Enum
from itertools import count
from typing import TYPE_CHECKING, ClassVar, NamedTuple

from actors.endpoints.endpoint import Endpoint, Handle
from actors.endpoints.iteration import Iteration
from actors.errors import BrokerUnreachable
from actors.graph.snapshot import GraphSnapshot
from proto.wire import frames
from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    from actors.endpoints.context import NodeContext
    from proto.wire.frames import GraphEntry


class GraphChangeKind(Enum):
    """Kinds of changes of a node or an endpoint."""

    APPEARED = "appeared"
    DISAPPEARED = "disappeared"
    SUSPENDED = "suspended"
    """Its link is silent. It is not in the graph until it RETURNED or, if its link is closed, DISAPPEARED."""
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


class GraphWatch(Handle["_WatchEndpoint"]):
    """Iterates over the changes of the graph, for one consumer. Made by `Node.watch_graph`.

    It begins with everything that exists, as APPEARED. It continues across reconnects: endpoints that still
    exist then are no change. It ends when it is destroyed, or its node.
    """

    def __init__(self, context: NodeContext) -> None:
        super().__init__(_WatchEndpoint(context))

    @property
    def snapshot(self) -> GraphSnapshot:
        """The graph as the broker has reported it so far in this session."""
        return self._endpoint.snapshot

    def __aiter__(self) -> Iteration[GraphChange]:
        """Iterate over the changes, one by one.

        Returns:
            An iterator with `aclose`. One task at a time may use it. A step that is cancelled takes no
            change, and the next step goes on; what one iterator leaves, the next one gets.

        Raises:
            BrokerUnreachable: The broker refuses to report changes (at a step that would wait for it).
            RuntimeError: The node does not run (at the first step).
        """
        return _Changes(self._endpoint)

    def batches(self) -> Iteration[list[GraphChange]]:
        """Iterate over the changes, at each step those that have arrived together.

        When it returns, `snapshot` is complete, and the sum of all changes. It also returns when a session
        has reported the graph, perhaps without a change: then the list is empty.

        Returns:
            An iterator, as above.

        Raises:
            BrokerUnreachable, RuntimeError: As above.
        """
        return _Batches(self._endpoint)


class _Batches(Iteration[list[GraphChange]]):
    def __init__(self, endpoint: _WatchEndpoint) -> None:
        super().__init__()
        self._endpoint = endpoint

    async def __anext__(self) -> list[GraphChange]:
        endpoint = self._endpoint
        while not (self.closed or endpoint.destroyed):
            endpoint.context.require_loop()
            endpoint.news.clear()
            endpoint.read()
            if endpoint.complete and (endpoint.unread or endpoint.session_reported):
                endpoint.session_reported = False
                changes = list(endpoint.unread)
                endpoint.unread.clear()
                return changes
            await endpoint.wait()
        raise StopAsyncIteration

    def _wake(self) -> None:
        self._endpoint.news.set()


class _Changes(Iteration[GraphChange]):
    def __init__(self, endpoint: _WatchEndpoint) -> None:
        super().__init__()
        self._endpoint = endpoint

    async def __anext__(self) -> GraphChange:
        endpoint = self._endpoint
        while not (self.closed or endpoint.destroyed):
            endpoint.context.require_loop()
            endpoint.news.clear()
            # Those that arrived together are compared once: each comparison reads the whole graph.
            if not endpoint.unread:
                endpoint.read()
            if endpoint.unread:
                return endpoint.unread.popleft()
            await endpoint.wait()
        raise StopAsyncIteration

    def _wake(self) -> None:
        self._endpoint.news.set()


class _WatchEndpoint(Endpoint):
    """The runtime's side of a graph watch.

    Attributes:
        snapshot: The graph as the broker has reported it so far.
        complete: Whether that is the whole graph.
        news: Set when there may be changes to report.
        unread: Changes that no iterator has returned yet.
        session_reported: Whether a session's first report is still to be noted by a step of `batches`.
    """

    kind: ClassVar = "graph watch"

    def __init__(self, context: NodeContext) -> None:
        super().__init__(context)
        self.snapshot = GraphSnapshot()
        self.complete = False
        self.news = asyncio.Event()
        self.unread: deque[GraphChange] = deque()
        self.session_reported = False
        # Whether keys may have changed: another broker, or the same one after a restart, numbers its
        # entries afresh.
        self._restarted = False
        # What the consumer has been told, by key. Changes are the difference to it, however long it did not
        # ask.
        self._seen: dict[int, GraphEntry] = {}
        self._suspended: dict[int, GraphEntry] = {}
        context.link.add(self)
        context.link.answers[self.id] = self._received

    def _received(self, frame: frames.Graph) -> None:
        self.snapshot.apply(frame)
        if not frame.more:
            self.complete = True
            self.news.set()

    def refused(self, code: int, text: str) -> None:
        """Let the iteration raise the refusal."""
        super().refused(code, text)
        self.news.set()

    async def wait(self) -> None:
        """Wait until there may be changes to report.

        Raises:
            BrokerUnreachable: The broker of this session refuses to report any.
        """
        if self.refusal:
            raise BrokerUnreachable(f"The broker does not report changes: {self.refusal}")
        await self.news.wait()

    def read(self) -> None:
        """Add the changes since the last call to `unread`, unless the graph is not complete."""
        if self.complete:
            self.unread += self._compare()

    def _compare(self) -> list[GraphChange]:
        now, suspended = self.snapshot.entries, self.snapshot.suspended
        if self._restarted:
            self._restarted = False
            self._seen, self._suspended = _recognized(now, self._seen, self._suspended)
        gone = [(key, entry) for key, entry in self._seen.items() if key not in now]
        # Suspended before, and now neither in the graph nor suspended: its link was closed while it was
        # silent.
        over = [(key, entry) for key, entry in self._suspended.items() if key not in now.keys() | suspended]
        new = [(key, entry) for key, entry in now.items() if key not in self._seen]
        kinds = GraphChangeKind
        changes = [
            *((kinds.SUSPENDED if key in suspended else kinds.DISAPPEARED, entry) for key, entry in gone),
            *((kinds.DISAPPEARED, entry) for _, entry in over),
            *((kinds.RETURNED if key in self._suspended else kinds.APPEARED, entry) for key, entry in new),
        ]
        # An endpoint that appeared and was suspended between two calls was never reported; its end need not
        # be, either.
        reported = self._seen.keys() | self._suspended
        self._seen = dict(now)
        self._suspended = {key: entry for key, entry in suspended.items() if key in reported}
        return [
            GraphChange(kind, EntryKind(entry.kind), entry.node, entry.name, entry.type_name)
            for kind, entry in changes
        ]

    def declaration(self) -> frames.Frame:
        """Ask for the graph."""
        self.snapshot = GraphSnapshot()
        self.complete = False
        self._restarted = bool(self._seen or self._suspended)
        self.session_reported = True
        return frames.Watch(self.id, keep=True)

    def session_ended(self) -> None:
        """Report no changes before another broker has sent the whole graph."""
        super().session_ended()
        # Otherwise the consumer would see everything disappear, and appear again a moment later.
        self.complete = False

    def destroy(self) -> None:
        """End the watch, and the iteration."""
        if self.destroyed:
            return
        self.context.link.require_thread()
        self.destroyed = True
        self.news.set()
        self.context.endpoints.pop(self, None)
        link = self.context.link
        link.answers.pop(self.id, None)
        link.remove(self, announce=False)
        if link.channel is not None:
            link.channel.send(frames.Unwatch(self.id))


def _recognized(now: dict[int, GraphEntry], *before: dict[int, GraphEntry]) -> list[dict[int, GraphEntry]]:
    """Return earlier entries under the keys that they have now, as another broker assigns new keys.

    Entries that no longer exist get keys that no other entry has.
    """
    free: defaultdict[tuple[object, ...], list[int]] = defaultdict(list)
    for key, entry in now.items():
        # Without key and QoS: what users would call the same endpoint. Several that are equal are matched
        # in any order.
        free[entry[1:5]].append(key)
    # Keys of brokers are not negative.
    unused = count(-1, -1)
    return [
        {free[entry[1:5]].pop(0) if free[entry[1:5]] else next(unused): entry for entry in entries.values()}
        for entries in before
    ]

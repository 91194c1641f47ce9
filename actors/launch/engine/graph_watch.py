"""The broker's graph as a launch sees it: which nodes, topics and services are there.

A hidden node follows the graph in a task of its own, so that a launch goes on if the broker fails. While the
link is down the last snapshot stays valid: most nodes are likely to be alive, and event handlers must not
react to their appearance a second time.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING

from actors.launch.planning.presence import Presence, presence_of
from actors.logging.logger import get_logger
from actors.logging.severity import LoggingSeverity
from actors.tools.hidden_node import make_hidden_node
from proto.aio.tasks import cancel_and_wait, keep_running
from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator, Callable

    from actors.config.contexts import BrokerTarget
    from actors.graph.snapshot import GraphSnapshot


@asynccontextmanager
async def graph_watch(
    target: BrokerTarget, name: str, on_change: Callable[[set[Presence]], None]
) -> AsyncGenerator[None]:
    """Report the nodes, topics and services in the graph whenever they change.

    Entering does not wait for the broker. The context goes on if the broker is unreachable, or refuses the
    node. Leaving takes two seconds at most.

    Args:
        target: The broker, and the domain.
        name: The name of the watching node. Hidden nodes of the launch, whose names begin with it, are left
            out.
        on_change: Called with all that are in the graph, a new set each time. It must not block.
    """
    watch = keep_running("The launch's watch of the graph", lambda: _watch(target, name, on_change))
    watching = asyncio.create_task(watch, name="launch graph")
    try:
        yield
    finally:
        await cancel_and_wait(watching)


async def _watch(target: BrokerTarget, name: str, on_change: Callable[[set[Presence]], None]) -> None:
    node = make_hidden_node(name, url=target.url, domain=target.domain)
    node.get_logger().set_level(LoggingSeverity.FATAL)  # the launch reports an unreachable broker
    # Without the launch's own nodes: a dependency on their services would be met by the launch itself.
    known = Presences(own_node=node.get_fully_qualified_name())
    try:
        async with node:
            watch = node.watch_graph()
            async for _ in watch.batches():
                if known.follow(watch.snapshot):
                    on_change(known.now)
    except CallboardError as error:
        get_logger("launch").warning(f"cannot see which nodes are there: {error}")


class Presences:
    """The nodes, topics and services in the graph, from its snapshots.

    Each entry is read once. An update compares the ids of all entries, which takes some milliseconds for
    20,000. Changes that arrive together are one update.

    Args:
        own_node: Nodes whose names begin with this, and their endpoints, are left out.

    Attributes:
        now: The current set. An update replaces it and does not change it, so that callers may keep it.
    """

    def __init__(self, *, own_node: str) -> None:
        self.now: set[Presence] = set()
        self._own_node = own_node
        self._snapshot: GraphSnapshot | None = None
        self._seen: dict[int, Presence | None] = {}
        """By the broker's id of the entry; None for other entries, and for the launch's own."""
        self._counts: Counter[Presence] = Counter()
        """Number of entries: a topic is there while it has at least one publisher."""

    def follow(self, snapshot: GraphSnapshot) -> bool:
        """Update `now` from a complete snapshot, and return whether it has changed."""
        if snapshot is not self._snapshot:  # another session with the broker: ids may mean other entries
            self._snapshot = snapshot
            self._seen.clear()
            self._counts.clear()
        entries, seen = snapshot.entries, self._seen
        for key in seen.keys() - entries.keys():
            if (gone := seen.pop(key)) is not None:
                self._counts[gone] -= 1
                if not self._counts[gone]:
                    del self._counts[gone]
        for key in entries.keys() - seen.keys():
            entry = entries[key]
            new = seen[key] = None if entry.node.startswith(self._own_node) else presence_of(entry)
            if new is not None:
                self._counts[new] += 1
        if self._counts.keys() == self.now:
            return False
        self.now = set(self._counts)
        return True

"""The broker's graph as a launch sees it: which nodes, topics and services are there.

A hidden node follows the graph in a task of its own, so that a launch goes on if the broker fails. While the
link is down the last snapshot stays valid, because most nodes are likely to live.
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
    """Report what the graph has whenever that changes, without the nodes of the launch itself.

    Entering waits for nothing. A broker that is unreachable, or refuses the node, does not end the context.
    Leaving takes two seconds at most.

    Args:
        target: The broker, and the number of its graph.
        name: Of the watching node; the launch's other nodes have names that begin with it.
        on_change: Gets all that is there; each time another set. It must not wait.
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
    """The nodes, topics and services in snapshots of the graph.

    Each entry is read once. An update compares the numbers of all entries: some milliseconds for 20,000.
    Changes that arrive together are one update.

    Args:
        own_node: Nodes whose names begin with this one are left out, with what they have.

    Attributes:
        now: All that is there. It is not changed: later there is another set.
    """

    def __init__(self, *, own_node: str) -> None:
        self.now: set[Presence] = set()
        self._own_node = own_node
        self._snapshot: GraphSnapshot | None = None
        self._seen: dict[int, Presence | None] = {}
        """By the broker's number of the entry."""
        self._counts: Counter[Presence] = Counter()
        """How many entries there are of each."""

    def follow(self, snapshot: GraphSnapshot) -> bool:
        """Take in a complete snapshot; return whether `now` has changed."""
        if snapshot is not self._snapshot:  # another session: the numbers may mean something else
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

"""What all Foxglove clients of one user share: channels, services, connections, the clock."""

from __future__ import annotations

import asyncio
from collections import Counter
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final, Protocol

from actors.web.foxglove.catalogue import Catalogue
from actors.web.foxglove.clock import Clock
from actors.web.foxglove.parameters import Parameters
from actors.web.foxglove.session import Connections
from actors.web.parameter_nodes import ParameterNodes
from actors.web.worker import TooMuchWorkError
from proto.aio.tasks import keep_running
from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    from collections.abc import Generator, Mapping

    from actors.graph.snapshot import GraphSnapshot
    from actors.web.foxglove.catalogue import Declared
    from actors.web.workspace import Workspace


BUSY_SEC: Final = 0.5
"""Seconds until the graph is looked at again, if the thread for long work had no room."""


class GraphClient(Protocol):
    """A client, as the graph knows it."""

    def graph_changed(self) -> None:
        """Channels, services or connections have changed."""
        ...

    def clock_changed(self) -> None:
        """The clock has begun, ended, or moved."""
        ...

    def parameter_changed(self, name: str, value: Mapping[str, Any]) -> None:
        """A parameter has another value."""
        ...


class FoxgloveGraph:
    """The graph as Foxglove's clients see it, kept up to date while there is one.

    Args:
        workspace: Of the user.

    Attributes:
        catalogue: Channels and services.
        connections: Who is connected to whom.
        clock: Simulated time.
        parameters: Those of all nodes.
    """

    def __init__(self, workspace: Workspace) -> None:
        observer, feeds = workspace.observer, workspace.feeds
        self._observer = observer
        self.catalogue = Catalogue(workspace.types, workspace.work)
        self.connections = Connections()
        self._news = asyncio.Event()
        self.clock = Clock(observer, feeds, self._clock_changed, self._news.set)
        self.parameters = Parameters(
            observer, workspace.shared(ParameterNodes), feeds, self._parameter_changed
        )
        self._clients: dict[GraphClient, None] = {}
        self._published: Counter[Declared] = Counter()
        self._seen: GraphSnapshot | None = None

    @contextmanager
    def client(self, client: GraphClient) -> Generator[None]:
        """Tell a client what has changed as long as the context; the last one ends the watch."""
        if not self._clients:
            self._begin()
        self._clients[client] = None
        self._news.set()
        try:
            yield
        finally:
            del self._clients[client]
            if not self._clients:
                self._end()

    @contextmanager
    def published(self, declared: Declared) -> Generator[None]:
        """Show what a client publishes as long as the context: the graph leaves out this process's nodes."""
        self._published[declared] += 1
        self._news.set()
        try:
            yield
        finally:
            self._published[declared] -= 1
            if not self._published[declared]:
                del self._published[declared]
            self._news.set()

    def _begin(self) -> None:
        self._end_watch = self._observer.on_graph(self._news.set)
        self._task = asyncio.get_running_loop().create_task(
            keep_running("The catalogue for Foxglove", self._follow)
        )

    def _end(self) -> None:
        self._end_watch()
        self._task.cancel()
        self.clock.close()
        self.parameters.close()

    async def _follow(self) -> None:
        while True:
            await self._news.wait()
            self._news.clear()
            try:
                await self._update()
            except TooMuchWorkError:  # for clients of this user
                self._news.set()
                await asyncio.sleep(BUSY_SEC)

    async def _update(self) -> None:
        snapshot = self._observer.snapshot
        self.clock.follow()
        await self.catalogue.update(snapshot, [*self._published])
        if snapshot is not self._seen:
            self.connections = await self._observer.work.run(connections_of, snapshot)
            self._seen = snapshot
        for each in tuple(self._clients):
            each.graph_changed()

    def _parameter_changed(self, name: str, value: Mapping[str, Any]) -> None:
        for each in self._clients:
            each.parameter_changed(name, value)

    def _clock_changed(self) -> None:
        for each in self._clients:
            each.clock_changed()


def connections_of(snapshot: GraphSnapshot) -> Connections:
    """Return who publishes, subscribes and serves, as Foxglove draws it.

    Args:
        snapshot: The graph.
    """
    return Connections(
        *(
            _nodes_by_name(snapshot, kind)
            for kind in (EntryKind.PUBLISHER, EntryKind.SUBSCRIPTION, EntryKind.SERVICE)
        )
    )


def _nodes_by_name(snapshot: GraphSnapshot, kind: EntryKind) -> dict[str, tuple[str, ...]]:
    found: dict[str, set[str]] = {}
    for each in snapshot.of_kind(kind):
        found.setdefault(each.name, set()).add(each.node)
    return {name: tuple(sorted(nodes)) for name, nodes in found.items()}

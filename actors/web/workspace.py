"""A workspace: a node with the rights of one user, and everything that works through it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar

from actors.tools.graph_types import GraphTypes
from actors.web.calls import Calls
from actors.web.documents import Documents
from actors.web.goals import Goals
from actors.web.images import Images
from actors.web.live.panels import Panels
from actors.web.metrics import Metrics
from actors.web.probes import RoundTrips
from actors.web.topic_feed import TopicFeeds

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.web.observer import Observer

T = TypeVar("T")


class Workspace:
    """Everything with which the server reads and controls the graph for one user.

    Args:
        observer: Watches the graph with the user's rights; entered, and left, by the caller.

    Attributes:
        observer: The same.
        work: The user's share of the thread for long work.
        documents: Those of the whole graph.
        feeds: The topics that are read.
        images: The newest images of topics.
        panels: Makes the panels of pages.
        types: The message classes of the graph.
        calls: Calls services and publishes.
        goals: Sends goals, and follows them.
        metrics: The content of `/metrics`.
        round_trips: Measures round trips to the broker for the metrics.
    """

    def __init__(self, observer: Observer) -> None:
        self.observer = observer
        self.work = observer.work
        self.documents = Documents(observer.work)
        self.feeds = TopicFeeds(observer)
        self.images = Images(self.feeds, observer.worker)
        self.panels = Panels(observer, self.feeds)
        self.types = GraphTypes(observer.node, self.work.run)
        self.calls = Calls(observer, self.types)
        self.goals = Goals(observer, self.types)
        self.metrics = Metrics()
        self.round_trips = RoundTrips(observer.node, self.metrics.round_trips)
        self._shared: dict[Callable[[Workspace], Any], Any] = {}

    def shared(self, make: Callable[[Workspace], T]) -> T:
        """Return what all clients of a live tool have in common, of this user.

        Args:
            make: Returns it; called for the first client.
        """
        if make not in self._shared:
            self._shared[make] = make(self)
        found: T = self._shared[make]
        return found

    async def close(self) -> None:
        """End goals, images and round trips that are under way."""
        await self.round_trips.close()
        await self.goals.close()
        await self.images.close()

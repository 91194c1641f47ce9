"""One topic: who publishes and subscribes, and how much goes over it."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from actors.tools import graph_documents
from actors.web.live.panel import DocumentPanel

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.web.observer import Observer


class TopicPanel(DocumentPanel):
    """A topic as `callboard topic info --json` prints it, with its rates.

    Args:
        observer: Watches the graph.
        topic: The full name; the topic need not exist.
        wake: See `DocumentPanel`.
    """

    def __init__(self, observer: Observer, topic: str, wake: Callable[[], None]) -> None:
        self._observer = observer
        self._topic = topic
        super().__init__(wake, observer.on_graph, observer.on_sample)

    def document(self) -> dict[str, Any]:
        """Return the topic, and `rates` as in the overview; nothing if there is no such topic."""
        observer = self._observer
        found = graph_documents.topic(observer.around(self._topic), self._topic, observer.broker_names())
        if found is None:
            return {}
        rows = () if observer.overview is None else observer.overview.topics
        rates = next((asdict(row) for row in rows if row.name == self._topic), None)
        return {**found, "rates": rates}

"""One service or action: its type, its servers and its clients."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actors.web.live.panel import DocumentPanel

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.graph.snapshot import GraphSnapshot
    from actors.tools.broker_names import BrokerNames
    from actors.web.observer import Observer

    Find = Callable[[GraphSnapshot, str, BrokerNames | None], dict[str, Any] | None]


class EntryPanel(DocumentPanel):
    """A service or action, as `callboard service info --json` or `action info --json` prints it.

    Args:
        observer: Watches the graph.
        find: Returns the document; see `graph_documents`.
        name: The full name; it need not exist.
        wake: See `DocumentPanel`.
    """

    def __init__(self, observer: Observer, find: Find, name: str, wake: Callable[[], None]) -> None:
        self._observer = observer
        self._find = find
        self._name = name
        super().__init__(wake, observer.on_graph)

    def document(self) -> dict[str, Any]:
        """Return the document; nothing if there is no such service or action."""
        observer = self._observer
        return self._find(observer.around(self._name), self._name, observer.broker_names()) or {}

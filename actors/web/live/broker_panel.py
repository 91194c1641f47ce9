"""Whether there is a broker."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actors.web.live.panel import DocumentPanel

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.web.observer import Observer


class BrokerPanel(DocumentPanel):
    """The server's connection with the broker, which every view of the page depends on.

    Args:
        observer: Has the connection.
        wake: See `DocumentPanel`.
    """

    def __init__(self, observer: Observer, wake: Callable[[], None]) -> None:
        self._observer = observer
        super().__init__(wake, observer.on_sample)

    def document(self) -> dict[str, Any]:
        """Return `connected` and `target`."""
        return {"connected": self._observer.connected, "target": self._observer.target}

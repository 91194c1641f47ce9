"""The tables of topics, nodes and services, with their rates."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from actors.web.live.panel import DocumentPanel

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.web.observer import Observer


class OverviewPanel(DocumentPanel):
    """The overview, as `callboard top --json` prints it, with rows by name.

    Args:
        observer: Takes the samples.
        wake: See `DocumentPanel`.
    """

    def __init__(self, observer: Observer, wake: Callable[[], None]) -> None:
        self._observer = observer
        super().__init__(wake, observer.on_sample)

    def document(self) -> dict[str, Any]:
        """Return `connected`, `target`, `totals`, and maps of `topics`, `nodes` and `services`.

        Nodes also have `duplicate`: whether nodes of several brokers have the name, and not all share it.
        """
        observer = self._observer
        found: dict[str, Any] = {"connected": observer.connected, "target": observer.target}
        seen = observer.overview
        if seen is not None:
            found["totals"] = seen.totals.as_dict()
            found["topics"] = {row.name: asdict(row) for row in seen.topics}
            duplicates = observer.snapshot.duplicate_nodes()
            found["nodes"] = {
                f"{row.name} {row.link}" if row.shared else row.name: {
                    **asdict(row),
                    "duplicate": row.name in duplicates,
                }
                for row in seen.nodes
            }
            found["services"] = {row.name: asdict(row) for row in seen.services}
        return found

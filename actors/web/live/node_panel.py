"""One node: its endpoints, its link, and what it tells about itself."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from actors.tools.graph_documents import endpoint
from actors.web.live.panel import DocumentPanel

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.web.node_watch import NodeWatches
    from actors.web.observer import Observer


class NodePanel(DocumentPanel):
    """One node.

    Args:
        observer: Watches the graph.
        nodes: Ask nodes about themselves.
        name: The full name; the node need not exist.
        wake: See `DocumentPanel`.

    Raises:
        TooManyNodesError, TooManyTopicsError: See `NodeWatches.watch`.
    """

    def __init__(self, observer: Observer, nodes: NodeWatches, name: str, wake: Callable[[], None]) -> None:
        self._observer = observer
        self._name = name
        self._watch = nodes.watch(name)
        super().__init__(wake, observer.on_graph, observer.on_sample, self._watch.listen)

    def document(self) -> dict[str, Any]:
        """Return what is known of the node.

        `exists`; `duplicate`; `labels`, null for none; `links`: its rows of the overview by the link's
        number; `endpoints` by their number: `kind`, `name` and what `callboard topic info --json` prints;
        and, where the node serves them, `diagnostics`, `lifecycle`, `parameters`, and why one of them could
        not be had in `errors`.
        """
        observer, name = self._observer, self._name
        snapshot = observer.around(name)
        names = observer.broker_names()
        endpoints = {
            str(info.endpoint_id): {
                "kind": info.endpoint_type.name.lower(),
                "name": each,
                **endpoint(info, names),
            }
            for each, info in snapshot.node_endpoints(name)
        }
        rows = () if observer.overview is None else observer.overview.nodes
        return {
            "exists": name in snapshot.nodes(),
            "duplicate": name in snapshot.duplicate_nodes(),
            "labels": snapshot.node_labels().get(name),
            "links": {str(row.link): asdict(row) for row in rows if row.name == name},
            "endpoints": endpoints,
            **self._watch.parts,
        }

"""The names of the hidden nodes of this process, so that the page does not show itself."""

from __future__ import annotations

from collections import Counter
from typing import Final

from actors.graph.snapshot import GraphSnapshot
from actors.tools.hidden_node import hidden_name
from proto.wire.codes import EntryKind


class NodeNames:
    """Names for nodes, each used by one at a time, and again later: `logging` never forgets a name."""

    def __init__(self) -> None:
        self._prefix = hidden_name("callboard_web")
        self._free: list[str] = []
        self._used: set[str] = set()

    def acquire(self) -> str:
        """Return a name for one more node."""
        name = self._free.pop() if self._free else f"{self._prefix}_{len(self._used)}"
        self._used.add(name)
        return name

    def release(self, name: str) -> None:
        """Take back the name of a node that has ended; nothing if it has been taken back.

        Args:
            name: As returned by `acquire`.
        """
        if name in self._used:
            self._used.remove(name)
            self._free.append(name)

    def __contains__(self, full_name: str) -> bool:
        """Return whether a node has one of these names."""
        return full_name.removeprefix("/") in self._used

    def without_own(self, snapshot: GraphSnapshot) -> GraphSnapshot:
        """Return the graph without the nodes of this process.

        A name is known to everybody who sees the node, and may be shared. If another node has it, too,
        nothing of that name is left out: who is who cannot be told, and nobody may hide here.

        Args:
            snapshot: The graph.
        """
        nodes = Counter(entry.node for entry in snapshot.of_kind(EntryKind.NODE))
        hidden = {full for name in self._used if nodes[full := f"/{name}"] == 1}
        entries = {key: entry for key, entry in snapshot.entries.items() if entry.node not in hidden}
        return GraphSnapshot(entries, dict(snapshot.suspended))


NODE_NAMES: Final = NodeNames()
"""Of all nodes of this process: those of one user are not shown to others, either."""

"""The graph at one moment, as data: what `Node.get_graph` and `Inspector.graph` return."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from actors.qos import QoSProfile
from proto.codes import EntryKind
from proto.frames import GraphEntry
from proto.names import split_node_name

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from proto import frames

NamesAndTypes = list[tuple[str, list[str]]]


@dataclass(frozen=True, kw_only=True, slots=True)
class EndpointInfo:
    """One publisher or subscription of a topic (rclpy's TopicEndpointInfo)."""

    node_name: str
    node_namespace: str
    topic_type: str
    topic_type_hash: str
    endpoint_type: EntryKind
    endpoint_id: int
    """The broker's number for it; stands where ROS 2 has a GID."""
    qos_profile: QoSProfile


@dataclass(slots=True)
class GraphPicture:
    """The graph at one moment."""

    entries: dict[int, GraphEntry] = field(default_factory=dict[int, GraphEntry])
    suspended: dict[int, GraphEntry] = field(default_factory=dict[int, GraphEntry])
    """What has left because its link is silent, and may return."""

    def apply(self, frame: frames.Graph) -> None:
        """Take in a piece or a change."""
        silent = set(frame.suspended)
        for key in frame.removed:
            entry = self.entries.pop(key, None)
            self.suspended.pop(key, None)
            if entry is not None and key in silent:
                self.suspended[key] = entry
        for entry in frame.added:
            self.entries[entry.key] = entry
            self.suspended.pop(entry.key, None)

    def nodes(self) -> list[str]:
        """Return the full names of all nodes, sorted."""
        return sorted(entry.node for entry in self.of_kind(EntryKind.NODE))

    def of_kind(self, *kinds: EntryKind) -> Iterable[GraphEntry]:
        """Return the entries of these kinds."""
        return [entry for entry in self.entries.values() if entry.kind in kinds]

    def names_and_types(self, *kinds: EntryKind, node: str | None = None) -> NamesAndTypes:
        """Return each name with the sorted types seen on it, sorted by name."""
        found: dict[str, set[str]] = {}
        for entry in self.of_kind(*kinds):
            if node is None or entry.node == node:
                found.setdefault(entry.name, set()).update({entry.type_name} - {""})
        return sorted((name, sorted(types)) for name, types in found.items())

    def count(self, kind: EntryKind, name: str) -> int:
        """Return how many endpoints of a kind a name has."""
        return sum(entry.name == name for entry in self.of_kind(kind))

    def endpoints(self, kind: EntryKind, name: str) -> list[EndpointInfo]:
        """Return the endpoints of a kind on a topic."""
        return [_endpoint(entry) for entry in self.of_kind(kind) if entry.name == name]


def _endpoint(entry: GraphEntry) -> EndpointInfo:
    namespace, name = split_node_name(entry.node)
    return EndpointInfo(
        node_name=name,
        node_namespace=namespace,
        topic_type=entry.type_name,
        topic_type_hash=entry.type_hash,
        endpoint_type=EntryKind(entry.kind),
        endpoint_id=entry.key,
        qos_profile=_profile(entry.qos),
    )


def _profile(qos: Mapping[str, object]) -> QoSProfile:
    return QoSProfile.from_wire(qos)

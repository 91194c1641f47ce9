"""The graph at one moment, as data: what `Node.get_graph` and `Inspector.graph` return."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from actors.qos.profile import UNLIMITED, HistoryPolicy, QoSProfile
from actors.time.types import INFINITE
from proto.errors import ErrorCode, ProtocolError
from proto.untrusted_text import peer_name
from proto.wire.codes import EntryKind
from proto.wire.frames import GraphEntry
from proto.wire.labels import NODE_KEY, labels_of
from proto.wire.names import split_node_name

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from actors.time.types import Duration
    from proto.wire import frames
    from proto.wire.frames import Scalar

NamesAndTypes = list[tuple[str, list[str]]]

MAX_ENTRIES: Final = 500_000
"""Entries of a graph, or of a report about a broker; more than any broker has."""

_ENDPOINT_TYPES: Final = {
    EntryKind.NODE: "INVALID",
    EntryKind.PUBLISHER: "PUBLISHER",
    EntryKind.SUBSCRIPTION: "SUBSCRIPTION",
    EntryKind.SERVICE: "SERVER",
    EntryKind.CLIENT: "CLIENT",
}


@dataclass(frozen=True, kw_only=True, slots=True)
class EndpointInfo:
    """One publisher or subscription of a topic, or one server or client of a service.

    rclpy's TopicEndpointInfo: `str` returns ROS 2's lines, which `topic info -v` prints. For a service the
    attributes named after topics are the service's.
    """

    node_name: str
    node_namespace: str
    topic_type: str
    topic_type_hash: str
    endpoint_type: EntryKind
    endpoint_id: int
    """The broker's number for it, in place of ROS 2's GID."""
    qos_profile: QoSProfile
    strict_qos: bool = False
    """Whether it matches none with which its QoS is incompatible."""
    broker: int = 0
    """The number of its broker in the mesh, a key of `BrokerReport.brokers`; 0 without a mesh."""
    node_labels: Mapping[str, str] = field(default_factory=dict[str, str])
    """The labels of its node."""

    def __str__(self) -> str:
        """Return 14 lines, as rclpy does; one more for a strict endpoint, and for labels of its node."""
        what = "Service" if self.endpoint_type in {EntryKind.SERVICE, EntryKind.CLIENT} else "Topic"
        qos = self.qos_profile
        keeps_last = qos.history is HistoryPolicy.KEEP_LAST
        history = f"{qos.history.name} ({qos.depth})" if keeps_last else qos.history.name
        return "\n".join(
            [
                f"Node name: {self.node_name}",
                f"Node namespace: {self.node_namespace}",
                *([f"Node labels: {labels_text(self.node_labels)}"] if self.node_labels else []),
                f"{what} type: {self.topic_type}",
                f"{what} type hash: {self.topic_type_hash or 'INVALID'}",
                f"Endpoint type: {_ENDPOINT_TYPES[self.endpoint_type]}",
                f"GID: {self.endpoint_id}",
                "QoS profile:",
                f"  Reliability: {qos.reliability.name}",
                f"  History (Depth): {history}",
                f"  Durability: {qos.durability.name}",
                f"  Lifespan: {_duration(qos.lifespan)}",
                f"  Deadline: {_duration(qos.deadline)}",
                f"  Liveliness: {qos.liveliness.name}",
                f"  Liveliness lease duration: {_duration(qos.liveliness_lease_duration)}",
                *(["  Strict: incompatible endpoints do not match"] if self.strict_qos else []),
            ]
        )


@dataclass(slots=True)
class GraphSnapshot:
    """The graph at one moment."""

    entries: dict[int, GraphEntry] = field(default_factory=dict[int, GraphEntry])
    suspended: dict[int, GraphEntry] = field(default_factory=dict[int, GraphEntry])
    """Entries that left because their link is silent, and may return."""

    def apply(self, frame: frames.Graph) -> None:
        """Apply a part of the graph, or a change.

        Args:
            frame: The frame that the broker has sent.

        Raises:
            ProtocolError: The graph has more than 500,000 entries.
        """
        silent = set(frame.suspended)
        # Removals first: a key may be removed and added again in one frame.
        for key in frame.removed:
            entry = self.entries.pop(key, None)
            self.suspended.pop(key, None)
            # An endpoint that this snapshot never had cannot return to it.
            if entry is not None and key in silent:
                self.suspended[key] = entry
        for added in frame.added:
            # Once for each entry that arrives, not each time it is printed.
            entry = _printable(added)
            self.entries[entry.key] = entry
            self.suspended.pop(entry.key, None)
        require_few(len(self.entries) + len(self.suspended))

    def nodes(self) -> list[str]:
        """Return the full names of all nodes.

        Returns:
            The names, sorted; a name that nodes share occurs once for each of them.
        """
        return sorted(entry.node for entry in self.of_kind(EntryKind.NODE))

    def duplicate_nodes(self) -> dict[str, list[int]]:
        """Return the names that nodes of several brokers have, although not all of them share it.

        Returns:
            By name, the numbers of their brokers, one for each node, sorted.
        """
        # Names that some node holds for itself. If all that have a name share it, that is no mistake.
        unique = {entry.node for entry in self.of_kind(EntryKind.NODE) if entry.qos.get("shared") is not True}
        return {
            name: brokers
            for name, brokers in self.node_brokers().items()
            if len(brokers) > 1 and name in unique
        }

    def node_brokers(self) -> dict[str, list[int]]:
        """Return on which brokers of the mesh nodes are.

        Returns:
            By full name, the numbers of the brokers, one for each node that has it, sorted; zeros without a
            mesh.
        """
        found: dict[str, list[int]] = {}
        for entry in sorted(self.of_kind(EntryKind.NODE), key=lambda entry: (entry.node, entry.broker)):
            found.setdefault(entry.node, []).append(entry.broker)
        return found

    def of_kind(self, *kinds: EntryKind) -> Iterable[GraphEntry]:
        """Return the entries of some kinds.

        Args:
            kinds: The kinds.

        Returns:
            The entries, in no particular order.
        """
        return [entry for entry in self.entries.values() if entry.kind in kinds]

    def names_and_types(self, *kinds: EntryKind, node: str | None = None) -> NamesAndTypes:
        """Return the names that entries of some kinds have.

        Args:
            kinds: The kinds.
            node: Only entries of the node with this full name.

        Returns:
            Pairs of a name and its sorted types, sorted by name.
        """
        found: dict[str, set[str]] = {}
        for entry in self.of_kind(*kinds):
            if node is None or entry.node == node:
                found.setdefault(entry.name, set()).update({entry.type_name} - {""})
        return sorted((name, sorted(types)) for name, types in found.items())

    def count(self, kind: EntryKind, name: str) -> int:
        """Return how many endpoints of a kind a name has.

        Args:
            kind: The kind.
            name: The full name of a topic or service.

        Returns:
            The number; 0 if there is no such name.
        """
        return sum(entry.name == name for entry in self.of_kind(kind))

    def endpoints(self, kind: EntryKind, name: str) -> list[EndpointInfo]:
        """Return the endpoints of a kind on a topic or service.

        Args:
            kind: The kind.
            name: The full name of the topic or service.

        Returns:
            One record for each, in the order of their declaration.
        """
        found = [self._endpoint(entry) for entry in self.of_kind(kind) if entry.name == name]
        return sorted(found, key=lambda endpoint: endpoint.endpoint_id)

    def node_endpoints(self, node: str) -> list[tuple[str, EndpointInfo]]:
        """Return the endpoints of a node, or of all nodes that share its name.

        Args:
            node: The full name of the node.

        Returns:
            The full name of a topic or service and the endpoint, for each, in the order of their declaration.
        """
        found = [
            (entry.name, self._endpoint(entry))
            for entry in self.entries.values()
            if entry.node == node and entry.kind != EntryKind.NODE
        ]
        return sorted(found, key=lambda each: each[1].endpoint_id)

    def all_endpoints(self) -> list[tuple[str, EndpointInfo]]:
        """Return the endpoints of all nodes.

        Returns:
            The full name of a topic or service and the endpoint, for each, in the order of their declaration.
        """
        found = [(entry.name, self._endpoint(entry)) for entry in self.entries.values() if entry.kind]
        return sorted(found, key=lambda each: each[1].endpoint_id)

    def labels_of(self, entry: GraphEntry) -> dict[str, str]:
        """Return the labels of a node, or of the node that an endpoint belongs to.

        Args:
            entry: One of this snapshot.

        Returns:
            Texts by name; none if the node has no labels, or the broker is older than labels.
        """
        if entry.kind != EntryKind.NODE:
            key = entry.qos.get(NODE_KEY)
            node = self.entries.get(key) if isinstance(key, int) else None
            return {} if node is None else labels_of(node)
        return labels_of(entry)

    def node_labels(self) -> dict[str, dict[str, str]]:
        """Return the labels of all nodes that have some.

        Returns:
            By full name, the labels. If nodes share the name, a label has the values of all of them,
            sorted, with commas between them.
        """
        found: dict[str, dict[str, set[str]]] = {}
        for entry in self.of_kind(EntryKind.NODE):
            for label, text in labels_of(entry).items():
                found.setdefault(entry.node, {}).setdefault(label, set()).add(text)
        return {
            node: {label: ", ".join(sorted(texts)) for label, texts in sorted(labels.items())}
            for node, labels in found.items()
        }

    def _endpoint(self, entry: GraphEntry) -> EndpointInfo:
        namespace, name = split_node_name(entry.node)
        return EndpointInfo(
            node_name=name,
            node_namespace=namespace,
            topic_type=entry.type_name,
            topic_type_hash=entry.type_hash,
            endpoint_type=EntryKind(entry.kind),
            endpoint_id=entry.key,
            qos_profile=QoSProfile.from_wire(entry.qos),
            strict_qos=entry.qos.get("strict") is True,
            broker=entry.broker,
            node_labels=self.labels_of(entry),
        )


def _printable(entry: GraphEntry) -> GraphEntry:
    """Return an entry whose names cannot forge lines, whatever the broker has accepted."""
    names = entry[2:6]
    if entry.kind == EntryKind.NODE and entry.qos:
        entry = entry._replace(qos=_printable_labels(entry.qos))
    # One test of all four names: nearly every entry passes, and a graph may have 500,000.
    if "".join(names).isprintable():
        return entry
    node, name, type_name, type_hash = map(peer_name, names)
    return entry._replace(node=node, name=name, type_name=type_name, type_hash=type_hash)


def _printable_labels(qos: Mapping[str, Scalar]) -> dict[str, Scalar]:
    """Return a node's qos map, with its labels likewise."""
    return {
        peer_name(key): peer_name(value) if isinstance(value, str) else value for key, value in qos.items()
    }


def labels_text(labels: Mapping[str, str]) -> str:
    """Return labels in one line.

    Args:
        labels: Texts by name.

    Returns:
        Such as "origin=ros2/7, role=bridge"; "" for none.
    """
    return ", ".join(f"{name}={text}" for name, text in labels.items())


def require_few(entries: int) -> None:
    """Raise ProtocolError if a broker's answer has too many entries."""
    if entries > MAX_ENTRIES:
        raise ProtocolError(ErrorCode.LIMIT, f"the broker's answer has more than {MAX_ENTRIES} entries")


_SEND_GOAL: Final = "/_action/send_goal"
"""The suffix of an action's name in the name of the service that accepts its goals."""


def actions_among(services: NamesAndTypes) -> NamesAndTypes:
    """Return the actions that services, of servers or of clients, belong to, with their types."""
    return [
        (name.removesuffix(_SEND_GOAL), [each.removesuffix("_SendGoal") for each in types])
        for name, types in services
        if name.endswith(_SEND_GOAL)
    ]


def _duration(limit: Duration) -> str:
    return str(INFINITE if limit == UNLIMITED else limit)

"""What one side of a bridge shows: its nodes and their endpoints, as data.

A bridge has two sides, "ours" (callboard's graph) and "theirs" (the other network). Both are read into a
`SideGraph`, from which `plan.py` decides what to show where.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Final, NamedTuple

from actors.bridges.report import Reason, Refusal
from actors.qos.profile import QoSProfile
from proto.wire.codes import EntryKind
from proto.wire.labels import NODE_KEY

if TYPE_CHECKING:
    from collections.abc import Mapping

    from actors.graph.snapshot import GraphSnapshot
    from proto.wire.frames import Scalar

ORIGIN_LABEL: Final = "origin"
"""Label of a mirror in callboard's graph: the network that its original is in, such as "ros2/7"."""
BRIDGE_LABEL: Final = "bridge"
"""Label of a bridge's control node: the network that it is connected to."""
BRIDGE_ID_LABEL: Final = "bridge_id"
"""Label of a bridge's control node: the id of the bridge, by which the other network shows it as well."""
BRIDGE_STATE_LABEL: Final = "bridge_state"
"""Label of the node by which a bridge says that it is active, beside the two above."""

BRIDGE_APART: Final = "bridge"
"""The `apart` of all bridges' nodes in callboard: no mirror receives from another mirror, so that nothing
that has crossed one bridge crosses another one."""

_TOPICS: Final = frozenset({EntryKind.PUBLISHER, EntryKind.SUBSCRIPTION})


class SideNode(NamedTuple):
    """One node of a side.

    Attributes:
        name: Its full name.
        origin: "" if it is native; otherwise whose mirror it is. A bridge's own nodes are not native either.
        shared: Whether another node can have its name as well.
    """

    name: str
    origin: str = ""
    shared: bool = True


class SideEndpoint(NamedTuple):
    """One publisher, subscription, server or client of a side.

    Attributes:
        node: The full name of its node.
        kind: PUBLISHER, SUBSCRIPTION, SERVICE or CLIENT.
        name: The full name of the topic or service.
        type_name: Such as "std_msgs/msg/String", "std_srvs/srv/SetBool" or "pkg/action/Fibonacci_SendGoal";
            "" for a subscription that takes every type.
        type_hash: RIHS01_...; "" if it is unknown.
        qos: What it offers or requests; None for services.
        origin: That of its node. A native node can share its name with a mirror: only this tells whose
            endpoint it is.
    """

    node: str
    kind: EntryKind
    name: str
    type_name: str
    type_hash: str = ""
    qos: QoSProfile | None = None
    origin: str = ""


class SideGraph(NamedTuple):
    """What a side shows at one moment.

    Attributes:
        nodes: All nodes, mirrors included.
        endpoints: The endpoints of native nodes; those of mirrors may be left out.
    """

    nodes: frozenset[SideNode] = frozenset()
    endpoints: frozenset[SideEndpoint] = frozenset()

    def native_names(self) -> set[str]:
        """Return the full names of the nodes that are no mirrors."""
        return {node.name for node in self.nodes if not node.origin}


def origin_of(labels: Mapping[str, str]) -> str:
    """Return the origin of a node of callboard's graph, "" if it is native.

    Args:
        labels: The labels of the node.
    """
    return labels.get(ORIGIN_LABEL) or labels.get(BRIDGE_LABEL) or ""


def our_graph(snapshot: GraphSnapshot) -> SideGraph:
    """Return callboard's graph as plans read it.

    Args:
        snapshot: The graph.
    """
    nodes, endpoints = set[SideNode](), set[SideEndpoint]()
    # Services of bridges are not shown elsewhere, nor the clients of tools that ask bridges for reports.
    bridges = tuple(f"{name}/" for name, labels in snapshot.node_labels().items() if BRIDGE_LABEL in labels)
    for entry in snapshot.entries.values():
        origin = origin_of(snapshot.labels_of(entry))
        if entry.kind == EntryKind.NODE:
            nodes.add(SideNode(entry.node, origin, shared=entry.qos.get("shared") is True))
        elif not origin and not entry.name.startswith(bridges):
            kind = EntryKind(entry.kind)
            qos = _profile(entry.qos) if kind in _TOPICS else None
            endpoints.add(SideEndpoint(entry.node, kind, entry.name, entry.type_name, entry.type_hash, qos))
    return SideGraph(frozenset(nodes), frozenset(endpoints))


def _profile(fields: Mapping[str, Scalar]) -> QoSProfile:
    return _known_profile(tuple(each for each in fields.items() if each[0] != NODE_KEY))


@lru_cache(maxsize=1000)  # each graph asks for those of all endpoints, and few of them differ
def _known_profile(fields: tuple[tuple[str, Scalar], ...]) -> QoSProfile:
    return QoSProfile.from_wire(dict(fields))


def unseen(ours: SideGraph, bridge: str, user: str | None) -> tuple[Refusal, ...]:
    """Return what a bridge must say if it cannot see the nodes of callboard; nothing if it can.

    A broker leaves out of the graph what a user may not see, without a word. So the bridge's own node tells.

    Args:
        ours: Callboard's graph, as a whole.
        bridge: The full name of the bridge's node.
        user: The bridge's user.
    """
    if any(node.name == bridge for node in ours.nodes):
        return ()
    text = (
        f"the broker's access rules hide nodes from the user '{user}', even the bridge's own one. What it "
        "does not see does not appear in ROS 2 and receives no topic from there, and another bridge of this "
        'network is not noticed. Give it a role with: allow.see = ["/**"]'
    )
    return (Refusal("/**", Reason.NOT_SEEN, text),)

"""A model as wires: each wire joins a node and a hub, which is a topic, a service, or the label of an arrow.

A layout then only decides what is on the left and on the right of each hub.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntFlag
from typing import TYPE_CHECKING, Final, NamedTuple

from actors.tools.graph_drawing.model import Edge, Kind, Relation, Vertex
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from actors.tools.graph_drawing.model import GraphModel

MAX_LABEL_NAMES: Final = 3
"""Names at an arrow from node to node; further ones are only counted."""


class Flow(IntFlag):
    """The direction of data on a wire. It is both if a node subscribes to a topic that it publishes.

    APART marks a wire of a node that the hub does not connect with another one.
    """

    TO_HUB = 1
    FROM_HUB = 2
    APART = 4


class Hub(NamedTuple):
    """A topic, a service, or the label of an arrow from node to node.

    Attributes:
        label: The text to draw.
        kind: Whether it is about a topic or a service.
        vertex: The topic or service; None for a label.
    """

    label: str
    kind: Kind
    vertex: Vertex | None


@dataclass(frozen=True, slots=True)
class Wiring:
    """Nodes, hubs, and the wires between them.

    Attributes:
        nodes: The nodes.
        hubs: The hubs.
        wires: The direction of each wire, by the indices of its node and its hub.
    """

    nodes: list[Vertex]
    hubs: list[Hub]
    wires: dict[tuple[int, int], Flow]


def wiring_of(model: GraphModel) -> Wiring:
    """Return a model's wiring.

    Args:
        model: Nodes, topics, services and edges.
    """
    nodes = model.of_kind(Kind.NODE)
    number = {vertex: at for at, vertex in enumerate(nodes)}
    hubs = [
        Hub(escape(vertex.name), vertex.kind, vertex)
        for vertex in model.vertices
        if vertex.kind is not Kind.NODE
    ]
    hub_number: dict[Vertex | None, int] = {hub.vertex: at for at, hub in enumerate(hubs)}
    wires: dict[tuple[int, int], Flow] = {}
    for edge in model.edges:
        if edge.names:
            label = len(hubs)
            hubs.append(_label(edge))
            ends = [
                ((number[edge.source], label), Flow.TO_HUB),
                ((number[edge.target], label), Flow.FROM_HUB),
            ]
        elif edge.source.kind is Kind.NODE:
            ends = [((number[edge.source], hub_number[edge.target]), Flow.TO_HUB)]
        else:
            ends = [((number[edge.target], hub_number[edge.source]), Flow.FROM_HUB)]
        for wire, flow in ends:
            wires[wire] = wires.get(wire, Flow(0)) | flow | (Flow.APART if edge in model.apart else Flow(0))
    return Wiring(nodes, hubs, wires)


def _label(edge: Edge) -> Hub:
    more = len(edge.names) - MAX_LABEL_NAMES
    text = ", ".join(map(escape, edge.names[:MAX_LABEL_NAMES])) + (f" +{more}" if more > 0 else "")
    return Hub(text, Kind.TOPIC if edge.relation is Relation.PUBLISHES else Kind.SERVICE, None)


def parts_of(wiring: Wiring) -> tuple[list[Wiring], list[Vertex]]:
    """Return the connected parts, the largest first, and the nodes that have no wire, in their order.

    Args:
        wiring: The wiring to divide.
    """
    groups = _groups(wiring)
    alone = [wiring.nodes[members[0]] for members in groups if members[-1] < len(wiring.nodes)]
    parts = [_part(wiring, members) for members in groups if len(members) > 1]
    return sorted(parts, key=lambda part: -len(part.wires)), alone


def _groups(wiring: Wiring) -> list[list[int]]:
    """Return groups of connected indices; hubs count on after the nodes."""
    count = len(wiring.nodes)
    beside: list[list[int]] = [[] for _ in range(count + len(wiring.hubs))]
    for node, hub in wiring.wires:
        beside[node].append(count + hub)
        beside[count + hub].append(node)
    seen: set[int] = set()
    groups: list[list[int]] = []
    for start in range(len(beside)):
        if start in seen:
            continue
        seen.add(start)
        members = [start]
        for member in members:
            fresh = [other for other in beside[member] if other not in seen]
            seen.update(fresh)
            members += fresh
        groups.append(sorted(members))
    return groups


def _part(wiring: Wiring, members: list[int]) -> Wiring:
    count = len(wiring.nodes)
    nodes = [member for member in members if member < count]
    hubs = [member - count for member in members if member >= count]
    node_at = {member: at for at, member in enumerate(nodes)}
    hub_at = {member: at for at, member in enumerate(hubs)}
    wires = {
        (node_at[node], hub_at[hub]): flow for (node, hub), flow in wiring.wires.items() if node in node_at
    }
    return Wiring([wiring.nodes[node] for node in nodes], [wiring.hubs[hub] for hub in hubs], wires)

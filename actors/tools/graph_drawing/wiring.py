"""A model as wires: every edge joins a node and a hub, and a hub is a topic, a service, or an arrow's label.

So all that a layout has to care for is what is left and what is right of a hub.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntFlag
from typing import TYPE_CHECKING, Final, NamedTuple

from actors.tools.graph_drawing.model import Edge, Kind, Relation, Vertex
from proto.errors import escape

if TYPE_CHECKING:
    from actors.tools.graph_drawing.model import GraphModel

MAX_LABEL_NAMES: Final = 3
"""Of an arrow from node to node; how many more there are is said behind them."""


class Flow(IntFlag):
    """Which way data goes on a wire. Both ways, if a node publishes what it subscribes to."""

    TO_HUB = 1
    FROM_HUB = 2


class Hub(NamedTuple):
    """A topic, a service, or the label of an arrow from node to node (`vertex` is None)."""

    label: str
    kind: Kind
    vertex: Vertex | None


@dataclass(frozen=True, slots=True)
class Wiring:
    """Nodes, hubs, and the wires between them, by their indices."""

    nodes: list[Vertex]
    hubs: list[Hub]
    wires: dict[tuple[int, int], Flow]


def wiring_of(model: GraphModel) -> Wiring:
    """Return a model's wiring."""
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
            wires[wire] = wires.get(wire, Flow(0)) | flow
    return Wiring(nodes, hubs, wires)


def _label(edge: Edge) -> Hub:
    more = len(edge.names) - MAX_LABEL_NAMES
    text = ", ".join(map(escape, edge.names[:MAX_LABEL_NAMES])) + (f" +{more}" if more > 0 else "")
    return Hub(text, Kind.TOPIC if edge.relation is Relation.PUBLISHES else Kind.SERVICE, None)


def parts_of(wiring: Wiring) -> tuple[list[Wiring], list[Vertex]]:
    """Return the connected parts, the largest first, and the nodes that have no wire, in their order."""
    groups = _groups(wiring)
    alone = [wiring.nodes[members[0]] for members in groups if members[-1] < len(wiring.nodes)]
    parts = [_part(wiring, members) for members in groups if len(members) > 1]
    return sorted(parts, key=lambda part: -len(part.wires)), alone


def _groups(wiring: Wiring) -> list[list[int]]:
    """Return the connected numbers: nodes first, and hubs after all the nodes."""
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

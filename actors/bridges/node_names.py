"""The names of mirror nodes: those of their originals, unless another node of the side has the name.

Callboard has a namespace for the other network, and its nodes may share their names: only names that are not
shared are taken. In the other network all names of native nodes count as taken.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.bridges.report import Reason
from proto.errors import InvalidNameError
from proto.wire.names import MAX_NODE_NAME_LENGTH, split_node_name, validate_namespace, validate_node_name

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

    from actors.bridges.graph import SideNode
    from actors.bridges.report import Refusals
    from actors.bridges.rules import Rules


def names_here(
    nodes: Collection[str],
    our_nodes: Collection[SideNode],
    rules: Rules,
    before: Mapping[str, str],
    refusals: Refusals,
) -> dict[str, str]:
    """Return the names in callboard of nodes of the other network, by their names there.

    Args:
        nodes: The full names of the nodes.
        our_nodes: The nodes of callboard.
        rules: The namespace, and how many nodes are shown.
        before: The originals of the mirror nodes that exist, by the mirrors' names. A mirror whose name was
            taken keeps its other name, because the node that has the name may be restarting, and could not
            come back if the mirror took it.
        refusals: Gets the nodes that have another name, or none.
    """
    taken = {node.name for node in our_nodes if not node.shared}
    wanted = {name: rules.node_here(name) for name in nodes}
    taken |= {
        wanted[original]
        for name, original in before.items()
        if original in wanted and name != wanted[original]
    }
    cause = "a callboard node has its name and does not share it"
    return _assign(wanted, taken, rules.max_nodes, refusals, suffix="_ros2", cause=cause)


def names_there(
    nodes: Collection[str], their_names: Collection[str], rules: Rules, refusals: Refusals
) -> dict[str, str]:
    """Return the names in the other network of nodes of callboard, by their names here.

    Args:
        nodes: The full names of the nodes.
        their_names: The names of the native nodes of the other network.
        rules: The namespace, and how many nodes are shown.
        refusals: Gets the nodes that have another name, or none.
    """
    wanted = {name: rules.node_there(name) for name in nodes}
    cause = "another node has its name there"
    return _assign(wanted, their_names, rules.max_nodes, refusals, suffix="_callboard", cause=cause)


def _assign(
    wanted: Mapping[str, str],
    taken: Collection[str],
    max_nodes: int,
    refusals: Refusals,
    *,
    suffix: str,
    cause: str,
) -> dict[str, str]:
    """Return the names of mirror nodes by their originals' names; no two are equal, and none is taken."""
    used = set(taken)
    names: dict[str, str] = {}
    # Free names come first, then those that only lose the namespace: both keep exactly their name.
    order = sorted(wanted.items(), key=lambda item: (item[1] in used, item[0] == item[1], item))
    if len(order) > max_nodes:
        text = (
            f"{len(order) - max_nodes} nodes are beyond max_nodes = {max_nodes}: "
            "allow fewer topics and services"
        )
        refusals.add(order[max_nodes][0], Reason.LIMIT, text)
        del order[max_nodes:]
    for original, name in order:
        chosen = name
        while chosen in used:
            chosen += suffix
        if not _is_node_name(chosen):
            refusals.add(original, Reason.INVALID_NAME, f"a node cannot be called {chosen}")
            continue
        used.add(chosen)
        names[original] = chosen
        if chosen != name:
            refusals.add(original, Reason.NAME_TAKEN, f"{original} appears as {chosen}: {cause}")
    return names


def _is_node_name(full: str) -> bool:
    namespace, name = split_node_name(full)
    try:
        validate_node_name(name)
        validate_namespace(namespace or "/")
    except InvalidNameError:
        return False
    return len(name) <= MAX_NODE_NAME_LENGTH

"""What tests read or set inside a node, where no public name has it."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from actors import Node
    from actors.endpoints.context import NodeContext
    from actors.graph.view import BrokerView
    from actors.session.link import Link


def context_of(node: Node) -> NodeContext:
    """Return what a node's parts share: its users see what the parts do."""
    return node._context


def link_of(node: Node) -> Link:
    """Return a node's link to its broker: tests cut, fill and look into it."""
    return node._context.link


def queries_of(node: Node) -> BrokerView:
    """Return a node's questions to its broker, which a test asks with a deadline of its own."""
    return node._broker

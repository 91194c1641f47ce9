"""Which actions there are."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.ros.rclpy.node_parts import parts_of

if TYPE_CHECKING:
    from actors.ros.rclpy.node import Node


def get_action_client_names_and_types_by_node(
    node: Node, remote_node_name: str, remote_node_namespace: str
) -> list[tuple[str, list[str]]]:
    """Return the actions of which a node has clients; raise NodeNameNonExistentError without such a node."""
    parts = parts_of(node)
    return parts.query_node(
        parts.native.get_action_client_names_and_types_by_node,
        remote_node_name,
        remote_node_namespace,
    )


def get_action_server_names_and_types_by_node(
    node: Node, remote_node_name: str, remote_node_namespace: str
) -> list[tuple[str, list[str]]]:
    """Return the actions that a node serves; raise NodeNameNonExistentError without such a node."""
    parts = parts_of(node)
    return parts.query_node(
        parts.native.get_action_server_names_and_types_by_node,
        remote_node_name,
        remote_node_namespace,
    )


def get_action_names_and_types(node: Node) -> list[tuple[str, list[str]]]:
    """Return all actions with their types."""
    parts = parts_of(node)
    return parts.query(parts.native.get_action_names_and_types)

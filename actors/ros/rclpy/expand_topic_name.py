"""Expands the names of topics."""

from __future__ import annotations

from proto.wire import names


def expand_topic_name(topic_name: str, node_name: str, node_namespace: str) -> str:
    """Return the full name of a topic for a node.

    Args:
        topic_name: Relative, absolute with `/`, or private with `~/`.
        node_name: The node's name.
        node_namespace: The node's namespace.

    Raises:
        NameValidationException: One of them is invalid.
    """
    return names.expand_topic_name(topic_name, node_name, node_namespace)

"""Checks a node's name."""

from __future__ import annotations

from typing import Literal

from proto.wire import names


def validate_node_name(node_name: str) -> Literal[True]:
    """Return True if it is valid; raise the error that says what is wrong if not."""
    names.validate_node_name(node_name)
    return True

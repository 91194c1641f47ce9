"""How namespaces go together, as in ROS 2."""

from __future__ import annotations


def prefix_namespace(base: str | None, namespace: str | None) -> str | None:
    """Return a namespace within another: an absolute one stands for itself. None if neither is given."""
    if namespace is None:
        return None if base is None else _without_end(base)
    if base is None or namespace.startswith("/"):
        return _without_end(namespace)
    return _without_end(f"{_without_end(base).rstrip('/')}/{namespace}")


def absolute_namespace(namespace: str) -> str:
    """Return a namespace with its leading slash; the empty one is the root."""
    return namespace if namespace.startswith("/") else f"/{namespace}"


def _without_end(namespace: str) -> str:
    return namespace.rstrip("/") or namespace[:1]

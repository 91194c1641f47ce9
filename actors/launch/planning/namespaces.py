"""Nested namespaces, as in ROS 2."""

from __future__ import annotations


def prefix_namespace(base: str | None, namespace: str | None) -> str | None:
    """Return a namespace inside another, unchanged if it is absolute; None if neither is given."""
    if namespace is None:
        return None if base is None else _without_end(base)
    if base is None or namespace.startswith("/"):
        return _without_end(namespace)
    return _without_end(f"{_without_end(base).rstrip('/')}/{namespace}")


def _without_end(namespace: str) -> str:
    return namespace.rstrip("/") or namespace[:1]

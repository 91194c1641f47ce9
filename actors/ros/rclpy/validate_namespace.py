"""Checks a namespace."""

from __future__ import annotations

from typing import Literal

from proto.wire import names


def validate_namespace(namespace: str) -> Literal[True]:
    """Return True if it is valid; raise the error that says what is wrong if not."""
    names.validate_namespace(namespace)
    return True

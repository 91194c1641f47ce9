"""Checks the full name of a topic or a service."""

from __future__ import annotations

from typing import Literal

from proto.wire import names


def validate_full_topic_name(name: str, *, is_service: bool = False) -> Literal[True]:
    """Return True if it is valid; raise the error that says what is wrong if not."""
    if is_service:
        names.validate_full_service_name(name)
    else:
        names.validate_full_topic_name(name)
    return True

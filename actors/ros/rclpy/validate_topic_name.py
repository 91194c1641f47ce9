"""Checks the name of a topic or a service."""

from __future__ import annotations

from typing import Literal

from proto.wire import names

TOPIC_SEPARATOR_STRING = "/"


def validate_topic_name(name: str, *, is_service: bool = False) -> Literal[True]:
    """Return True if it is valid; raise the error that says what is wrong if not."""
    names.validate_topic_name(name, is_service=is_service)
    return True

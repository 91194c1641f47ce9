"""Says which topics and services tools hide."""

from __future__ import annotations

from proto.wire.names import is_hidden

HIDDEN_TOPIC_PREFIX = "_"


def topic_or_service_is_hidden(name: str) -> bool:
    """Return whether a part of the name begins with an underscore."""
    return is_hidden(name)

"""Named brokers, and which one a program uses: `actors.config.contexts`, for programs of your own."""

from __future__ import annotations

from actors.config.contexts import (
    Context,
    ContextError,
    Contexts,
    Place,
    UnknownContextError,
    contexts_file,
    find_place,
)

__all__ = [
    "Context",
    "ContextError",
    "Contexts",
    "Place",
    "UnknownContextError",
    "contexts_file",
    "find_place",
]

"""Named brokers, and which one a program uses: `actors.config.contexts`, for programs of your own."""

from __future__ import annotations

from actors.config.contexts import (
    BrokerTarget,
    Context,
    ContextError,
    Contexts,
    UnknownContextError,
    contexts_file,
    find_broker_target,
)

__all__ = [
    "BrokerTarget",
    "Context",
    "ContextError",
    "Contexts",
    "UnknownContextError",
    "contexts_file",
    "find_broker_target",
]

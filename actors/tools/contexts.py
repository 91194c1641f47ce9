"""Named brokers, and the choice of the broker to use; public names of `actors.config.contexts`."""

from __future__ import annotations

from actors.config.context_errors import ContextError, UnknownContextError
from actors.config.contexts import (
    BrokerTarget,
    Context,
    Contexts,
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

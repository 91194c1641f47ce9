"""The limits of one graph, which its router applies. `BrokerOptions` has the options that set them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from proto import limits

_MIB: Final = 1024 * 1024

MAX_DEPARTED_QUEUES: Final = 1000
"""Enough for a restart of many publishers. The queues' bytes count for the limit of the peer's link."""


@dataclass(frozen=True, kw_only=True, slots=True)
class RouterLimits:
    """What the peers of one graph may have and send."""

    max_endpoints: int = 20_000
    """Nodes and endpoints that one peer may declare."""
    max_matches: int = 200_000
    """Counterparts that all endpoints of one peer may have together."""
    max_mesh_matches: int = 2_000_000
    """Counterparts that all endpoints of one other broker of a mesh may have together."""
    max_pending_calls: int = 200_000
    """Unanswered calls of one peer."""
    max_definitions: int = 2000
    """Different type definitions that one peer may declare."""
    max_definition_bytes: int = 4 * _MIB
    """Their size."""
    max_keep_all_queue_bytes: int = 128 * _MIB
    """Bytes that may wait in one queue for a KEEP_ALL subscription that granted credit."""
    max_queued_call_bytes: int = 8 * _MIB
    """Bytes of requests from one peer that may wait for one server's peer."""
    max_bulk_bytes: int = 256 * _MIB
    """Bytes of requests from all peers that may wait for one server's peer."""
    max_departed_queues: int = MAX_DEPARTED_QUEUES
    """Queues with messages for one peer whose publishers are gone; beyond it the oldest loses its own."""
    max_message_bytes: int = limits.MAX_MESSAGE_BYTES
    """Size of one frame that a peer takes."""
    keep_all_stall_sec: float = 60.0
    """How long a KEEP_ALL subscription that takes nothing holds publishers back, unless it asks for more."""
    keep_all_stall_max_sec: float = 600.0
    """The most that it may ask for."""

"""What a snapshot of a node says of shared memory."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True, slots=True)
class SharedMemoryDiagnostics:
    """The large messages of a node that pass through shared memory.

    Attributes:
        active: Whether the broker of this session takes references.
        written: Messages written to shared memory.
        sent: Those of them that the broker has got by reference; the others as bytes.
        full: Messages sent as bytes because there was no space.
        received: Messages received by reference.
        stale: Those of them that were lost because their memory was in use again after a lost session.
        problem: Why messages go as bytes although the broker takes references; "" if they do not.
    """

    active: bool = False
    written: int = 0
    sent: int = 0
    full: int = 0
    received: int = 0
    stale: int = 0
    problem: str = ""

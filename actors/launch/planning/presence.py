"""Presence: a node, a topic or a service that is there or not, as the broker's graph says."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    from proto.wire.frames import GraphEntry


class PresenceKind(Enum):
    """What can be there."""

    NODE = "node"
    TOPIC = "topic"
    """With at least one publisher."""
    SERVICE = "service"
    """With at least one server."""


@dataclass(frozen=True)
class Presence:
    """Something that is there, or is waited for.

    Attributes:
        kind: What it is.
        name: Its full name: "/ns1/add_two_ints".
    """

    kind: PresenceKind
    name: str

    def __str__(self) -> str:
        return f"{self.kind.value} {self.name}"


_KINDS = {
    EntryKind.NODE: PresenceKind.NODE,
    EntryKind.PUBLISHER: PresenceKind.TOPIC,
    EntryKind.SERVICE: PresenceKind.SERVICE,
}


def presence_of(entry: GraphEntry) -> Presence | None:
    """Return what an entry of a graph makes there be; None for those at the other ends."""
    kind = _KINDS.get(EntryKind(entry.kind))
    if kind is None:
        return None
    return Presence(kind, entry.node if kind is PresenceKind.NODE else entry.name)

"""Nodes, topics and services that a launch waits for in the graph."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    from proto.wire.frames import GraphEntry


class PresenceKind(Enum):
    """The kind of a presence."""

    NODE = "node"
    TOPIC = "topic"
    """With at least one publisher."""
    SERVICE = "service"
    """With at least one server."""


@dataclass(frozen=True)
class Presence:
    """A node, topic or service that is in the graph, or is waited for.

    Attributes:
        kind: Its kind.
        name: Its full name, such as "/ns1/add_two_ints".
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
    """Return the presence of a graph entry; None for subscriptions and clients."""
    # A topic that only has subscriptions has no publisher, so waiting for it would be of no use.
    kind = _KINDS.get(EntryKind(entry.kind))
    if kind is None:
        return None
    return Presence(kind, entry.node if kind is PresenceKind.NODE else entry.name)

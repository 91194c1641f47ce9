"""What a bridge reports: what does not cross and why, and counters of what does. Data only."""

from __future__ import annotations

from enum import StrEnum
from typing import NamedTuple

from proto.untrusted_text import peer_name, peer_text


class Reason(StrEnum):
    """Why something does not cross."""

    TYPE_MISSING = "type missing"
    """One side lacks the type."""
    TYPE_DIFFERS = "type differs"
    """Both sides have the type, with different definitions."""
    SECOND_TYPE = "second type"
    """The topic has another type as well, and one process of the other network has one type for a topic."""
    SERVED_TWICE = "served on both sides"
    """Each side has a server of its own, so each call stays on its side."""
    SECOND_CLOCK = "second clock"
    """Time has one source."""
    NAME_TAKEN = "name taken"
    """A node crosses under another name."""
    INVALID_NAME = "invalid name"
    """The other side does not allow the name."""
    NOT_SEEN = "not seen"
    """The broker's access rules hide nodes of callboard from the bridge's user."""
    LIMIT = "limit"
    """More than the rules allow."""


class Refusal(NamedTuple):
    """Something that does not cross.

    Attributes:
        name: The full name of the topic, service or node, on the side where it is.
        reason: Why.
        text: A sentence that says what to do.
        type_name: The type in question, "" for none.
        quiet: Whether it is what everybody would expect, and deserves no warning.
    """

    name: str
    reason: Reason
    text: str
    type_name: str = ""
    quiet: bool = False

    def __str__(self) -> str:
        """Return it as a line of a log."""
        # A node with another name does cross.
        return self.text if self.reason is Reason.NAME_TAKEN else f"'{self.name}' does not cross: {self.text}"


class Refusals:
    """Collects what does not cross."""

    def __init__(self) -> None:
        self._found = set[Refusal]()

    def add(self, name: str, reason: Reason, text: str, type_name: str = "", *, quiet: bool = False) -> None:
        """Add one; the arguments are the attributes of `Refusal`, and need not be printable."""
        # Other networks check neither names nor types as a broker does.
        self._found.add(Refusal(peer_name(name), reason, peer_text(text), peer_name(type_name), quiet))

    def all(self) -> tuple[Refusal, ...]:
        """Return all, sorted, each once."""
        return tuple(sorted(self._found))

"""A topic or service that is there, but with another type than was asked for: waiting would be in vain."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from actors.cli.errors import CommandError
from actors.interfaces.message import type_hash, type_name
from proto.codes import EntryKind

if TYPE_CHECKING:
    from actors.graph.snapshot import GraphSnapshot

_DONE_BY: Final = {EntryKind.PUBLISHER: "published", EntryKind.SERVICE: "served"}


def require_type(snapshot: GraphSnapshot, kind: EntryKind, name: str, wanted: type[Any]) -> None:
    """Check that a publisher of a topic, or a server of a service, has a type; or that none is there.

    Raises:
        CommandError: All of them have other types; the text names these.
    """
    offers = {(entry.type_name, entry.type_hash) for entry in snapshot.of_kind(kind) if entry.name == name}
    if not offers or (type_name(wanted), type_hash(wanted)) in offers:
        return
    own = type_name(wanted)
    types = sorted(f"another definition of {own}" if each == own else each for each, _ in offers)
    raise CommandError(f"'{name}' is {_DONE_BY[kind]} as {' and '.join(dict.fromkeys(types))}, not {own}")

"""The text of an interface, wherever it is: in its file, in its class, or only with the nodes that use it.

    with Inspector("callboard://127.0.0.1:7411") as inspector:
        texts = texts_in_graph(inspector, "robot_msgs/msg/Wheel")

A publisher and a server are declared with the definition of their type, and the broker keeps these: so a type
can be shown that is not installed here, without its comments, constants and defaults.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.interfaces.catalog import KINDS, source_file
from actors.interfaces.described import texts_of
from actors.interfaces.errors import InvalidMessageError, UnknownInterfaceError
from actors.interfaces.message import type_name
from actors.interfaces.parser import read_source
from actors.interfaces.registry import find_interface, source_of

if TYPE_CHECKING:
    from actors.graph.inspector import Inspector

MAX_ASKED: Final = 1000
"""Definitions asked for in search of a type that only others contain."""


def full_name(name: str) -> str:
    """Return a type's full name; the kind may be left out, as in std_msgs/String.

    Raises:
        UnknownInterfaceError: There is no such type here; with a suggestion.
    """
    package, _, word = name.partition("/")
    candidates = [name] if "/" in word else [f"{package}/{kind}/{word}" for kind in KINDS]
    for candidate in candidates:
        if candidate.count("/") == 2 and source_file(*candidate.split("/")) is not None:
            return candidate
    return type_name(find_interface(name))


def local_text(name: str) -> str | None:
    """Return the text behind a full type name: the file with its comments, or what its class says.

    Raises:
        InterfaceSyntaxError: The file is too large or not UTF-8.
    """
    file = source_file(*name.split("/")) if name.count("/") == 2 else None
    if file is not None:
        return read_source(file)
    try:
        return source_of(find_interface(name))
    except UnknownInterfaceError:
        return None


def texts_in_graph(inspector: Inspector, name: str) -> dict[str, str]:
    """Return the texts of a type and of all that it contains, by type name, as nodes have declared them.

    Args:
        inspector: A connected inspector.
        name: The type's full name. If types with different definitions have this name, the oldest is meant.

    Returns:
        Nothing if nobody publishes or serves the type, alone or in another one.

    Raises:
        BrokerUnreachable: The link broke.
    """
    entries = [entry for entry in inspector.graph().entries.values() if entry.type_hash]
    entries.sort(key=lambda entry: (entry.type_name != name, entry.key))
    hashes = list(dict.fromkeys(entry.type_hash for entry in entries))
    for type_hash in hashes[:MAX_ASKED]:
        definition = inspector.definition(type_hash)
        try:
            texts = {} if definition is None else texts_of(definition)
        except InvalidMessageError:  # a foreign client's; others may have it right
            continue
        if name in texts:
            return texts
    return {}

"""The definition text of an interface: from its file, its class, or the nodes that use it.

    with Inspector("callboard://127.0.0.1:7411") as inspector:
        texts = texts_in_graph(inspector, "robot_msgs/msg/Wheel")

Publishers and servers declare the definition of their type, which the broker keeps. A type that is not
installed here can therefore be shown, without its comments, constants and defaults.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any, Final

from actors.errors import BrokerUnreachable
from actors.interfaces.catalog import source_file
from actors.interfaces.described import definition_within, texts_of
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.interface_names import KINDS
from actors.interfaces.message import type_name
from actors.interfaces.parser import parse_file, read_source
from actors.interfaces.registry import find_interface, installed_interface, source_of
from actors.interfaces.runtime_types import runtime_action, runtime_message, runtime_service
from actors.interfaces.specs import interface_text

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.graph.inspector import Inspector
    from actors.interfaces.message import Action, Message, Service

MAX_ASKED: Final = 1000
SEARCH_SEC: Final = 5.0
"""Definitions requested in search of a type that only occurs inside others, and the time for that."""


def full_name(name: str) -> str:
    """Return a type's full name.

    Args:
        name: Such as std_msgs/msg/String; the kind may be left out.

    Raises:
        UnknownInterfaceError: The type is not installed; the text has a suggestion.
    """
    package, _, word = name.partition("/")
    candidates = [name] if "/" in word else [f"{package}/{kind}/{word}" for kind in KINDS]
    for candidate in candidates:
        if candidate.count("/") == 2 and source_file(*candidate.split("/")) is not None:
            return candidate
    return type_name(find_interface(name))


def local_text(name: str, *, comments: bool = False) -> str | None:
    """Return the definition of an installed type: its file, or the text of its class.

    The text of an `.idl` file is what a `.msg`, `.srv` or `.action` file for the same type says.

    Args:
        name: The type's full name.
        comments: Whether the text of a class has its comments; that of a file always has.

    Returns:
        The text; None if the type is not installed.

    Raises:
        InterfaceSyntaxError: The file is too large or not UTF-8, or an `.idl` file breaks a rule.
    """
    file = source_file(*name.split("/")) if name.count("/") == 2 else None
    if file is not None and file.suffix == ".idl":
        return interface_text(parse_file(file, name.partition("/")[0]))
    if file is not None:
        return read_source(file)
    found = installed_interface(name)
    return None if found is None else source_of(found, comments=comments)


def texts_in_graph(inspector: Inspector, name: str) -> dict[str, str]:
    """Return the definitions of a type and of the types that it contains, as nodes declared them.

    Args:
        inspector: A connected inspector.
        name: The type's full name. Of several definitions of this name, the oldest is used.

    Returns:
        Texts by type name; empty if nobody publishes or serves the type, alone or inside another one.

    Raises:
        BrokerUnreachable: The link broke, or the answers take more than 5 s in all.
    """
    definition = _definition_in_graph(inspector, name)
    return {} if definition is None else texts_of(definition)


def class_in_graph(inspector: Inspector, name: str) -> type[Message | Service | Action] | None:
    """Return a class for a type that is not installed, made of the definition that a node declared.

    Args:
        inspector: A connected inspector.
        name: As for `texts_in_graph`.

    Returns:
        The class, without constants and defaults; None if nobody publishes or serves the type.
        Subscriptions and clients do not declare the definition of theirs.

    Raises:
        BrokerUnreachable: As for `texts_in_graph`.
        InvalidMessageError: The definition is of no type that can be made.
    """
    kind = name.split("/")[1]
    # An action is never declared as such, only what it is made of.
    suffixes = ("_SendGoal", "_GetResult", "_FeedbackMessage") if kind == "action" else ("",)
    parts: list[bytes] = []
    for suffix in suffixes:
        definition = _definition_in_graph(inspector, name + suffix)
        if definition is None:
            return None
        parts.append(definition_within(definition, name + suffix))
    make: dict[str, Callable[..., type[Any]]] = {
        "msg": runtime_message,
        "srv": runtime_service,
        "action": runtime_action,
    }
    return make[kind](*parts) if kind in make else None


def _definition_in_graph(inspector: Inspector, name: str) -> bytes | None:
    """Return the oldest definition that describes a type."""
    deadline = time.monotonic() + SEARCH_SEC
    entries = [entry for entry in inspector.graph().entries.values() if entry.type_hash]
    entries.sort(key=lambda entry: (entry.type_name != name, entry.key))
    hashes = list(dict.fromkeys(entry.type_hash for entry in entries))
    for type_hash in hashes[:MAX_ASKED]:
        if time.monotonic() > deadline:
            raise BrokerUnreachable(f"The broker at {inspector.url} answers too slowly")
        definition = inspector.definition(type_hash)
        try:
            if definition is not None and name in texts_of(definition):
                return definition
        except InvalidMessageError:  # declared by a foreign client; others may be correct
            continue
    return None

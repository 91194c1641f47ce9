"""Short descriptions of actions and their values, for messages."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from pathlib import PurePath
from typing import TYPE_CHECKING, Any, Final, cast

from actors.launch.description.options import default_of
from actors.launch.description.substitutions import TextSubstitution
from actors.launch.description.validation import Entity

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from actors.launch.description.action import Action

_LABELS: Final = (
    *("name", "executable", "script", "node", "cmd", "launch_description_source", "src"),
    *("function", "event_handler"),
)
"""Options that name an action; the first one that it has counts."""
_KNOWN: Final = ("target_action", "target_lifecycle_node", "action", "depends_on", "node")
"""Options that refer to another action."""


def action_label(action: Action) -> str:
    """Return a short name of an action, such as "Node 'talker'"."""
    kind = type(action).__name__
    for label in _LABELS:
        word = _word(getattr(action, label, None))
        if word:
            return f"{kind} '{word}'"
    return kind


def static_text(value: object) -> str | None:
    """Return the value of a string without substitutions; None for other values."""
    if isinstance(value, TextSubstitution):
        return value.text
    if isinstance(value, list | tuple):
        pieces = [static_text(each) for each in cast("Sequence[object]", value)]
        return None if None in pieces else "".join(map(str, pieces))
    return str(value) if isinstance(value, str | PurePath) else None


def function_name(function: object) -> str:
    """Return the name of a function, with parentheses."""
    return f"{getattr(function, '__name__', type(function).__name__)}()"


def format_entity(entity: object) -> str:
    """Return an entity as Python code, without defaults and the actions within it."""
    fields = {name: each for name, each in non_default_fields(entity).items() if name != "actions"}
    if isinstance(entity, Entity) and entity.kind == "event handler":
        fields = {name: each for name, each in fields.items() if name in _KNOWN or not _is_done(each)}
    one = (
        len(fields) == 1
        and isinstance(entity, Entity)
        and entity.kind in {"substitution", "condition", "matcher"}
    )
    texts = (f"{'' if one else f'{name}='}{format_value(each, name)}" for name, each in fields.items())
    return f"{type(entity).__name__}({', '.join(texts)})"


def _is_done(value: object) -> bool:
    """Return whether a value is an action or a list of actions."""
    listed = cast("Sequence[object]", value) if isinstance(value, list | tuple) else (value,)
    return all(isinstance(each, Entity) and each.kind == "action" for each in listed)


def format_value(value: object, name: str = "") -> str:
    """Return a value as Python code; actions in options that refer to one are replaced by their names."""
    if isinstance(value, Entity) and name in _KNOWN:
        return action_label(cast("Action", value))
    if is_dataclass(value) and not isinstance(value, type):
        return format_entity(value)
    if isinstance(value, dict):
        by_name = cast("Mapping[object, object]", value)
        return (
            "{"
            + ", ".join(f"{format_value(key)}: {format_value(each)}" for key, each in by_name.items())
            + "}"
        )
    if isinstance(value, list | tuple):
        inner = ", ".join(format_value(each, name) for each in cast("Sequence[object]", value))
        return f"({inner})" if isinstance(value, tuple) else f"[{inner}]"
    if isinstance(value, type):
        return value.__qualname__
    return function_name(value) if callable(value) else repr(value)


def non_default_fields(value: object) -> dict[str, object]:
    """Return the fields of a dataclass whose values are not the defaults."""
    found: dict[str, object] = {}
    for field in fields(cast("Any", value)):
        each: object = getattr(value, field.name)
        if each != default_of(field):
            found[field.name] = each
    return found


def _word(value: object) -> str | None:
    if isinstance(value, Entity) and value.kind == "event handler":
        return type(value).__name__
    first = value
    if isinstance(value, list) and value:  # a command: only the program
        first = cast("Sequence[object]", value)[0]
    text = static_text(first)
    return function_name(first) if text is None and callable(first) else text

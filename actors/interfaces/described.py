"""Renders the text of a type from its canonical definition, without its class."""

from __future__ import annotations

import json
from typing import Any, Final, cast

from actors.interfaces.definition import EMPTY_MEMBER, STRING_BOUND_OFFSET, TYPE_IDS, array_kind
from actors.interfaces.errors import InvalidMessageError

_BASES: Final = {number: base for base, number in TYPE_IDS.items() if base != "char"}
_STRINGS: Final = {TYPE_IDS[base] + STRING_BOUND_OFFSET: base for base in ("string", "wstring")}
_SEPARATOR: Final = "---\n"


def texts_of(definition: bytes) -> dict[str, str]:
    """Return the texts of a definition's types: type name to the content of a `.msg` or `.srv` file.

    Constants, defaults and comments are not part of a definition.

    Args:
        definition: The result of `actors.interfaces.message.definition`, which the broker keeps.

    Raises:
        InvalidMessageError: It is not such a definition.
    """
    try:
        whole: Any = json.loads(definition)
        described = [whole["type_description"], *whole["referenced_type_descriptions"]]
        texts = {_name(each["type_name"]): _text(each["fields"]) for each in described}
    except (AttributeError, KeyError, TypeError, ValueError, RecursionError) as error:
        raise InvalidMessageError(f"A definition that cannot be read: {error!r}") from None
    for name in list(texts):
        parts = [texts.get(f"{name}_{part}") for part in ("Request", "Response")]
        if "/srv/" in name and None not in parts:
            texts[name] = _SEPARATOR.join(cast("list[str]", parts))
    return texts


def _text(fields: list[dict[str, Any]]) -> str:
    lines = [
        f"{_type(field['type'])} {_name(field['name'])}\n"
        for field in fields
        if field["name"] != EMPTY_MEMBER
    ]
    return "".join(lines)


def _name(name: str) -> str:
    """Return a name of a definition; raise ValueError if it could be taken for something else in a text."""
    if not name.replace("/", "_").isidentifier():
        raise ValueError(f"the name {name!r}")
    return name


def _type(field_type: dict[str, Any]) -> str:
    array, number = array_kind(int(field_type["type_id"]))
    if nested := field_type["nested_type_name"]:
        base = _name(nested).replace("/msg/", "/")
    elif number in _STRINGS:
        base = f"{_STRINGS[number]}<={int(field_type['string_capacity'])}"
    else:
        base = _BASES[number]
    return base + array.format(int(field_type["capacity"]))

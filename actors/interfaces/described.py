"""Reads the types of a canonical definition, without their classes: their fields, and their text."""

from __future__ import annotations

import json
from typing import Any, Final

from actors.interfaces.definition import EMPTY_MEMBER, STRING_BOUND_OFFSET, TYPE_IDS, array_kind
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.fields import FieldType

_BASES: Final = {number: base for base, number in TYPE_IDS.items() if base != "char"}
_STRINGS: Final = {TYPE_IDS[base] + STRING_BOUND_OFFSET: base for base in ("string", "wstring")}
_SEPARATOR: Final = "---\n"


def described_types(definition: bytes) -> dict[str, dict[str, FieldType]]:
    """Return the types of a definition: type name to the types of its fields by their names, in order.

    `FieldType.message` is None in all of them: there are no classes.

    Args:
        definition: The result of `actors.interfaces.message.definition`, which the broker keeps.

    Raises:
        InvalidMessageError: It is not such a definition.
    """
    try:
        whole: Any = json.loads(definition)
        described = [whole["type_description"], *whole["referenced_type_descriptions"]]
        return {_name(each["type_name"]): _fields(each["fields"]) for each in described}
    # A definition is bytes of another process. Whatever is wrong with it shows in one of these.
    except (AttributeError, KeyError, TypeError, ValueError, RecursionError) as error:
        raise InvalidMessageError(f"A definition that cannot be read: {error!r}") from None


def definition_within(definition: bytes, name: str) -> bytes:
    """Return the canonical definition of a type that a definition describes.

    Args:
        definition: As for `described_types`, which has accepted it.
        name: The type's full name.
    """
    whole: Any = json.loads(definition)
    by_name = {
        each["type_name"]: each
        for each in (whole["type_description"], *whole["referenced_type_descriptions"])
    }
    contained, pending = set[str](), [name]
    while pending:
        nested = {field["type"]["nested_type_name"] for field in by_name[pending.pop()]["fields"]}
        pending += (nested & by_name.keys()) - contained
        contained |= nested & by_name.keys()
    # As `definition.py` writes it: a type that contains itself is described once.
    referenced = [by_name[each] for each in sorted(contained - {name})]
    return json.dumps(
        {"type_description": by_name[name], "referenced_type_descriptions": referenced}
    ).encode()


def texts_of(definition: bytes) -> dict[str, str]:
    """Return the texts of a definition's types: type name to the content of a `.msg` or `.srv` file.

    Constants, defaults and comments are not part of a definition.

    Args:
        definition: As for `described_types`.

    Raises:
        InvalidMessageError: It is not such a definition.
    """
    texts = {
        name: "".join(f"{field_type} {field}\n" for field, field_type in fields.items())
        for name, fields in described_types(definition).items()
    }
    for name in list(texts):
        parts = (f"{name}_Request", f"{name}_Response")
        if "/srv/" in name and all(part in texts for part in parts):
            texts[name] = _SEPARATOR.join(texts[part] for part in parts)
    return texts


def _fields(fields: list[dict[str, Any]]) -> dict[str, FieldType]:
    return {_name(each["name"]): _type(each["type"]) for each in fields if each["name"] != EMPTY_MEMBER}


def _name(name: str) -> str:
    """Return a name of a definition; raise ValueError if it could be taken for something else in a string."""
    if not name.replace("/", "_").isidentifier():
        raise ValueError(f"the name {name!r}")
    return name


def _type(field_type: dict[str, Any]) -> FieldType:
    array, number = array_kind(int(field_type["type_id"]))
    bound = 0
    if nested := field_type["nested_type_name"]:
        base = _name(nested)
    elif number in _STRINGS:
        base, bound = _STRINGS[number], int(field_type["string_capacity"])
    else:
        base = _BASES[number]
    if not array:
        return FieldType(base, string_bound=bound)
    capacity = int(field_type["capacity"])
    high = None if array == "[]" else capacity
    low = capacity if array == "[{}]" else 0
    return FieldType(base, string_bound=bound, is_array=True, low=low, high=high)

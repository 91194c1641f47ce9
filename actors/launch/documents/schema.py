"""The JSON schema of launch documents, for editors: `callboard launch --schema` prints it."""

from __future__ import annotations

import json
from typing import Any, Final, cast

from actors.launch.documents.elements import ELEMENTS, Elements
from actors.launch.documents.kinds import NAME, SCALAR, Schema
from actors.launch.documents.parameters import definitions

_DRAFT: Final = "http://json-schema.org/draft-07/schema#"
"""The draft that most editors support."""
_WIDTH: Final = 110


def schema() -> Schema:
    """Return the schema."""
    return {
        "$schema": _DRAFT,
        "title": "callboard launch file",
        "description": "Many nodes with one command: callboard launch FILE",
        "type": "object",
        "properties": {"launch": Elements().schema()},
        "required": ["launch"],
        "additionalProperties": False,
        "definitions": {
            "text": {"description": "A string; $(var NAME) in it is the value of an argument.", **SCALAR},
            "plain": {"description": "A string without substitutions: $( has no meaning in it.", **SCALAR},
            "name": {"description": "A name, without $(…).", **NAME},
            **definitions(),
            # Definitions are shared by the aliases of an element; written out, the schema would be twice as
            # long.
            **{f"element_{each.names[0]}": each.schema() for each in ELEMENTS},
            "elements": {"type": "array", "items": {"$ref": "#/definitions/element"}},
            "element": {
                "type": "object",
                "properties": {
                    name: {"$ref": f"#/definitions/element_{each.names[0]}"}
                    for each in ELEMENTS
                    for name in each.names
                },
                "additionalProperties": False,
                "minProperties": 1,
                "maxProperties": 1,
            },
        },
    }


def schema_text() -> str:
    """Return the schema as indented JSON."""
    return _pretty(schema(), "") + "\n"


def _pretty(value: Any, indent: str) -> str:
    """Return JSON, in one line if that is not too long."""
    # Short values in one line: the file is read by people, too, and would be five times as long.
    line = json.dumps(value, ensure_ascii=False)
    if len(indent) + len(line) <= _WIDTH or not isinstance(value, dict | list):
        return line
    inner = indent + "  "
    within: Any = cast("Any", value)
    if isinstance(value, dict):
        items = [f"{json.dumps(name)}: {_pretty(each, inner)}" for name, each in within.items()]
    else:
        items = [_pretty(each, inner) for each in within]
    return f"{line[0]}\n" + ",\n".join(inner + each for each in items) + f"\n{indent}{line[-1]}"

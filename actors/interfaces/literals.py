"""Parses and renders values in interface text, as in `int32 x 0x10` or `string[] names ["a", 'b']`."""

from __future__ import annotations

import codecs
import re
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, Final, cast

if TYPE_CHECKING:
    from actors.interfaces.fields import FieldType

INTEGER_RANGE: Final = {
    name: (0, 2**bits - 1) if name.startswith("u") else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    for bits in (8, 16, 32, 64)
    for name in (f"int{bits}", f"uint{bits}")
} | {"char": (0, 255), "byte": (0, 255)}
_BOOLEAN: Final = {"true": True, "1": True, "false": False, "0": False}
_ITEM: Final = re.compile(
    r"""(\s*"(?:\\.|[^"\\])*"\s*|\s*'(?:\\.|[^'\\])*'\s*|\s*[^,"'\s][^,]*)(,|$)""", re.DOTALL
)
_ESCAPE: Final = re.compile(
    r"\\(?:[\\'\"abfnrtv]|[0-7]{1,3}|x[0-9a-fA-F]{2}|u[0-9a-fA-F]{4}|U[0-9a-fA-F]{8})"
)
_IDL_ESCAPE: Final = re.compile(r"\\(?:[\\'\"abfnrtv]|[0-7]{1,3}|x[0-9a-fA-F]{1,2})")

# No line separators: the text has a line for each field. Tabs would be read as spaces.
_SPECIAL: Final = re.compile(r"""["\x00-\x1f\x7f-\x9f\u2028\u2029]|\\(?P<pair>(?=["\\]))?""")


def _boolean(text: str) -> bool:
    try:
        return _BOOLEAN[text.lower()]
    except KeyError:
        raise ValueError(f"'{text}' is not a bool; use true, false, 1 or 0") from None


def _integer(base: str, text: str) -> int:
    low, high = INTEGER_RANGE[base]
    # As in rosidl: `010` is ten. Base 0 alone would refuse it, base 10 alone the prefixes.
    for radix in (10, 0):
        with suppress(ValueError):
            value = int(text, radix)
            break
    else:
        raise ValueError(f"'{text}' is not an integer (10, 0x0a, 0o12 and 0b1010 are)")
    if not low <= value <= high:
        raise ValueError(f"{text} is out of range for {base}: {low} to {high}")
    return value


def _decoded(found: re.Match[str]) -> str:
    digits = found[0][2:]
    return chr(int(digits, 16)) if found[0][1] == "x" else codecs.decode(found[0], "unicode_escape")


def idl_text(inner: str) -> str:
    """Return the text of a string literal in an `.idl` file, given without its quotes."""
    return re.sub(r'\\(["\\])', r"\1", _IDL_ESCAPE.sub(_decoded, inner))


def _escaped(found: re.Match[str], *, in_array: bool) -> str:
    character = found[0]
    if character == '"':
        return '\\"'
    if character == "\\":
        # Escapes are read twice, and then one of two backslashes, or one before a quotation mark, is removed.
        return "\\" * (2 if in_array else 8 if found["pair"] else 4)
    return codecs.encode(character, "unicode_escape").decode()


def _quoted(text: str, *, in_array: bool) -> str:
    return f'"{_SPECIAL.sub(partial(_escaped, in_array=in_array), text)}"'


def _string(field_type: FieldType, text: str, *, in_array: bool) -> str:
    value = text
    quote = text[:1]
    if quote in {'"', "'"}:
        if len(text) < 2 or text[-1] != quote:
            raise ValueError(f"The string {text} is not closed with {quote}")
        value = text[1:-1]
        if re.search(rf"(?<!\\){quote}", value):
            raise ValueError(f"Write \\{quote} for a quotation mark inside the string {text}")
        value = value.replace(f"\\{quote}", quote)
    # ROS 2 reads escapes, also without quotes, on the way to an `.idl` file, and there once more. Those of an
    # array are in a tuple of Python on that way, and are read once.
    value = _ESCAPE.sub(_decoded, value)
    if not in_array:
        value = idl_text(value.replace('"', '\\"'))
    if field_type.string_bound and len(value) > field_type.string_bound:
        raise ValueError(f"{text} is longer than {field_type.string_bound} characters")
    return value


def _scalar(field_type: FieldType, text: str, *, in_array: bool = False) -> object:
    base = field_type.base
    if base == "bool":
        return _boolean(text)
    if base in {"float32", "float64"}:
        try:
            return float(text)
        except ValueError:
            raise ValueError(f"'{text}' is not a number") from None
    if base in {"string", "wstring"}:
        return _string(field_type, text, in_array=in_array)
    value = _integer(base, text)
    return bytes([value]) if base == "byte" else value


def _items(text: str) -> list[str]:
    """Split "[a, 'b, c']" at the commas outside quotes."""
    inner = text[1:-1].strip()
    items: list[str] = []
    position = 0
    # A pattern, not `split`: a quoted string may contain commas.
    while position < len(inner):
        found = _ITEM.match(inner, position)
        if found is None:
            raise ValueError(f"'{text}' is not an array; write [a, b, c]")
        items.append(found[1].strip())
        position = found.end()
    return items


def parse_value(field_type: FieldType, text: str) -> object:
    """Return the value of a string: a bool, int, float, str, bytes (for byte), or a list.

    Raises:
        ValueError: It is not a value of this primitive type, or an array's length is not allowed.
    """
    if not field_type.is_array:
        return _scalar(field_type, text)
    if not (text.startswith("[") and text.endswith("]")):
        raise ValueError(f"'{text}' is not an array; write [a, b, c]")
    element = replace(field_type, is_array=False, low=0, high=None)
    items = _items(text)
    if len(items) < field_type.low or (field_type.high is not None and len(items) > field_type.high):
        raise ValueError(f"{text} has {len(items)} elements, but the type is {field_type}")
    return [_scalar(element, item, in_array=True) for item in items]


def render_value(field_type: FieldType, value: Any) -> str:
    """Return the interface text of a value, which `parse_value` accepts."""
    if field_type.is_array:
        element = replace(field_type, is_array=False, low=0, high=None)
        if isinstance(value, bytes) and field_type.base == "byte":
            return "[" + ", ".join(str(item) for item in value) + "]"
        texts = (
            _quoted(item, in_array=True) if isinstance(item, str) else render_value(element, item)
            for item in value
        )
        return f"[{', '.join(texts)}]"
    # First, since a bool is an int in Python, and `repr` would write `True`.
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, bytes):
        return str(value[0])
    if isinstance(value, str):
        return _quoted(value, in_array=False)
    return repr(cast("object", value))

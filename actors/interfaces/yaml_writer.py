"""Writes YAML that rcl's parser, PyYAML and callboard read as the same values.

Parameter files, the arguments of `-p` and the output of `param dump` are written here.
"""

from __future__ import annotations

import base64
import math
import re
import sys
from collections.abc import Mapping, Sequence
from decimal import Decimal
from typing import TYPE_CHECKING, Any, Final, cast

from actors.interfaces.yaml_scalars import rcl_scalar, yaml_scalar

if TYPE_CHECKING:
    from collections.abc import Iterator

MAX_KEY_CHARS: Final = 80
"""Longer keys are written with a question mark: libyaml finds no key of more than 1,024 bytes otherwise."""

# Words that are plain scalars in any YAML: no indicator at the beginning, no colon at the end.
_UNQUOTED: Final = re.compile(r"[A-Za-z_/][A-Za-z0-9_./+-]*(?: [A-Za-z0-9_./+-]+)*")
_SCALAR_SEQUENCES: Final = (str, bytes, bytearray, memoryview)
_ESCAPES: Final = {'"': '\\"', "\\": "\\\\", "\n": "\\n", "\t": "\\t", "\r": "\\r"}


def flow_text(value: object) -> str:
    """Return a value as YAML in one line.

    Args:
        value: A bool, int, float, str, bytes, or a sequence of them.

    Raises:
        TypeError: It is something else.
        ValueError: A string has surrogates, which no encoding has.
    """
    match value:
        case bool():
            return "true" if value else "false"
        case int():
            return str(value)
        case float():
            return _float(value)
        case str():
            return _string(value)
        case bytes() | bytearray() | memoryview() if value:
            return f'!!binary "{base64.b64encode(cast("bytes", value)).decode()}"'
        # Empty bytes as well: rcl reads an empty `!!binary` as a string, which no array parameter accepts.
        case Sequence():
            return f"[{', '.join(map(flow_text, cast('Sequence[object]', value)))}]"
        case _:
            raise TypeError(f"{value!r} is no value of a parameter")


def block_text(values: Mapping[str, Any], indent: int = 0) -> str:
    """Return a mapping as YAML with one line for each value, also of lists and of mappings in it.

    Args:
        values: The values, as for `flow_text`, or mappings, or lists of mappings that are not empty.
        indent: Number of spaces at the beginning of each line.

    Raises:
        TypeError: As for `flow_text`.
        ValueError: As for `flow_text`.
    """
    return "".join(f"{' ' * indent}{line}\n" for line in _lines(values))


def _lines(values: Mapping[str, Any]) -> Iterator[str]:
    for name, value in values.items():
        key = _string(name)
        if len(key) > MAX_KEY_CHARS:
            yield f"? {key}"
            key = ""
        if isinstance(value, Mapping) and value:
            yield f"{key}:"
            yield from (f"  {line}" for line in _lines(cast("Mapping[str, Any]", value)))
        elif isinstance(value, Sequence) and value and not isinstance(value, _SCALAR_SEQUENCES):
            yield f"{key}:"
            for each in cast("Sequence[object]", value):
                lines = (
                    _lines(cast("Mapping[str, Any]", each))
                    if isinstance(each, Mapping)
                    else (flow_text(each),)
                )
                yield from (f"{' ' if index else '-'} {line}" for index, line in enumerate(lines))
        else:
            yield f"{key}: {'{}' if isinstance(value, Mapping) else flow_text(cast('object', value))}"


def _float(value: float) -> str:
    if not math.isfinite(value):
        return ".nan" if math.isnan(value) else ".inf" if value > 0 else "-.inf"
    # rcl reads numbers below the smallest normal one as strings, unless all their digits are given.
    text = str(Decimal(value)) if 0 < abs(value) < sys.float_info.min else repr(value)
    mantissa, exponent, power = text.lower().partition("e")
    # PyYAML reads 1e+22 as a string.
    return mantissa + ("" if "." in mantissa else ".0") + exponent + power


def _string(value: str) -> str:
    # Both readers must see a string: `y` is a bool for rcl, and `null` is nothing for PyYAML.
    if (
        _UNQUOTED.fullmatch(value)
        and isinstance(rcl_scalar(value), str)
        and isinstance(yaml_scalar(value), str)
    ):
        return value
    return f'"{"".join(map(_escaped, value))}"'


def _escaped(char: str) -> str:
    if char in _ESCAPES:
        return _ESCAPES[char]
    if char.isprintable():
        return char
    code = ord(char)
    if 0xD800 <= code < 0xE000:
        raise ValueError("a string with surrogates cannot be written")
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"

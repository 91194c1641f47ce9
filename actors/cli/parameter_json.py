"""Parameters as JSON: `param dump --json` prints it, and `param load` reads it.

JSON has neither NaN nor bytes, and an empty list has no type there: what these are follows from the types of
the node's parameters.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, cast

from actors.parameters.file_parser import PARAMETERS_KEY
from actors.parameters.overrides import MAX_FILE_SIZE, node_matches
from actors.parameters.types import Parameter, ParameterType

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

_NOT_FINITE: Final = {text: float(text) for text in ("nan", "inf", "-inf")}
"""As `print_json` prints them."""


def with_plain_values(parameters: Iterable[Parameter]) -> list[Parameter]:
    """Return parameters whose values JSON can express: bytes become lists."""
    return [
        Parameter(each.name, value=[*each.value]) if isinstance(each.value, bytes) else each
        for each in parameters
    ]


def values_in_file(path: str, node: str, *, use_wildcard: bool) -> dict[str, Any] | None:
    """Return what a file has for a node, by name; None if the file is not of the form that is printed.

    Args:
        path: The file.
        node: The node's full name.
        use_wildcard: Also take what it has for patterns such as `/**`.
    """
    try:
        with Path(path).open("rb") as file:
            document: object = json.loads(file.read(MAX_FILE_SIZE + 1))
        if not isinstance(document, dict):
            return None
        return {
            name: value
            for pattern, values in _sections(cast("dict[str, Any]", document), "")
            if node_matches(pattern, node) and (use_wildcard or "*" not in pattern)
            for name, value in _flat(values, "")
        }
    except (OSError, ValueError, TypeError, RecursionError):
        return None  # the reader of parameter files has the better errors


def _sections(document: dict[str, Any], path: str) -> Iterator[tuple[str, dict[str, Any]]]:
    for key, below in document.items():
        pattern = f"{path}/{key.strip('/')}"
        if set(below) == {PARAMETERS_KEY}:
            yield pattern, below[PARAMETERS_KEY]
        else:
            yield from _sections(_mapping(below), pattern)


def _flat(values: dict[str, Any], prefix: str) -> Iterator[tuple[str, Any]]:
    for key, value in _mapping(values).items():
        if isinstance(value, dict):
            yield from _flat(cast("dict[str, Any]", value), f"{prefix}{key}.")
        else:
            yield prefix + key, value


def _mapping(value: Any) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise TypeError(f"expected an object, got {value!r}")
    return cast("dict[str, Any]", value)


def typed_parameter(name: str, value: Any, kind: ParameterType) -> Parameter:
    """Return a parameter with a value from JSON.

    Args:
        name: Its name.
        value: The value.
        kind: The type of the node's parameter; NOT_SET if it has none.

    Raises:
        TypeError: No parameter can hold the value.
    """
    if not isinstance(value, list):
        if kind is ParameterType.DOUBLE and isinstance(value, str):
            return Parameter(name, value=_NOT_FINITE.get(value, value))
        return Parameter(name, value=value)
    items: list[Any] = cast("Any", value)
    if kind is ParameterType.DOUBLE_ARRAY or any(isinstance(item, float) for item in items):
        items = [_NOT_FINITE.get(item, item) if isinstance(item, str) else item for item in items]
    if kind is ParameterType.BYTE_ARRAY and all(type(item) is int and 0 <= item <= 255 for item in items):
        return Parameter(name, value=bytes(items))
    if not items and kind >= ParameterType.BYTE_ARRAY:
        return Parameter(name, kind, items)
    return Parameter(name, value=cast("Any", items))

"""Parameter values from outside the code: `-p [node:]name:=value`, and parameter files.

A file is YAML in the form of `ros2 param dump`. Its keys are full node names (the first slash may be left
out), also nested, also with `*` for one part and `**` for any number of them. A key may occur several times:

    /**:
      ros__parameters:
        use_sim_time: false
    /ns/talker:
      ros__parameters:
        rates: {slow: 1.0}      # the parameter rates.slow
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final, cast

from actors.interfaces.yaml_reader import load_sections
from actors.parameters.errors import InvalidParameterFileError
from actors.parameters.types import ParameterType, ParameterValue, parameter_value_from_string
from proto.wire.names import validate_node_name

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

MAX_FILE_SIZE: Final = 1 << 20
"""Largest parameter file, in bytes; a larger one is a mistake."""
MAX_FILE_PARAMETERS: Final = 100_000
"""YAML aliases let a small file contain any number of parameters."""

_PARAMETERS_KEY: Final = "ros__parameters"
_NAME = re.compile(r"[A-Za-z_~/][A-Za-z0-9_./~-]*")
_PATTERN = re.compile(r"(?:/(?:[A-Za-z0-9_]+|\*\*?))+")
_EVERY_NODE: Final = "/**"


@dataclass(frozen=True, slots=True)
class ParameterOverride:
    """One value for all nodes whose full name matches the pattern."""

    pattern: str
    name: str
    value: ParameterValue

    @classmethod
    def parse(cls, text: str) -> ParameterOverride:
        """Return the override of a command line's `[node:]name:=value`.

        A bare node name matches nodes of that name in any namespace.

        Raises:
            ValueError: The text does not have this form.
        """
        left, separator, value = text.partition(":=")
        node, colon, name = left.rpartition(":")
        if not (separator and value) or not _NAME.fullmatch(name):
            raise ValueError("expected name:=value or node:name:=value, such as speed:=1.5")
        if colon:
            validate_node_name(node)
        pattern = f"{_EVERY_NODE}/{node}" if colon else _EVERY_NODE
        return cls(pattern, name, parameter_value_from_string(value))


def overrides_for(overrides: Iterable[ParameterOverride], full_node_name: str) -> dict[str, ParameterValue]:
    """Return the values for one node; the last of several for one parameter wins."""
    matches: dict[str, bool] = {}
    chosen: dict[str, ParameterValue] = {}
    for override in overrides:
        pattern = override.pattern
        # A file has many parameters for few patterns.
        if pattern not in matches:
            matches[pattern] = node_matches(pattern, full_node_name)
        if matches[pattern]:
            chosen[override.name] = override.value
    return chosen


def node_matches(pattern: str, full_node_name: str) -> bool:
    """Return whether a full node name matches a pattern, with `*` for one part and `**` for any number."""
    # All positions in the name that the pattern so far may have led to. Trying them one after another, as a
    # recursive match does, takes exponential time for patterns with several `**`.
    remaining: set[int] = {0}
    name = full_node_name.strip("/").split("/")
    for part in pattern.strip("/").split("/"):
        if part == "**":
            remaining = set(range(min(remaining, default=len(name) + 1), len(name) + 1))
        else:
            remaining = {at + 1 for at in remaining if at < len(name) and part in {"*", name[at]}}
    return len(name) in remaining


def load_parameter_file(path: str | Path) -> tuple[ParameterOverride, ...]:
    """Return the entries of a parameter file, in order.

    Raises:
        InvalidParameterFileError: It cannot be read, is over `MAX_FILE_SIZE`, is not YAML, or does not have
            the form in this module's docstring; the text gives the reason.
    """
    try:
        with Path(path).open("rb") as file:
            # One byte more than allowed: enough to know, without reading the rest of whatever it is.
            data = file.read(MAX_FILE_SIZE + 1)
    except (OSError, ValueError) as error:
        raise InvalidParameterFileError(str(path), str(error)) from None
    if len(data) > MAX_FILE_SIZE:
        raise InvalidParameterFileError(str(path), f"larger than {MAX_FILE_SIZE} bytes")
    try:
        # A generator, so that the limit stops the expansion of aliases while it happens.
        entries = (entry for section in load_sections(data) for entry in _entries(section, ""))
        return tuple(_limited(entries, MAX_FILE_PARAMETERS))
    except ValueError as error:
        # In one line: it ends up in a line of a log.
        raise InvalidParameterFileError(str(path), " ".join(str(error).split())) from None


def _limited(entries: Iterator[ParameterOverride], limit: int) -> Iterator[ParameterOverride]:
    for count, entry in enumerate(entries):
        if count == limit:
            raise ValueError(f"more than {limit} parameters")
        yield entry


def _entries(document: object, path: str) -> Iterator[ParameterOverride]:
    where = f"node {path}" if path else "the file"
    for key, value in _mapping(document, where).items():
        if key == _PARAMETERS_KEY:
            raise ValueError(f"{where} has parameters beside other nodes, or without a node name")
        pattern = f"{path}/{key.strip('/')}"
        if not _PATTERN.fullmatch(pattern):
            raise ValueError(f"{pattern!r} is not a node name")
        below = _mapping(value or None, f"node {pattern}")
        if set(below) == {_PARAMETERS_KEY}:
            yield from _parameters(pattern, "", below[_PARAMETERS_KEY])
        else:
            yield from _entries(below, pattern)


def _parameters(pattern: str, prefix: str, value: object) -> Iterator[ParameterOverride]:
    for key, below in _mapping(value, f"{_PARAMETERS_KEY} of {pattern}").items():
        name = prefix + key
        if isinstance(below, dict):
            yield from _parameters(pattern, f"{name}.", cast("object", below))
            continue
        try:
            kind = ParameterType.from_parameter_value(below)
        except TypeError as error:
            raise ValueError(f"parameter {name} of {pattern}: {error}") from None
        if kind is ParameterType.NOT_SET:
            raise ValueError(f"parameter {name} of {pattern} has no value")
        yield ParameterOverride(pattern, name, cast("ParameterValue", below))


def _mapping(value: object, where: str) -> dict[str, object]:
    if not isinstance(value, dict):
        # Not a TypeError: the content of a file is wrong, and the caller reports all such errors alike.
        raise ValueError(f"{where} must hold '<node>: {_PARAMETERS_KEY}: <name>: <value>'")  # noqa: TRY004
    mapping = cast("dict[object, object]", value)
    return {str(key): each for key, each in mapping.items()}

"""Parameter values from outside the code: `-p [node:]name:=value`, and parameter files.

A file is YAML in the form of `ros2 param dump`, read by rcl's rules (`file_parser.py`). Its keys are full
node names (the first slash may be left out), also nested, also with `*` for one part and `**` for any number
of them. A key may occur several times:

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
from itertools import starmap
from pathlib import Path
from typing import TYPE_CHECKING, Final

from actors.parameters.errors import InvalidParameterFileError
from actors.parameters.file_parser import parse_parameter_file, parse_parameter_value
from proto.wire.names import validate_node_name

if TYPE_CHECKING:
    from collections.abc import Iterable

    from actors.parameters.types import ParameterValue

MAX_FILE_SIZE: Final = 1 << 20
"""Largest parameter file, in bytes; a larger one is a mistake."""

_ARGUMENT_NAME: Final = re.compile(r"[A-Za-z_~/][A-Za-z0-9_./~-]*")
"""Names that `-p` can have; files have any."""
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
            ValueError: The text does not have this form, or the value is no scalar or list of them.
        """
        left, separator, value = text.partition(":=")
        node, colon, name = left.rpartition(":")
        if not (separator and value) or not _ARGUMENT_NAME.fullmatch(name):
            raise ValueError("expected name:=value or node:name:=value, such as speed:=1.5")
        if colon:
            validate_node_name(node)
        pattern = f"{_EVERY_NODE}/{node}" if colon else _EVERY_NODE
        return cls(pattern, name, parse_parameter_value(value))


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
        return tuple(starmap(ParameterOverride, parse_parameter_file(data)))
    except ValueError as error:
        # In one line: it ends up in a line of a log.
        raise InvalidParameterFileError(str(path), " ".join(str(error).split())) from None

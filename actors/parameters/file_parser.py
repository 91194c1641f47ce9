"""Parses parameter files, and the text after `-p name:=`, by the rules of rcl.

Like rcl it refuses aliases and lists of values of different types. There are two kinds of differences
(docs/reference/parameter-files.md lists them). Text that rcl accepts and misreads is an error, such as merge
keys and lists of mappings, which become parameters of other names. Of two values of one parameter the last
one counts: of `a: 1` and `a: x` rcl keeps the 1 in either order.
"""

from __future__ import annotations

import base64
import re
from typing import TYPE_CHECKING, Any, Final, cast

from actors.interfaces.yaml_reader import MAX_DEPTH, YamlError, yaml_events
from actors.interfaces.yaml_scalars import rcl_scalar
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from collections.abc import Iterator

    from actors.parameters.types import ParameterValue

PARAMETERS_KEY: Final = "ros__parameters"
_PATTERN: Final = re.compile(r"(?:/(?:[A-Za-z_][A-Za-z0-9_]*|\*\*?))+")
# One word that is a plain scalar in any YAML. Most values are such words, and then PyYAML is not imported.
_WORD: Final = re.compile(r"(?!\.\.\.)-?[A-Za-z0-9_/+.][A-Za-z0-9_/+.-]*")
_STRING_TAG: Final = "tag:yaml.org,2002:str"
_BINARY_TAG: Final = "tag:yaml.org,2002:binary"
_NAMES: Final = {bool: "a bool", int: "an integer", float: "a double", str: "a string", bytes: "bytes"}


def parse_parameter_value(text: str) -> ParameterValue:
    """Return the value of the text after `-p name:=`.

    Args:
        text: The text.

    Returns:
        A scalar, or a list of scalars of one type.

    Raises:
        ValueError: The text is not YAML, or not exactly one such value.
    """
    if _WORD.fullmatch(text):
        return rcl_scalar(text)
    parser = _Parser(text)
    if parser.next("StreamStartEvent", "DocumentStartEvent") == "StreamEndEvent":
        raise ValueError("there is no value")
    value = parser.value(f"value {escape(text)}")
    parser.next()
    if parser.next() != "StreamEndEvent":
        raise ValueError("there is more than one value")
    return value


def parse_parameter_file(data: bytes) -> Iterator[tuple[str, str, ParameterValue]]:
    """Yield the node pattern, name and value of each parameter, in the order of the file.

    Args:
        data: The content of the file.

    Raises:
        ValueError: It does not have the form of a parameter file.
    """
    parser = _Parser(data)
    while parser.next("StreamStartEvent", "DocumentStartEvent", "DocumentEndEvent") != "StreamEndEvent":
        parser.require_mapping("the file")
        yield from _nodes(parser, "", 1)


def _nodes(parser: _Parser, path: str, depth: int) -> Iterator[tuple[str, str, ParameterValue]]:
    while (key := parser.key(depth)) is not None:
        if key == PARAMETERS_KEY:
            pattern = path if path.startswith("/") else f"/{path}"
            if not path:
                raise parser.error(
                    f"{PARAMETERS_KEY} needs the name of a node above it, or /** for all nodes"
                )
            if not _PATTERN.fullmatch(pattern):
                raise parser.error(f"{pattern!r} is not a node name")
            parser.enter_mapping(f"{PARAMETERS_KEY} of {pattern}")
            yield from _parameters(parser, pattern, "", depth + 1)
        else:
            below = f"{path}{key}" if path.endswith("/") or not path else f"{path}/{key}"
            parser.enter_mapping(f"node {escape(below)}")
            yield from _nodes(parser, below, depth + 1)


def _parameters(
    parser: _Parser, pattern: str, prefix: str, depth: int
) -> Iterator[tuple[str, str, ParameterValue]]:
    while (key := parser.key(depth)) is not None:
        name = prefix + key
        if parser.next() == "MappingStartEvent":
            yield from _parameters(parser, pattern, f"{name}.", depth + 1)
        else:
            yield pattern, name, parser.value(f"parameter {escape(name)} of {pattern}")


class _Parser:
    """Reads the YAML events of a text, and keeps the current one for errors."""

    def __init__(self, source: str | bytes) -> None:
        self._events = yaml_events(source)
        self._event: Any = None
        self.kind = ""

    def next(self, *skipped: str) -> str:
        """Go to the next event that is not one of these; return its kind."""
        for event in self._events:
            self._event, self.kind = event, type(event).__name__
            if self.kind not in skipped:
                break
        return self.kind

    def enter_mapping(self, where: str) -> None:
        """Go to the next event, which must begin a mapping."""
        self.next()
        self.require_mapping(where)

    def require_mapping(self, where: str) -> None:
        """Raise YamlError if the current event does not begin a mapping."""
        if self.kind != "MappingStartEvent":
            self._refuse_alias()
            raise self.error(f"{where} must hold '<node>: {PARAMETERS_KEY}: <name>: <value>'")

    def key(self, depth: int) -> str | None:
        """Return the next key of a mapping; None at its end.

        Args:
            depth: The mapping's level.
        """
        if depth > MAX_DEPTH:
            raise self.error(f"it is nested deeper than {MAX_DEPTH}")
        if self.next() == "MappingEndEvent":
            return None
        if self.kind != "ScalarEvent" or not self._event.value:
            self._refuse_alias()
            raise self.error("a key must be a word")
        if self._event.value == "<<" and not self._event.style:
            raise self.error("parameter files have no merge keys (<<), as in ROS 2: write the values here")
        return cast("str", self._event.value)

    def value(self, where: str) -> ParameterValue:
        """Return the value that begins with the current event.

        Args:
            where: What has the value, for errors.
        """
        if self.kind != "SequenceStartEvent":
            return cast("ParameterValue", self._scalar(where))
        values: list[Any] = []
        while self.next() != "SequenceEndEvent":
            values.append(self._scalar(where))
            if type(values[-1]) is not type(values[0]):
                first, other = _NAMES[type(values[0])], _NAMES[type(values[-1])]
                raise self.error(f"the list of {where} has {first} and {other}; all must have one type")
        # `ros2 param dump` writes an array of bytes as a list of single ones.
        return b"".join(values) if values and isinstance(values[0], bytes) else values

    def _scalar(self, where: str) -> bool | int | float | str | bytes:
        event = self._event
        if self.kind != "ScalarEvent":
            self._refuse_alias()
            what = "a list" if self.kind == "SequenceStartEvent" else "a mapping"
            raise self.error(f"{where} cannot be {what}, or have one in a list")
        text = event.value
        if event.tag == _BINARY_TAG:
            try:
                return base64.b64decode(text)
            except ValueError:
                raise self.error(f"{where} is not base64") from None
        if event.tag == _STRING_TAG or event.style in {"'", '"'}:
            return cast("str", text)
        if not text:
            raise self.error(f"{where} has no value; an empty string is ''")
        return rcl_scalar(text)

    def _refuse_alias(self) -> None:
        if self.kind == "AliasEvent":
            raise self.error("parameter files have no aliases (*), as in ROS 2: write the value again")

    def error(self, problem: str) -> YamlError:
        """Return the error about the current event."""
        return YamlError(problem, self._event.start_mark.line + 1)

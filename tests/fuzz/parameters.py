"""Parameter files and arguments: any text is values, which are read back equal, or an error."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from actors.arguments.ros_arguments import InvalidRosArgumentError, parse_ros_arguments
from actors.interfaces.yaml_writer import flow_text
from actors.parameters.file_parser import parse_parameter_file, parse_parameter_value
from actors.parameters.overrides import ParameterOverride, overrides_for
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from collections.abc import Iterable

NAMES: Final = ("/talker", "/a/b/talker", "/" + "a/" * 20 + "b")
OPTIONS: Final = ("-p", "-r", "--log-level")


def check(data: bytes) -> None:
    """Read a file or arguments; the first byte selects which."""
    kind, content = (data[0] if data else 0), data[1:]
    if kind % 2 == 0:
        try:
            overrides = [ParameterOverride(*each) for each in parse_parameter_file(content)]
        except ValueError as error:
            assert not isinstance(error, UnicodeError)  # noqa: PT017 - this is no test
            assert str(error)  # noqa: PT017
        else:
            apply(overrides)
        return
    texts = content.decode("utf-8", "replace").replace("\0", "").split("\n")
    option = OPTIONS[kind // 2 % len(OPTIONS)]
    try:
        found = parse_ros_arguments(["--ros-args", *(word for text in texts for word in (option, text))])
    except InvalidRosArgumentError as error:
        assert all(escape(line) == line for line in str(error).splitlines()), error  # noqa: PT017
    else:
        apply(found.parameter_overrides)


def apply(overrides: Iterable[ParameterOverride]) -> None:
    """Choose the values for nodes; write each, and read it back."""
    overrides = list(overrides)
    for name in NAMES:
        overrides_for(overrides, name)
    for override in overrides:
        try:
            text = flow_text(override.value)
        except ValueError:  # a surrogate
            continue
        assert same(parse_parameter_value(text), override.value), (text, override.value)


def same(one: Any, other: Any) -> bool:
    """Return whether values are equal and of the same types; nan is equal to itself."""
    if isinstance(one, list | tuple):
        return len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, float) and math.isnan(one):
        return isinstance(other, float) and math.isnan(other)
    return type(one) is type(other) and one == other

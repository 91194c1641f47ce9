"""The text of an interface with the texts of contained messages indented below, as ROS 2 prints it.

std_msgs/Header header
builtin_interfaces/Time stamp
int32 sec
uint32 nanosec
string frame_id
"""

from __future__ import annotations

import re
from enum import Enum
from typing import TYPE_CHECKING, Final

from actors.interfaces.errors import InterfaceSyntaxError
from actors.interfaces.interface_names import package_of_name
from actors.interfaces.parser import PRIMITIVES, without_comment

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

MAX_LINES: Final = 50_000
"""A received text may contain a message a million times; real ones have hundreds of lines."""
MAX_DEPTH: Final = 64
"""Nesting of messages; real ones have about ten levels. This stops a message that contains itself."""
_TYPE: Final = re.compile(r"(?:(?P<package>\w+)/(?:msg/)?)?(?P<name>\w+)")


class Comments(Enum):
    """Which comments and blank lines are included."""

    NONE = 0
    OWN = 1
    """Comments of the interface itself."""
    ALL = 2
    """Comments of the messages that it contains, too."""


def outline(name: str, text_of: Callable[[str], str | None], comments: Comments = Comments.OWN) -> list[str]:
    """Return the lines of an interface, with those of contained messages below, indented with tabs.

    Args:
        name: Its full type name.
        text_of: Returns the text of a type name; None if it is unknown and is left out.
        comments: Which comments to include.

    Raises:
        InterfaceSyntaxError: It is too large, or contains itself.
    """
    lines: list[str] = []
    for line in _lines(name, text_of, comments, 0):
        if len(lines) >= MAX_LINES:
            raise InterfaceSyntaxError(
                name, 0, f"With all that it contains it has more than {MAX_LINES} lines"
            )
        lines.append(line)
    return lines


def _lines(name: str, text_of: Callable[[str], str | None], comments: Comments, depth: int) -> Iterator[str]:
    if depth > MAX_DEPTH:
        raise InterfaceSyntaxError(name, 0, f"Messages contain one another, {MAX_DEPTH} levels deep")
    with_comments = comments is Comments.ALL or (comments is Comments.OWN and depth == 0)
    for raw in (text_of(name) or "").splitlines():
        code = without_comment(raw).strip()
        text = raw.rstrip() if with_comments else code
        # Blank lines are kept with the comments, as they set groups of fields apart.
        if text or with_comments:
            yield "\t" * depth + text if text else ""
        nested = _nested(code, name.partition("/")[0], text_of)
        if nested:
            yield from _lines(nested, text_of, comments, depth + 1)


def _nested(code: str, package: str, text_of: Callable[[str], str | None]) -> str:
    """Return the type name of the message in a line's field, or ""."""
    match = _TYPE.match(code)
    if match is None or (match["package"] is None and match["name"] in PRIMITIVES):
        return ""
    owner = match["package"] or package_of_name(
        match["name"], package, lambda: text_of(f"{package}/msg/Header") is not None
    )
    return f"{owner}/msg/{match['name']}"

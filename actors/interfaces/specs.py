"""Specifications of interfaces, which the parsers return, and the text of a specification."""

from __future__ import annotations

import keyword
import re
from dataclasses import dataclass
from textwrap import dedent
from typing import TYPE_CHECKING, Final

from actors.interfaces.errors import InterfaceSyntaxError
from actors.interfaces.interface_names import PACKAGE_NAME, TYPE_NAME
from actors.interfaces.literals import render_value
from proto.limits import MAX_MESSAGE_BYTES

if TYPE_CHECKING:
    from actors.interfaces.fields import FieldType

MAX_FIELDS: Final = 1000
"""Fields and constants in one part."""
MAX_FIXED: Final = MAX_MESSAGE_BYTES
"""Elements of a fixed-size array: a message with more could not be sent."""

PARTS: Final = {"msg": ("",), "srv": ("Request", "Response"), "action": ("Goal", "Result", "Feedback")}
"""The parts of each kind of interface, in the order of their text."""


@dataclass(frozen=True)
class FieldSpec:
    """A field: its name, type, default (None: zero or empty), and comment."""

    name: str
    type: FieldType
    default: object | None = None
    comment: str = ""


@dataclass(frozen=True)
class ConstantSpec:
    """A constant of a primitive type, and its comment."""

    name: str
    type: FieldType
    value: object
    comment: str = ""


@dataclass(frozen=True)
class MessageSpec:
    """One message, or one part of a service or action."""

    fields: tuple[FieldSpec, ...]
    constants: tuple[ConstantSpec, ...]
    comment: str = ""

    @property
    def dependencies(self) -> set[str]:
        """The type names of the messages that its fields hold."""
        return {field.type.base for field in self.fields if "/" in field.type.base}


@dataclass(frozen=True)
class InterfaceSpec:
    """A parsed file: package, kind ("msg", "srv", "action"), name, and a message for each of its parts."""

    package: str
    kind: str
    name: str
    parts: tuple[MessageSpec, ...]

    @property
    def type_name(self) -> str:
        """Such as "std_msgs/msg/String"."""
        return f"{self.package}/{self.kind}/{self.name}"

    @property
    def dependencies(self) -> set[str]:
        """The type names of the messages that its fields hold."""
        return set[str]().union(*(part.dependencies for part in self.parts))


def check_names(package: str, name: str, source: str) -> None:
    """Check the name of an interface and of its package.

    Args:
        package: The package's name.
        name: The interface's name, such as "String".
        source: Name of the text, for errors.

    Raises:
        InterfaceSyntaxError: One of the names is not allowed.
    """
    reason = ""
    if keyword.iskeyword(package) or keyword.iskeyword(name):
        reason = "The name is a Python keyword; use another"
    elif not PACKAGE_NAME.fullmatch(package):
        reason = f"'{package}' is not a package name: use lower case letters, digits and underscores"
    elif not TYPE_NAME.fullmatch(name):
        reason = f"'{name}' is not an interface name: use CamelCase letters and digits, such as 'ImuRaw'"
    if reason:
        raise InterfaceSyntaxError(source, 0, reason)


def comment_text(lines: list[str]) -> str:
    """Return a comment of lines without indentation, blank lines at its ends, and repeated blank lines."""
    text = "\n".join(line.rstrip() for line in lines).replace("\t", " ")
    return re.sub(r"\n{3,}", "\n\n", dedent(text).strip())


def interface_text(spec: InterfaceSpec) -> str:
    """Return the text of a `.msg`, `.srv` or `.action` file, with the comments of the specification."""
    lines = [line for part in spec.parts for line in ("---", *_message_lines(part))][1:]
    return "\n".join(lines) + "\n" if lines else ""


def _message_lines(part: MessageSpec) -> list[str]:
    lines: list[str] = []
    for constant in part.constants:
        value = render_value(constant.type, constant.value)
        lines += _commented(f"{constant.type} {constant.name}={value}", constant.comment)
    for field in part.fields:
        default = "" if field.default is None else f" {render_value(field.type, field.default)}"
        lines += _commented(f"{field.type} {field.name}{default}", field.comment)
    # Comments above the first blank line are the message's, below it the first field's.
    if part.comment or (lines and lines[0].startswith("#")):
        return [*_comment_lines(part.comment), "", *lines]
    return lines


def _commented(line: str, comment: str) -> list[str]:
    """Return a line with its comment: after it, or above it if the comment has several lines."""
    if "\n" not in comment:
        return [f"{line}  # {comment}"] if comment else [line]
    return [*_comment_lines(comment), line]


def _comment_lines(comment: str) -> list[str]:
    return [f"# {line}".rstrip() for line in comment.splitlines()]

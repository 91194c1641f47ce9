"""Parses `.msg`, `.srv` and `.action` text into specifications.

    int32 count                 a field            int32 count 5           with a default
    int32 LIMIT=10              a constant         int32[3] x [1, 2, 3]    arrays: T[], T[n], T[<=n]
    string<=10 label            a bounded string   geometry_msgs/Pose at   another package's message

A `.srv` has two parts separated by a line `---`, an `.action` three. A `#` starts a comment. Comments in the
first lines of a part belong to it. Others belong to the field or constant in the same line, or else below.
"""

from __future__ import annotations

import keyword
import re
from contextlib import suppress
from dataclasses import replace
from io import BytesIO, TextIOWrapper
from itertools import takewhile
from typing import TYPE_CHECKING, Final, NoReturn

from actors.interfaces.errors import InterfaceSyntaxError
from actors.interfaces.fields import FieldType
from actors.interfaces.idl import parse_idl
from actors.interfaces.interface_names import DERIVED_NAME, PACKAGE_NAME, TYPE_NAME, package_of_name
from actors.interfaces.literals import parse_value
from actors.interfaces.specs import (
    MAX_FIELDS,
    MAX_FIXED,
    PARTS,
    ConstantSpec,
    FieldSpec,
    InterfaceSpec,
    MessageSpec,
    check_names,
    comment_text,
)
from actors.regular_files import read_regular

if TYPE_CHECKING:
    from pathlib import Path

MAX_FILE_BYTES: Final = 1 << 20
"""Interface texts are written by hand; a larger file is something else."""
PRIMITIVES: Final = frozenset(
    {
        "bool", "byte", "char", "float32", "float64", "int8", "uint8", "int16", "uint16", "int32", "uint32",
        "int64", "uint64", "string", "wstring",
    }
)  # fmt: skip
_FIELD_NAME: Final = PACKAGE_NAME
_CONSTANT_NAME: Final = re.compile(r"(?!.*__)(?!.*_$)[A-Z][A-Z0-9_]*")
_TYPE: Final = re.compile(
    r"(?:(?P<package>\w+)/(?:msg/)?)?(?P<name>\w+)(?:<=(?P<string>[+\w]*))?"
    r"(?P<array>\[(?P<most><=)?(?P<size>[^\]]*)\])?"
)
_BEFORE_QUOTE: Final = frozenset({" ", "\t", "=", "[", ","})
"""What is before a string in quotes."""
_CONSTANT: Final = re.compile(r"(?P<name>[^\s=]+)\s*=(?P<value>.*)", re.DOTALL)


class _Reader:
    """Parses one part; keeps the position for errors."""

    def __init__(self, package: str, source: str, *, has_header: bool, derived_kind: str) -> None:
        self._package = package
        self._has_header = has_header
        self._derived_kind = derived_kind
        self._source = source
        self._line = 0
        self._seen: dict[str, int] = {}

    def fail(self, reason: str) -> NoReturn:
        raise InterfaceSyntaxError(self._source, self._line, reason)

    def part(self, lines: list[tuple[int, str]]) -> MessageSpec:
        self._seen = {}
        own = [raw for _, raw in takewhile(lambda numbered: numbered[1].startswith("#"), lines)]
        elements: list[FieldSpec | ConstantSpec] = []
        comments: list[list[str]] = []  # of the elements
        above: list[str] = []
        # The line is kept in the object, so that every error names it without being told.
        for self._line, raw in lines[len(own) :]:
            line = without_comment(raw)
            comment = [raw[len(line) :].lstrip("#")] if len(line) < len(raw) else []
            if line.strip():
                elements.append(self._element(line.strip()))
                comments.append(above + comment)
                above = []
            elif not line:
                above += comment
            elif comments:
                # An indented comment goes on with that of the line above.
                comments[-1] += comment
            if len(self._seen) > MAX_FIELDS:
                self.fail(f"More than {MAX_FIELDS} fields; split the message")
        found = [
            replace(each, comment=comment_text(text)) for each, text in zip(elements, comments, strict=True)
        ]
        return MessageSpec(
            tuple(each for each in found if isinstance(each, FieldSpec)),
            tuple(each for each in found if isinstance(each, ConstantSpec)),
            comment_text([line.lstrip("#") for line in own]),
        )

    def _element(self, line: str) -> FieldSpec | ConstantSpec:
        type_text, _, rest = line.replace("\t", " ").partition(" ")
        field_type = self.type(type_text)
        rest = rest.strip()
        if not rest:
            self.fail(f"'{line}' has a type but no name; write '<type> <name>'")
        # By the `=`: a default is written without one, which is the only difference to a constant.
        constant = _CONSTANT.fullmatch(rest)
        if constant is not None:
            return self.constant(field_type, constant["name"], constant["value"].strip())
        return self.field(field_type, *rest.split(None, 1))

    def field(self, field_type: FieldType, name: str, default: str = "") -> FieldSpec:
        if not _FIELD_NAME.fullmatch(name):
            self.fail(
                f"'{name}' is not a field name: use lower case letters, digits and single underscores, "
                "starting with a letter and not ending with an underscore"
            )
        # The generated class could not be imported.
        if keyword.iskeyword(name):
            self.fail(f"Field '{name}' is a Python keyword; use another name")
        self._once(name)
        return FieldSpec(name, field_type, self.value(field_type, default) if default else None)

    def constant(self, field_type: FieldType, name: str, value: str) -> ConstantSpec:
        if not _CONSTANT_NAME.fullmatch(name):
            self.fail(
                f"'{name}' is not a constant's name: use upper case letters, digits and single underscores "
                "(a field's default is written without '=')"
            )
        if field_type.is_array or field_type.string_bound or "/" in field_type.base:
            self.fail(f"Constant '{name}' is of type {field_type}; constants have a primitive type")
        self._once(name)
        return ConstantSpec(name, field_type, self.value(field_type, value))

    def value(self, field_type: FieldType, text: str) -> object:
        if "/" in field_type.base:
            self.fail(f"A field of type {field_type} cannot have a default; set it in the program")
        try:
            return parse_value(field_type, text)
        except ValueError as error:
            self.fail(str(error))

    def _once(self, name: str) -> None:
        if name in self._seen:
            self.fail(f"'{name}' is already defined in line {self._seen[name]}")
        self._seen[name] = self._line

    def type(self, text: str) -> FieldType:
        match = _TYPE.fullmatch(text)
        if match is None:
            self.fail(f"'{text}' is not a type; write such as int32, string<=10, float64[3] or package/Name")
        base = self._base(match["package"], match["name"])
        bound = 0
        if match["string"] is not None:
            if base not in {"string", "wstring"}:
                self.fail(f"'{text}': only string and wstring take a length bound")
            bound = self._count(text, match["string"])
        if match["array"] is None:
            return FieldType(base, string_bound=bound)
        if not match["size"] and not match["most"]:
            return FieldType(base, string_bound=bound, is_array=True)
        size = self._count(text, match["size"])
        # A bound without elements costs nothing, but a fixed array is there in full in every new message.
        if not match["most"] and size > MAX_FIXED:
            self.fail(f"'{text}': a fixed size is at most {MAX_FIXED}; use [<={size}]")
        return FieldType(base, string_bound=bound, is_array=True, low=0 if match["most"] else size, high=size)

    def _count(self, text: str, digits: str) -> int:
        count = 0
        # As in rosidl, which reads `+5` and `1_000`, too. Python refuses to convert thousands of digits.
        with suppress(ValueError):
            count = int(digits)
        if not 0 < count < 2**32:
            self.fail(f"'{text}': a size or bound is an integer from 1 to {2**32 - 1}")
        return count

    def _base(self, package: str | None, name: str) -> str:
        if package is None:
            if name in PRIMITIVES:
                return name
            if name in {"time", "duration"}:
                self.fail(f"'{name}' is ROS 1's; use builtin_interfaces/{name.capitalize()}")
            package = package_of_name(name, self._package, lambda: self._has_header)
        if not PACKAGE_NAME.fullmatch(package):
            self.fail(f"'{package}' is not a package name")
        if self._derived_kind and DERIVED_NAME.fullmatch(name):
            return f"{package}/{self._derived_kind}/{name}"
        if not TYPE_NAME.fullmatch(name):
            self.fail(
                f"'{name}' is neither a primitive type ({', '.join(sorted(PRIMITIVES))}) nor a message name: "
                "these are CamelCase letters and digits"
            )
        return f"{package}/msg/{name}"


def without_comment(line: str) -> str:
    """Cut at the first `#` outside quotes."""
    quote = ""
    for index, character in enumerate(line):
        if quote:
            if character == quote and line[index - 1] != "\\":
                quote = ""
        # An apostrophe in a word, as in `it's # it's`, opens no string.
        elif character in "\"'" and line[index - 1 : index] in _BEFORE_QUOTE:
            quote = character
        elif character == "#":
            return line[:index]
    # Neither does one without a partner.
    return line.partition("#")[0] if quote else line


def parse(
    text: str,
    package: str,
    kind: str,
    name: str,
    source: str = "",
    *,
    has_header: bool = False,
    derived_kind: str = "",
) -> InterfaceSpec:
    """Parse the text of one interface.

    Args:
        text: The content of the file.
        package: Its package's name; types without a package are looked for there.
        kind: "msg", "srv" or "action".
        name: The interface's name, such as "String".
        source: Name of the text in errors; by default its type name.
        has_header: Whether the package has a message `Header`. Otherwise that name alone is
            std_msgs/Header, as in ROS 1.
        derived_kind: "srv" or "action": names such as X_Request are then allowed, and are of this kind.

    Raises:
        InterfaceSyntaxError: The text or a name breaks a rule.
    """
    source = source or f"{package}/{kind}/{name}"
    if kind not in PARTS:
        raise InterfaceSyntaxError(source, 0, f"'{kind}' is not a kind of interface; use msg, srv or action")
    # What a service or an action consists of has names that no file can have.
    check_names(package, name.partition("_")[0] if derived_kind else name, source)
    sections: list[list[tuple[int, str]]] = [[]]
    for number, line in enumerate(text.splitlines(), 1):
        if line.strip() == "---":
            sections.append([])
        else:
            sections[-1].append((number, line))
    if len(sections) != len(PARTS[kind]):
        raise InterfaceSyntaxError(
            source,
            0,
            f"A .{kind} file has {len(PARTS[kind]) - 1} separator lines '---'; this has {len(sections) - 1}",
        )
    reader = _Reader(package, source, has_header=has_header, derived_kind=derived_kind)
    return InterfaceSpec(package, kind, name, tuple(reader.part(section) for section in sections))


def read_source(path: Path) -> str:
    """Return the text of an interface's file.

    Raises:
        InterfaceSyntaxError: The file is too large or not UTF-8.
        OSError: The file cannot be read, or is no regular file.
    """
    content = read_regular(path, MAX_FILE_BYTES + 1)
    if len(content) > MAX_FILE_BYTES:
        raise InterfaceSyntaxError(str(path), 0, f"The file is larger than {MAX_FILE_BYTES} bytes")
    try:
        # Editors on Windows write a byte order mark.
        return TextIOWrapper(BytesIO(content), encoding="utf-8-sig").read()
    except UnicodeDecodeError as error:
        raise InterfaceSyntaxError(str(path), 0, f"The file is not UTF-8: {error}") from error


def parse_file(path: Path, package: str) -> InterfaceSpec:
    """Parse a `.msg`, `.srv`, `.action` or `.idl` file in a folder named as its kind.

    Its stem is the interface's name.

    Raises:
        InterfaceSyntaxError: The text or a name breaks a rule, or the file is too large or not UTF-8.
        OSError: The file cannot be read.
    """
    kind = path.suffix.removeprefix(".")
    if kind == "idl":
        return parse_idl(read_source(path), package, path.parent.name, path.stem, str(path))
    has_header = any((path.parent.parent / "msg" / f"Header.{each}").is_file() for each in ("msg", "idl"))
    return parse(read_source(path), package, kind, path.stem, str(path), has_header=has_header)

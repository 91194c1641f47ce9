"""Parses `.idl` files into specifications: the part of OMG IDL 4.2 that ROS 2 reads.

    module robot_interfaces {
      module msg {
        module Wheel_Constants { const uint8 LEFT = 1; };
        typedef double triple[3];
        @verbatim (language="comment", text="One of the wheels.")
        struct Wheel {
          @default (value=0.5) @unit (value="m")
          double radius;
          triple offset;
          sequence<std_msgs::msg::Header, 10> headers;
        };
      };
    };

A file has one struct for a message, two for a service (`X_Request`, `X_Response`), three for an action
(`X_Goal`, `X_Result`, `X_Feedback`). An error names the line of anything that ROS 2 does not read. Enums and
forward declarations are allowed, as in ROS 2, but no field can have such a type.
"""

from __future__ import annotations

import ast
import keyword
import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final, NoReturn

from actors.interfaces.definition import EMPTY_MEMBER
from actors.interfaces.errors import InterfaceSyntaxError
from actors.interfaces.fields import FieldType
from actors.interfaces.interface_names import PACKAGE_NAME, TYPE_NAME
from actors.interfaces.literals import idl_text, parse_value, render_value
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

if TYPE_CHECKING:
    from collections.abc import Iterator

MAX_DEPTH: Final = 16
"""Levels of nested modules; files of ROS have two or three."""
MAX_DIGITS: Final = 400
"""Digits of an integer: a double has up to 309, and converting many takes quadratic time."""
_TOKEN: Final = re.compile(
    r"""(?P<space>\s+|//[^\n]*|/\*.*?\*/)
    |(?P<include>\#include\s*(?:<[^>]+>|"[^"]+"))
    |(?P<float>(?:\d+\.\d*|\.\d+)(?:[eE][+-]?\d+)?[dD]?|\d+[eE][+-]?\d+|\d+[dD])
    |(?P<integer>0[xX][0-9a-fA-F]+|\d+)
    |(?P<string>L?"(?:[^"\\\n]|\\.)*")
    |(?P<name>[A-Za-z][A-Za-z0-9_]*)
    |(?P<mark>::|[{}()<>\[\];,=@:+*/%|&^~'-])""",
    re.VERBOSE | re.DOTALL | re.ASCII,
)
_TYPES: Final = {
    "short": "int16", "unsigned short": "uint16", "long": "int32", "unsigned long": "uint32",
    "long long": "int64", "unsigned long long": "uint64", "float": "float32", "double": "float64",
    "boolean": "bool", "octet": "byte", "string": "string", "wstring": "wstring",
    **{name: name for bits in (8, 16, 32, 64) for name in (f"int{bits}", f"uint{bits}")},
}  # fmt: skip
_NO_TYPES: Final = {
    "char": "uint8", "wchar": "uint16", "long double": "double", "fixed": "double", "any": "octet",
    "map": "sequence",
}  # fmt: skip
_NO_DEFINITIONS: Final = frozenset(
    {"union", "bitset", "bitmask", "native", "interface", "valuetype", "exception"}
)


@dataclass(frozen=True)
class _Token:
    kind: str
    text: str
    line: int

    @property
    def is_decimal(self) -> bool:
        """Whether it is an integer as ROS 2 reads them, which knows neither octal nor hexadecimal ones."""
        return self.kind == "integer" and (self.text[0] != "0" or self.text == "0")


@dataclass(frozen=True)
class _Struct:
    modules: tuple[str, ...]
    name: str
    fields: tuple[FieldSpec, ...]
    comment: str
    line: int


_Annotations = dict[str, dict[str, Any]]
"""Annotation to its parameters, by name. A value without a name has the name ""."""


class _Tokens:
    """The tokens of a file, read from the first to the last; keeps the line for errors."""

    def __init__(self, text: str, source: str) -> None:
        self._source = source
        self._line = 1
        self._tokens = list(self._split(text))
        self._next = 0

    def fail(self, reason: str, line: int | None = None) -> NoReturn:
        raise InterfaceSyntaxError(self._source, self._line if line is None else line, reason)

    def _split(self, text: str) -> Iterator[_Token]:
        position = 0
        while position < len(text):
            found = _TOKEN.match(text, position)
            if found is None:
                shown = text[position : position + 20].partition("\n")[0]
                self.fail(f"'{shown}' is not IDL that ROS 2 reads (of the preprocessor only #include is)")
            kind = str(found.lastgroup)
            if kind not in {"space", "include"}:
                yield _Token(kind, found[0], self._line)
            self._line += found[0].count("\n")
            position = found.end()
        yield _Token("end", "the end of the file", self._line)

    @property
    def token(self) -> _Token:
        return self._tokens[self._next]

    def advance(self) -> _Token:
        token = self.token
        self._line = token.line
        self._next += token.kind != "end"
        return token

    def accept(self, text: str) -> bool:
        if self.token.text == text and self.token.kind in {"mark", "name"}:
            self.advance()
            return True
        return False

    def expect(self, text: str) -> None:
        if not self.accept(text):
            self.fail(f"Expected '{text}', got {self.token.text}", self.token.line)

    def name(self) -> str:
        if self.token.kind != "name":
            self.fail(f"Expected a name, got {self.token.text}", self.token.line)
        return self.advance().text

    def scoped_name(self) -> str:
        parts = [self.name()] if not self.accept("::") else ["", self.name()]
        while self.accept("::"):
            parts.append(self.name())
        return "::".join(filter(None, parts))

    def literal(self) -> object:
        """Return the value of a literal, with a sign before it or without."""
        negative = self.accept("-")
        signed = negative or self.accept("+")
        token = self.advance()
        if token.is_decimal and len(token.text) <= MAX_DIGITS:
            return -int(token.text) if negative else int(token.text)
        if token.kind == "float":
            number = float(token.text.rstrip("dD"))
            return -number if negative else number
        if token.text in {"TRUE", "FALSE"} and not signed:
            return token.text == "TRUE"
        if token.kind == "string" and not signed:
            texts = [token.text]
            # Adjacent strings are one.
            while self.token.kind == "string":
                texts.append(self.advance().text)
            return "".join(_text_of(each) for each in texts)
        return self.fail(
            f"{token.text} is no value that ROS 2 reads: decimal numbers, strings, TRUE and FALSE are"
        )

    def annotations(self) -> _Annotations:
        found: _Annotations = {}
        while self.accept("@"):
            name = self.scoped_name()
            found[name] = self._parameters() if self.accept("(") else {}
        return found

    def _parameters(self) -> dict[str, Any]:
        parameters: dict[str, Any] = {}
        while True:
            name = ""
            if self.token.kind == "name" and self._tokens[self._next + 1].text == "=":
                name = self.name()
                self.expect("=")
            word = self.token.kind == "name" and self.token.text not in {"TRUE", "FALSE"}
            # A name is of something that the annotation knows: `@transfer_mode(SHMEM_REF)`.
            parameters[name] = self.scoped_name() if word else self.literal()
            if not self.accept(","):
                break
        self.expect(")")
        return parameters


class _Parser:
    """Reads the definitions of one file."""

    def __init__(self, tokens: _Tokens) -> None:
        self._tokens = tokens
        self._typedefs: dict[str, FieldType] = {}
        self._without_fields: set[str] = set()  # enums and forward declarations
        self.structs: list[_Struct] = []
        self.constants: dict[str, list[ConstantSpec]] = {}
        """Module name to its constants."""

    # Definitions

    def file(self) -> None:
        while self._tokens.token.kind != "end":
            self._definition(())

    def _definition(self, modules: tuple[str, ...]) -> None:
        annotations = self._tokens.annotations()
        start = self._tokens.token.line
        word = self._tokens.name()
        if word == "module":
            self._module(modules)
        elif word == "const":
            self._constant(modules, annotations)
        elif word == "typedef":
            self._typedef()
        elif word == "enum":
            self._enum()
        elif word == "struct":
            self._struct(modules, annotations, start)
        else:
            what = (
                f"'{word}' has no meaning in ROS 2"
                if word in _NO_DEFINITIONS
                else f"'{word}' is no definition"
            )
            self._tokens.fail(f"{what}; write a module, struct, const, typedef or enum")
        self._tokens.expect(";")

    def _module(self, modules: tuple[str, ...]) -> None:
        name = self._tokens.name()
        if len(modules) >= MAX_DEPTH:
            self._tokens.fail(f"Modules are nested more than {MAX_DEPTH} levels deep")
        self._tokens.expect("{")
        self._definition((*modules, name))
        while not self._tokens.accept("}"):
            self._definition((*modules, name))

    def _constant(self, modules: tuple[str, ...], annotations: _Annotations) -> None:
        kind = self._type()
        name = self._tokens.name()
        if kind.is_array or kind.string_bound or "/" in kind.base:
            self._tokens.fail(f"Constant '{name}' is of type {kind}; constants have a primitive type")
        self._tokens.expect("=")
        value = self._value(kind)
        if keyword.iskeyword(name):
            self._tokens.fail(f"Constant '{name}' is a Python keyword; use another name")
        own = self.constants.setdefault(modules[-1] if modules else "", [])
        self._once(name, [each.name for each in own])
        own.append(ConstantSpec(name, kind, value, _comment(annotations)))

    def _typedef(self) -> None:
        kind = self._type()
        name, kind = self._declarator(kind)
        if self._tokens.token.text == ",":
            self._tokens.fail("A typedef has one name; write another typedef", self._tokens.token.line)
        if self._typedefs.setdefault(name, kind) != kind:
            self._tokens.fail(f"'{name}' is already another type")

    def _enum(self) -> None:
        self._without_fields.add(self._tokens.name())
        self._tokens.expect("{")
        self._tokens.annotations()
        self._tokens.name()
        while self._tokens.accept(","):
            self._tokens.annotations()
            self._tokens.name()
        self._tokens.expect("}")

    def _struct(self, modules: tuple[str, ...], annotations: _Annotations, line: int) -> None:
        name = self._tokens.name()
        if self._tokens.token.text == ";":
            self._without_fields.add(name)
            return
        if self._tokens.token.text == ":":
            self._tokens.fail(
                f"Struct '{name}' has a base, which ROS 2 does not know; repeat the fields",
                self._tokens.token.line,
            )
        self._tokens.expect("{")
        fields: list[FieldSpec] = []
        while not self._tokens.accept("}"):
            for field in self._member():
                self._once(field.name, [each.name for each in fields])
                fields.append(field)
            if len(fields) > MAX_FIELDS:
                self._tokens.fail(f"More than {MAX_FIELDS} fields; split the message")
        if not fields:
            self._tokens.fail(f"Struct '{name}' is empty; write the field uint8 {EMPTY_MEMBER}")
        if [each.name for each in fields] == [EMPTY_MEMBER]:
            fields = []
        self.structs.append(_Struct(modules, name, tuple(fields), _comment(annotations), line))

    def _member(self) -> Iterator[FieldSpec]:
        annotations = self._tokens.annotations()
        base = self._type()
        while True:
            name, kind = self._declarator(base)
            if keyword.iskeyword(name):
                self._tokens.fail(f"Field '{name}' is a Python keyword; use another name")
            default = annotations.get("default", {"value": None})
            if "value" not in default:
                self._tokens.fail(f"The default of '{name}' has no value; write @default (value=1)")
            value = None if default["value"] is None else self._checked(kind, default["value"])
            yield FieldSpec(name, kind, value, _comment(annotations))
            if not self._tokens.accept(","):
                break
        self._tokens.expect(";")

    def _once(self, name: str, others: list[str]) -> None:
        if name in others:
            self._tokens.fail(f"'{name}' is already defined")

    def _declarator(self, kind: FieldType) -> tuple[str, FieldType]:
        """Return a declared name, and its type: `name` or `name[3]`."""
        name = self._tokens.name()
        if not self._tokens.accept("["):
            return name, kind
        size = self._size()
        self._tokens.expect("]")
        if self._tokens.token.text == "[":
            self._tokens.fail(
                f"'{name}' has two dimensions, which ROS 2 does not know; write one", self._tokens.token.line
            )
        if kind.is_array:
            self._tokens.fail(
                f"'{name}' is an array of sequences, which ROS 2 does not know; put them into a message"
            )
        if size > MAX_FIXED:
            self._tokens.fail(f"A fixed size is at most {MAX_FIXED}; write a sequence with a bound")
        return name, replace(kind, is_array=True, low=size, high=size)

    # Types

    def _type(self) -> FieldType:
        if self._tokens.accept("sequence"):
            return self._sequence()
        if self._tokens.token.text == "::":
            return self._named(self._tokens.scoped_name())
        words = self._tokens.name()
        while words in {"unsigned", "long", "unsigned long"} and self._tokens.token.text in {
            "short",
            "long",
            "double",
        }:
            words += f" {self._tokens.name()}"
        if words in _NO_TYPES:
            self._tokens.fail(f"ROS 2 cannot send a {words}; use {_NO_TYPES[words]}, for example")
        base = _TYPES.get(words)
        if base is None:
            rest = f"::{self._tokens.scoped_name()}" if self._tokens.accept("::") else ""
            return self._named(words + rest)
        if base not in {"string", "wstring"} or not self._tokens.accept("<"):
            return FieldType(base)
        bound = self._size()
        self._tokens.expect(">")
        return FieldType(base, string_bound=bound)

    def _sequence(self) -> FieldType:
        self._tokens.expect("<")
        # Checked before the element is read, which is recursive: a file may nest any number of them.
        if self._tokens.token.text == "sequence" or (element := self._type()).is_array:
            self._tokens.fail(
                "A sequence of sequences or arrays is unknown in ROS 2; put the inner one into a message"
            )
        high = self._size() if self._tokens.accept(",") else None
        self._tokens.expect(">")
        return replace(element, is_array=True, high=high)

    def _named(self, name: str) -> FieldType:
        if name in self._typedefs:
            return self._typedefs[name]
        if name.rpartition("::")[2] in self._without_fields:
            self._tokens.fail(
                f"'{name}' is an enum, or has no fields here; ROS 2 has no fields of such types, use uint8"
            )
        package, kind, message = [*name.split("::"), "", ""][:3]
        if name.count("::") != 2 or kind != "msg" or not PACKAGE_NAME.fullmatch(package):
            self._tokens.fail(
                f"'{name}' is no type defined above, and no message, such as std_msgs::msg::Header"
            )
        if not TYPE_NAME.fullmatch(message):
            self._tokens.fail(f"'{message}' is not a message name: these are CamelCase letters and digits")
        return FieldType(f"{package}/msg/{message}")

    def _size(self) -> int:
        token = self._tokens.advance()
        if not (token.is_decimal and 0 < int(token.text[:12]) < 2**32):
            self._tokens.fail(f"A size or bound is an integer from 1 to {2**32 - 1}, got {token.text}")
        return int(token.text)

    # Values

    def _value(self, kind: FieldType) -> object:
        return self._checked(kind, self._tokens.literal())

    def _checked(self, kind: FieldType, value: Any) -> object:
        """Return a value of a type; an array's is the text of a Python tuple."""
        try:
            if kind.is_array and isinstance(value, str):
                value = list(ast.literal_eval(value))
            return parse_value(kind, _rendered(kind, value))
        except (ValueError, SyntaxError, TypeError, MemoryError, RecursionError) as error:
            self._tokens.fail(f"{value!r} is not a value of type {kind}: {error}")


def _text_of(literal: str) -> str:
    if literal.startswith("L"):
        unicode = re.compile(r"\\u([0-9a-fA-F]{1,4})")
        return idl_text(unicode.sub(lambda found: chr(int(found[1], 16)), literal[2:-1]))
    return idl_text(literal[1:-1])


def _rendered(kind: FieldType, value: Any) -> str:
    """Return a value as text, so that there is one check of types and ranges."""
    if kind.base in {"string", "wstring"}:
        if not all(isinstance(each, str) for each in (value if kind.is_array else [value])):
            raise ValueError("expected a string")
        return render_value(kind, value)
    if kind.is_array:
        element = replace(kind, is_array=False, low=0, high=None)
        return "[" + ", ".join(_rendered(element, each) for each in value) + "]"
    if isinstance(value, bool) and kind.base != "bool":
        raise ValueError("expected a number")
    return str(value)


def _comment(annotations: _Annotations) -> str:
    verbatim, unit = annotations.get("verbatim", {}), annotations.get("unit", {}).get("value")
    lines = str(verbatim.get("text", "")).splitlines() if verbatim.get("language") == "comment" else []
    text = comment_text(lines)
    return text if unit is None else f"{text} [{unit}]".strip()


def parse_idl(text: str, package: str, kind: str, name: str, source: str = "") -> InterfaceSpec:
    """Parse the text of an `.idl` file.

    Args:
        text: The content of the file.
        package: Its package's name.
        kind: "msg", "srv" or "action": the folder that it is in.
        name: The interface's name, such as "String": the file's.
        source: Name of the text in errors; by default its type name.

    Raises:
        InterfaceSyntaxError: The text breaks a rule, or does not define this interface.
    """
    source = source or f"{package}/{kind}/{name}"
    check_names(package, name, source)
    tokens = _Tokens(text, source)
    parser = _Parser(tokens)
    parser.file()
    names = [f"{name}_{part}" if part else name for part in PARTS[kind]]
    if [each.name for each in parser.structs] != names:
        found = ", ".join(each.name for each in parser.structs) or "none"
        tokens.fail(f"A file for {kind}/{name} has the structs {', '.join(names)}; this has {found}", 0)
    for struct in parser.structs:
        if struct.modules != (package, kind):
            tokens.fail(
                f"Struct '{struct.name}' must be in module {package} and in it module {kind}", struct.line
            )
    parts: list[MessageSpec] = []
    for struct in parser.structs:
        constants = parser.constants.get(f"{struct.name}_Constants", [])
        both = {each.name for each in struct.fields} & {each.name for each in constants}
        if both:
            tokens.fail(
                f"'{min(both)}' is a constant and a field of '{struct.name}'; rename one", struct.line
            )
        parts.append(MessageSpec(struct.fields, tuple(constants), struct.comment))
    return InterfaceSpec(package, kind, name, tuple(parts))

"""Writes the Python module of one parsed interface.

Fields, constants and types may have any name that ROS allows. Where the module itself uses such a name, it
imports what it means with an underscore in front, which no name in ROS has.

The text is as `ruff format` leaves it, the same for the same specification, and passes mypy --strict and
pyright strict.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final, cast

from actors.interfaces.comments import placeholder
from actors.interfaces.fields import BINARY
from actors.interfaces.specs import PARTS

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.interfaces.fields import FieldType
    from actors.interfaces.specs import ConstantSpec, FieldSpec, InterfaceSpec, MessageSpec

WIDTH: Final = 110
_INDENT: Final = "    "
_BUILTIN: Final = {"bool": "bool", "string": "str"}
_CAMEL: Final = {"int": "Int", "uint": "UInt", "float": "Float"}
_ZERO: Final = {
    "bool": "False",
    "float32": "0.0",
    "float64": "0.0",
    "string": '""',
    "wstring": '""',
    "byte": 'b"\\x00"',
}
_STANDARD: Final = frozenset({"builtins", "typing"})
"""Modules of the standard library that are imported."""
_MODULES: Final = frozenset({"msgspec"})
"""Modules that are imported themselves, not names of them."""
_BASES: Final = {"msg": "Message", "srv": "Service", "action": "Action"}


def module_name(name: str) -> str:
    """Return the module of an interface: "UInt8MultiArray" → "_u_int8_multi_array"."""
    spaced = re.sub(r"(.)([A-Z][a-z]+)", r"\1_\2", name)
    return "_" + re.sub(r"([a-z0-9])([A-Z])", r"\1_\2", spaced).lower()


def sequence_name(base: str) -> str:
    """Return the stem of a numeric sequence's names: "uint8" → "UInt8"."""
    match = re.fullmatch(r"([a-z]+)(\d*)", base)
    assert match is not None
    return _CAMEL.get(match[1], match[1].capitalize()) + match[2]


def quoted(text: str) -> str:
    """Return a str literal with double quotes, as the formatter wants it."""
    plain = repr(text)
    if plain[0] == '"' or '"' in text:
        return plain
    return '"' + plain[1:-1] + '"'


def _double(literal: str) -> str:
    return 'b"' + literal[2:-1] + '"' if literal[1] == "'" and '"' not in literal else literal


class _Module:
    """Collects one module's imports while its classes are written."""

    def __init__(self, spec: InterfaceSpec, module_of: Callable[[str], str], root: str) -> None:
        self._spec = spec
        self._root = root
        self._module_of = module_of
        self._imports: dict[str, set[str]] = {}
        self._local_names = self._message_names()
        # Names with a meaning of their own in the module or in a class of it.
        self._taken = {spec.name, *PARTS[spec.kind], *self._local_names.values()}
        for part in spec.parts:
            self._taken |= {each.name for each in part.fields} | {each.name for each in part.constants}

    def _message_names(self) -> dict[str, str]:
        """Map each message type used to its name here: with its package's in front where two clash."""
        dependencies = sorted(self._spec.dependencies)
        taken = {*_BASES.values(), "Annotated", "ClassVar", "AtMost", "Length"}
        taken |= {self._spec.name, *PARTS[self._spec.kind]}
        for part in self._spec.parts:
            taken |= {each.name for each in part.fields} | {each.name for each in part.constants}
        shorts = [type_name.rpartition("/")[2] for type_name in dependencies]
        names: dict[str, str] = {}
        for type_name, short in zip(dependencies, shorts, strict=True):
            package = type_name.partition("/")[0]
            clashes = (
                short in taken or shorts.count(short) > 1 or re.fullmatch(r".*\d+(Array|Sequence)", short)
            )
            prefix = "".join(part.capitalize() for part in package.split("_")) if clashes else ""
            # Or `a1_b/C` and `a1b/C` would both be `A1bC`.
            unique = prefix + short not in {*names.values(), *shorts, *taken}
            names[type_name] = prefix + short if unique or not clashes else f"{package}_{short}"
        return names

    def _import(self, module: str, name: str) -> str:
        """Import a name; "" is the module itself. Return what it is called here."""
        plain = name or module
        local = f"_{plain}" if plain in self._taken else plain
        self._imports.setdefault(module, set()).add(plain if local == plain else f"{plain} as {local}")
        return local

    def _builtin(self, name: str) -> str:
        return self._import("builtins", name) if name in self._taken else name

    def _annotated(self) -> str:
        return self._import("typing", "Annotated")

    def _type(self, name: str) -> str:
        return self._import("actors.interfaces.types", name)

    def _base(self, name: str) -> str:
        return self._import("actors.interfaces.message", name)

    def _message(self, type_name: str) -> str:
        local, short = self._local_names[type_name], type_name.rpartition("/")[2]
        names = self._imports.setdefault(self._module_of(type_name), set())
        names.add(short if local == short else f"{short} as {local}")
        return local

    def _scalar(self, field_type: FieldType) -> str:
        base = field_type.base
        if "/" in base:
            return self._message(base)
        builtin = _BUILTIN.get(base)
        name = self._builtin(builtin) if builtin else self._type(base)
        if field_type.string_bound:
            return f"{self._annotated()}[{name}, {self._type('AtMost')}({field_type.string_bound})]"
        return name

    def annotation(self, field_type: FieldType) -> str:
        """Return the Python annotation of a field."""
        if not field_type.is_array:
            return self._scalar(field_type)
        if field_type.base in {"bool", "string", "wstring"} or "/" in field_type.base:
            text = f"{self._builtin('list')}[{self._scalar(field_type)}]"
        else:
            text = self._type(f"{sequence_name(field_type.base)}Sequence")
        if field_type.high is None:
            return text
        bound = self._type("Length" if field_type.is_fixed else "AtMost")
        return f"{self._annotated()}[{text}, {bound}({field_type.high})]"

    def _literal(self, value: object) -> str:
        if isinstance(value, str):
            return quoted(value)
        if isinstance(value, bytes):
            return _double(repr(value))
        if isinstance(value, float) and value in {float("inf"), float("-inf")}:
            return f'{self._builtin("float")}("{value}")'
        if value != value:  # noqa: PLR0124 - only NaN differs from itself
            return f'{self._builtin("float")}("nan")'
        return repr(value)

    def _array_default(self, field_type: FieldType, default: object) -> str | _Group:
        base = field_type.base
        if base in BINARY:
            if default is not None:
                values = cast("list[Any]", default)
                return _double(repr(bytes(each[0] if isinstance(each, bytes) else each for each in values)))
            return f"{self._builtin('bytes')}({field_type.high})" if field_type.is_fixed else 'b""'
        is_list = base in {"bool", "string", "wstring"} or "/" in base
        content: str | _Group = ""
        if default is not None:
            content = _Group("[", [self._literal(each) for each in cast("list[object]", default)], "]")
        elif field_type.is_fixed and "/" in base:
            # Made one by one: `[Pose()] * 3` would be one object three times.
            content = _Group("[", [f"{self._message(base)}() for _ in range({field_type.high})"], "]")
        elif field_type.is_fixed:
            content = f"[{_ZERO.get(base, '0')}] * {field_type.high}"
        if not is_list:
            array = self._type(f"{sequence_name(base)}Array")
            return self._made_by(_Group(f"lambda: {array}(", [content], ")") if content else array)
        if isinstance(content, _Group):
            return self._made_by(replace(content, head="lambda: ["))
        element = self._scalar(replace(field_type, is_array=False, low=0, high=None))
        return self._made_by(f"lambda: {content}" if content else f"{self._builtin('list')}[{element}]")

    def _made_by(self, factory: str | _Group) -> _Group:
        """Return the default that a factory makes."""
        if isinstance(factory, _Group):
            factory = replace(factory, head=f"default_factory={factory.head}")
        else:
            factory = f"default_factory={factory}"
        return _Group(f"{self._import('msgspec', '')}.field(", [factory], ")")

    def default(self, field: FieldSpec) -> str | _Group:
        """Return the Python expression of a field's default."""
        if field.type.is_array:
            return self._array_default(field.type, field.default)
        if "/" in field.type.base:
            return self._made_by(self._message(field.type.base))
        if field.default is not None:
            return self._literal(field.default)
        return _ZERO.get(field.type.base, "0")

    def _constant(self, constant: ConstantSpec) -> _Attribute:
        annotation = f"{self._import('typing', 'ClassVar')}[{self._scalar(constant.type)}]"
        return _Attribute(constant.name, annotation, self._literal(constant.value), constant.comment)

    def body(self, message: MessageSpec, indent: str) -> list[str]:
        """Return the lines of a message class's body, after its docstring."""
        constants = [self._constant(constant) for constant in message.constants]
        fields = [
            _Attribute(field.name, self.annotation(field.type), self.default(field), field.comment)
            for field in message.fields
        ]
        lines = [[line for each in group for line in each.lines(indent)] for group in (constants, fields)]
        return lines[0] + ([""] if constants and fields else []) + lines[1]

    def text(self) -> str:
        """Return the whole module."""
        spec = self._spec
        arguments = f'{self._base(_BASES[spec.kind])}, type_name="{spec.type_name}"'
        if spec.kind == "msg":
            body = self.body(spec.parts[0], _INDENT)
        else:
            body = list[str]()
            for part, message in zip(PARTS[spec.kind], spec.parts, strict=True):
                if body:
                    body.append("")
                # The comment above the first part is about the whole.
                comment = message.comment if body else ""
                inner = self.body(message, 2 * _INDENT)
                body += _class(
                    f"{part}({self._base('Message')})", comment or placeholder(part), inner, _INDENT
                )
        comment = spec.parts[0].comment or placeholder(spec.type_name)
        main = _class(f"{spec.name}({arguments})", comment, body)
        head = [f'"""{placeholder(spec.type_name)}"""', "", *self._import_lines(), "", ""]
        return "\n".join([*head, *main]) + "\n"

    def _import_lines(self) -> list[str]:
        # In sections, sorted as ruff's isort rules do it in the package's own project.
        own = self._root.partition(".")[0]
        sections: list[list[str]] = [[], [], []]
        for module in sorted(self._imports, key=lambda module: (module not in _MODULES, module)):
            number = 0 if module in _STANDARD else 2 if module.partition(".")[0] == own else 1
            sections[number] += _import_statements(module, self._imports[module])
        lines: list[str] = []
        for section in filter(None, sections):
            lines += ([""] if lines else []) + section
        return [line for entry in lines for line in entry.split("\n")]


def _import_order(name: str) -> tuple[int, str, str]:
    """Sort names as ruff's isort rules do: constants, classes, then the rest."""
    plain = name.partition(" ")[0]
    kind = 0 if plain.isupper() and len(plain) > 1 else 1 if plain[:1].isupper() else 2
    return kind, re.sub(r"\d+", lambda found: found[0].zfill(6), plain), plain


def _import_statements(module: str, names: set[str]) -> list[str]:
    if module in _MODULES:
        return [f"import {name}" for name in names]
    plain = sorted((name for name in names if " as " not in name), key=_import_order)
    renamed = [[name] for name in names if " as " in name]
    groups = sorted(filter(None, [plain, *renamed]), key=lambda group: _import_order(group[0]))
    return [_import_line(module, group) for group in groups]


def _import_line(module: str, names: list[str]) -> str:
    line = f"from {module} import {', '.join(names)}"
    if len(line) <= WIDTH:
        return line
    return "\n".join([f"from {module} import (", *(f"    {name}," for name in names), ")"])


@dataclass(frozen=True)
class _Group:
    """An expression in brackets, which may be written over several lines."""

    head: str  # up to and with the opening bracket
    items: list[str | _Group]
    tail: str

    def __str__(self) -> str:
        return f"{self.head}{', '.join(map(str, self.items))}{self.tail}"

    def lines(self, indent: str, prefix: str) -> list[str]:
        """Return the lines of a statement that begins with `prefix`, as the formatter breaks it."""
        flat = f"{indent}{prefix}{self}"
        if len(flat) <= WIDTH:
            return [flat]
        inner = indent + _INDENT
        body = inner + ", ".join(map(str, self.items))
        if self.head.endswith("[") and len(self.items) > 1:
            items = [line for each in self.items for line in _expression(each, inner, "", ",")]
        else:
            # Every call in these modules has one argument.
            items = [body] if len(body) <= WIDTH else _expression(self.items[0], inner, "")
        return [f"{indent}{prefix}{self.head}", *items, f"{indent}{self.tail}"]


def _expression(value: str | _Group, indent: str, prefix: str, suffix: str = "") -> list[str]:
    lines = [f"{indent}{prefix}{value}"] if isinstance(value, str) else value.lines(indent, prefix)
    return [*lines[:-1], lines[-1] + suffix]


@dataclass(frozen=True)
class _Attribute:
    """A field or constant in a class body."""

    name: str
    annotation: str
    value: str | _Group
    comment: str

    def lines(self, indent: str) -> list[str]:
        """Return its statement, and its comment as the docstring below it."""
        prefix = f"{self.name}: {self.annotation} = "
        value, before = self.value, list[str]()
        head = value.head if isinstance(value, _Group) else "("
        if len(f"{indent}{prefix}{value}") > WIDTH:
            if len(f"{indent}{prefix}{head}") > WIDTH and self.annotation.endswith("]"):
                outer, _, inner = self.annotation.partition("[")
                before = [f"{indent}{self.name}: {outer}[", f"{indent}{_INDENT}{inner[:-1]}"]
                prefix = "] = "
            # The formatter does this to whatever is too long beside a type with brackets.
            elif isinstance(value, str) and (
                self.annotation.endswith("]") or len(f"{indent}{_INDENT}{value}") <= WIDTH
            ):
                value = _Group("(", [value], ")")
        return [*before, *_expression(value, indent, prefix), *_docstring(self.comment, indent)]


def _docstring(text: str, indent: str) -> list[str]:
    """Return the lines of a docstring, none for an empty text."""
    if not text:
        return []
    # Of what cannot be printed only a newline may stand for itself.
    escaped = "".join(
        each if each == "\n" or (each.isprintable() and each != "\\") else repr(each)[1:-1] for each in text
    )
    # Three quotation marks, or one beside the last three, would end the docstring.
    end = r'"""' if "\n" in text else r'"""|"$'
    escaped = re.sub(end, lambda found: found[0].replace('"', '\\"'), escaped)
    first, *rest = escaped.split("\n")
    if first.startswith('"'):
        first = f" {first}"
    if rest:
        inner = [f"{indent}{line}" if line else "" for line in rest]
        return [f'{indent}"""{first}', *inner, f'{indent}"""']
    return [f'{indent}"""{first}"""']


def _class(head: str, comment: str, body: list[str], indent: str = "") -> list[str]:
    """Return the lines of a class, whose head is such as "SetBool(Service)"."""
    lines = [f"{indent}class {head}:"]
    if len(lines[0]) > WIDTH:
        name, _, arguments = head.partition("(")
        lines = [f"{indent}class {name}(", f"{indent}{_INDENT}{arguments[:-1]}", f"{indent}):"]
    lines += _docstring(comment, indent + _INDENT)
    return [*lines, "", *body] if body else lines


def render_module(spec: InterfaceSpec, module_of: Callable[[str], str], root: str) -> str:
    """Return the Python module of `spec`.

    Args:
        spec: The parsed interface.
        module_of: Gives the module that holds a message, from its type name.
        root: The Python package of the interface package, such as "actors.interfaces.std_msgs".
    """
    return _Module(spec, module_of, root).text()


def _init_imports(folder: str, names: list[str]) -> list[str]:
    lines: list[str] = []
    for module, name in sorted(
        ((module_name(name), name) for name in names), key=lambda each: _import_order(each[0])
    ):
        line = f"    from {folder}.{module} import {name}"
        long = [f"    from {folder}.{module} import (", f"        {name},", "    )"]
        lines += [line] if len(line) <= WIDTH else long
    return lines


def render_init(package: str, kind: str, names: list[str], root: str) -> str:
    """Return the `__init__.py` of a package's `msg`, `srv` or `action` folder.

    Args:
        package: The interface package's name.
        kind: "msg", "srv" or "action".
        names: The interfaces' names.
        root: The Python package of the interface package, such as "actors.interfaces.std_msgs".
    """
    title = {"msg": "Messages", "srv": "Services", "action": "Actions"}[kind]
    ordered = sorted(names)
    imports = _init_imports(f"{root}.{kind}", ordered)
    return "\n".join(
        [
            f'"""{title} of {package}."""',
            "",
            "from typing import TYPE_CHECKING",
            "",
            "from actors.interfaces.lazy import lazy_exports",
            "",
            "if TYPE_CHECKING:",
            *imports,
            "",
            "__all__ = [",
            *(f'    "{name}",' for name in sorted(names, key=_import_order)),
            "]",
            "",
            "if not TYPE_CHECKING:",
            "    __getattr__ = lazy_exports(",
            "        __name__,",
            "        {",
            *(f'            "{name}": "{module_name(name)}",' for name in ordered),
            "        },",
            "    )",
            "",
        ]
    )

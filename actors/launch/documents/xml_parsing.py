"""ROS 2's XML launch files, as the same plain data that YAML files give.

    <launch>
      <arg name="speed" default="1.5"/>
      <node pkg="my_package" exec="talker"><param name="speed" value="$(var speed)"/></node>
    </launch>

Attributes are keys. An element within another one is an entry of the key of its name, such as `param`, or
else an action: an entry of `children` or `do`. As in ROS 2, what an include sets also applies after it,
unless it is `scoped`.

The same table of elements reads YAML, TOML and XML. So a new option or element needs no code here.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final, cast
from xml.parsers import expat

from actors.launch.description.conditions import parse_bool
from actors.launch.documents.elements import BY_NAME, UNSUPPORTED
from actors.launch.documents.errors import DocumentError, Location
from actors.launch.documents.kinds import SWITCH
from actors.launch.documents.parameters import ParameterKind
from actors.launch.documents.parsing import MAX_DEPTH
from actors.launch.errors import LaunchError
from actors.launch.planning.parameter_values import value_from_text
from proto.untrusted_text import escape

_ROOT_ATTRIBUTES: Final = {"version", "deprecated"}
"""Attributes of ROS 2's files without a meaning here."""


@dataclass
class _Node:
    """An XML element."""

    tag: str
    attributes: dict[str, str]
    line: int
    children: list[_Node] = field(default_factory=list["_Node"])


class XmlDocument:
    """An XML launch file.

    Args:
        source: Its bytes.

    Raises:
        DocumentError: It is not XML, or not a launch file.

    Attributes:
        data: The data of a YAML file with the same content.
    """

    def __init__(self, source: bytes) -> None:
        self._lines: dict[tuple[str | int, ...], int] = {}
        root = _parse(source)
        if root.tag != "launch":
            raise DocumentError("a launch file begins with <launch>", Location(), root.line)
        for name in root.attributes:
            if name not in _ROOT_ATTRIBUTES:
                hint = f"; there is {', '.join(sorted(_ROOT_ATTRIBUTES))}"
                raise DocumentError(
                    f"<launch> has no attribute '{escape(name)}'{hint}", Location(), root.line
                )
        self.data = {"launch": self._elements(root.children, ("launch",))}

    def line(self, location: Location) -> int | None:
        """Return the line, from 1, of a location in it, or of the element around it; None for the file."""
        ends = range(len(location.path), 0, -1)
        return next(
            (self._lines[location.path[:end]] for end in ends if location.path[:end] in self._lines), None
        )

    def _elements(self, nodes: list[_Node], path: tuple[str | int, ...]) -> list[object]:
        return [self._element(each, (*path, at)) for at, each in enumerate(nodes)]

    def _element(self, node: _Node, path: tuple[str | int, ...]) -> dict[str, object]:
        _rewrite(node)
        path = (*path, node.tag)
        self._lines[path[:-1]] = self._lines[path] = node.line
        if node.tag in UNSUPPORTED:
            return {node.tag: dict(node.attributes)}  # components in it have a structure of their own
        # An unknown element is passed on: the table reports it, as in YAML.
        known = BY_NAME.get(node.tag)
        keys = {name: key for key in known.keys for name in key.names} if known else {}
        body: dict[str, object] = {}
        for name, text in node.attributes.items():
            kind = keys[name].kind if name in keys else None
            # All attributes are strings. Kinds that read strings need no help; these two would not.
            body[name] = _switch(text) if kind is SWITCH else text
            if isinstance(kind, ParameterKind):
                body[name] = _parameter(text, Location((*path, name)), node.line)
        inner = next((name for name in ("children", "do") if name in keys), None)
        if inner:
            body.setdefault(inner, [])  # a group without actions is allowed, as in ROS 2
        for child in node.children:
            # `<param>` in a node is a key. In a group it would be an action, which the table then refuses.
            key = child.tag if child.tag in keys or inner is None else inner
            listed = body.setdefault(key, [])
            if not isinstance(listed, list):
                raise DocumentError(f"'{escape(key)}' is there twice", Location(path), child.line)
            entries = cast("list[object]", listed)
            within = (*path, key, len(entries))
            entries.append(self._element(child, within) if key == inner else self._record(child, within))
        return {node.tag: body}

    def _record(self, node: _Node, path: tuple[str | int, ...]) -> dict[str, object]:
        """Return an entry of a key, such as `param`, in which there may be others."""
        self._lines[path] = node.line
        body: dict[str, object] = dict(node.attributes)
        if node.tag == "param" and "value" in body:
            text, separator = node.attributes["value"], body.pop("value-sep", "")
            # With a type the string is converted when it is planned.
            texts = text.split(str(separator)) if separator else [text]
            location = Location((*path, "value"))
            read = texts if "type" in body else [_parameter(each, location, node.line) for each in texts]
            body["value"] = read if separator else read[0]
        if node.children:
            tag = node.children[0].tag
            body[tag] = [self._record(each, (*path, tag, at)) for at, each in enumerate(node.children)]
            for each in node.children:
                if each.tag != tag:
                    text = f"<{escape(tag)}> and <{escape(each.tag)}> cannot both be in <{escape(node.tag)}>"
                    raise DocumentError(text, Location(path), each.line)
        return body


def _rewrite(node: _Node) -> None:
    """Replace an element of ROS 2 by a more general one."""
    if node.tag == "include":
        # In ROS 2 what an included file sets applies after the include, too.
        node.attributes = {"scoped": "false", **node.attributes}
    elif node.tag == "ros_timer":
        node.tag = "timer"
    elif node.tag == "set_use_sim_time":
        node.tag, node.attributes = "set_parameter", {"name": "use_sim_time", **node.attributes}
    elif node.tag == "set_ros_log_dir":
        value = node.attributes.pop("new_log_dir", "")
        node.tag, node.attributes = "set_env", {"name": "ROS_LOG_DIR", "value": value, **node.attributes}


def _switch(text: str) -> bool | str:
    value = parse_bool(text)
    return text if value is None else value  # the table reports another word


def _parameter(text: str, location: Location, line: int) -> object:
    """Return the value of a string without substitutions; with them it is read when they have values."""
    if "$(" in text:
        return text  # its value is read as YAML when it is known
    try:
        return value_from_text(text)
    except LaunchError as error:
        raise DocumentError(str(error), location, line) from None


def _parse(source: bytes) -> _Node:
    # expat and not ElementTree, which has no lines.
    parser = expat.ParserCreate()
    stack = [_Node("", {}, 0)]

    def error(text: str) -> DocumentError:
        return DocumentError(text, Location(), parser.CurrentLineNumber)

    def start(tag: str, attributes: dict[str, str]) -> None:
        if len(stack) > MAX_DEPTH:
            raise error(f"it is nested deeper than {MAX_DEPTH}")
        node = _Node(tag, attributes, parser.CurrentLineNumber)
        stack[-1].children.append(node)
        stack.append(node)

    def end(_tag: str) -> None:
        stack.pop()

    def characters(text: str) -> None:
        if text.strip():  # ROS 2 ignores it; it is a value that was meant to be an attribute
            raise error(f"text outside of attributes: '{escape(text.strip())}'")

    def declaration(*_given: object) -> None:
        # With entities that refer to each other a small file can become any size.
        raise error("document types and entities cannot be declared")

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler = characters
    parser.StartDoctypeDeclHandler = parser.EntityDeclHandler = declaration
    try:
        parser.Parse(source, True)  # noqa: FBT003 - it is the whole file
    except expat.ExpatError as problem:
        text = expat.ErrorString(problem.code)
        raise DocumentError(f"it is not XML: {text}", Location(), problem.lineno) from None
    return stack[0].children[0]

"""How ROS 2 reads interfaces: rosidl_adapter makes IDL of the other files, and rosidl_parser reads it."""

from __future__ import annotations

from ast import literal_eval

from lark import Token, Tree
from rosidl_adapter.msg import string_to_idl_string_literal
from rosidl_adapter.parser import parse_action_string, parse_message_string, parse_service_string
from rosidl_parser.definition import (
    EMPTY_STRUCTURE_REQUIRED_MEMBER_NAME,
    AbstractGenericString,
    AbstractNestedType,
    AbstractWString,
    Action,
    Array,
    BoundedSequence,
    Message,
    NamespacedType,
    Service,
)
from rosidl_parser.parser import get_string_literal_value, parse_idl_string

PACKAGE = "robot_msgs"
_NAMES = {"boolean": "bool", "octet": "byte", "float": "float32", "double": "float64"}


def parse(kind, text):
    """Return the fields and constants of each part, with their types and values.

    Args:
        kind: "msg", "srv" or "action".
        text: The content of the file.
    """
    return [_part(part) for part in _parts(kind, text)]


def _parts(kind, text):
    if kind == "msg":
        return [parse_message_string(PACKAGE, "Probe", text)]
    if kind == "srv":
        service = parse_service_string(PACKAGE, "Probe", text)
        return [service.request, service.response]
    action = parse_action_string(PACKAGE, "Probe", text)
    return [action.goal, action.result, action.feedback]


def _part(message):
    return {
        "fields": [
            (field.name, str(field.type), _generated(field.default_value)) for field in message.fields
        ],
        "constants": [(each.name, each.type, _generated(each.value)) for each in message.constants],
    }


def _generated(value):
    """Return a value as it arrives in the generated code: strings travel through an `.idl` file."""
    if isinstance(value, list) and value and isinstance(value[0], str):
        content = repr(tuple(value)).replace("\\", r"\\").replace('"', r"\"")
        return list(literal_eval(_read(f'"{content}"')))
    if not isinstance(value, str):
        return value
    literal = string_to_idl_string_literal(value).encode("iso-8859-1").decode()
    if "\n" in literal or "\r" in literal:
        raise ValueError("no line of an .idl file")
    return _read(literal)


def _read(literal):
    return get_string_literal_value(Tree("string_literal", [Token("ESCAPED_STRING", literal)]))


def parse_idl(text):
    """Return what `parse` does, of the text of an `.idl` file."""
    content = parse_idl_string(text)
    (found,) = [each for each in content.elements if isinstance(each, (Message, Service, Action))]
    if isinstance(found, Service):
        messages = [found.request_message, found.response_message]
    elif isinstance(found, Action):
        messages = [found.goal, found.result, found.feedback]
    else:
        messages = [found]
    return [_idl_part(each) for each in messages]


def _idl_part(message):
    members = [
        each for each in message.structure.members if each.name != EMPTY_STRUCTURE_REQUIRED_MEMBER_NAME
    ]
    return {
        "fields": [(each.name, _type(each.type), _default(each)) for each in members],
        "constants": [
            (each.name, _type(each.type).partition("<=")[0], each.value) for each in message.constants
        ],
    }


def _default(member):
    if not member.has_annotation("default"):
        return None
    value = member.get_annotation_value("default")["value"]
    if isinstance(member.type, AbstractNestedType):
        return list(literal_eval(value))
    return float(value) if _type(member.type).startswith("float") else value


def _type(kind):
    """Return a type as `.msg` files have it."""
    if isinstance(kind, AbstractNestedType):
        bound = ""
        if isinstance(kind, Array):
            bound = str(kind.size)
        elif isinstance(kind, BoundedSequence):
            bound = f"<={kind.maximum_size}"
        return f"{_type(kind.value_type)}[{bound}]"
    if isinstance(kind, AbstractGenericString):
        name = "wstring" if isinstance(kind, AbstractWString) else "string"
        return f"{name}<={kind.maximum_size}" if kind.has_maximum_size() else name
    if isinstance(kind, NamespacedType):
        return "/".join((*kind.namespaces, kind.name)).replace("/msg/", "/")
    return _NAMES.get(kind.typename, kind.typename)


def comments(kind, text):
    """Return the comments of each part and of its elements, each with its unit: (lines, unit)."""
    return [
        [_comment("", part), *(_comment(each.name, each) for each in (*part.fields, *part.constants))]
        for part in _parts(kind, text)
    ]


def _comment(name, element):
    return name, element.annotations.get("comment", []), element.annotations.get("unit")

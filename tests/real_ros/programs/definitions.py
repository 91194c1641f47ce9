"""How ROS 2 reads `.msg`, `.srv` and `.action` text: rosidl_adapter, whose result the generators get."""

from __future__ import annotations

from lark import Token, Tree
from rosidl_adapter.msg import string_to_idl_string_literal
from rosidl_adapter.parser import parse_action_string, parse_message_string, parse_service_string
from rosidl_parser.parser import get_string_literal_value

PACKAGE = "robot_msgs"


def parse(kind, text):
    """Return the fields and constants of each part, with their types and values.

    Args:
        kind: "msg", "srv" or "action".
        text: The content of the file.
    """
    if kind == "msg":
        return [_part(parse_message_string(PACKAGE, "Probe", text))]
    if kind == "srv":
        service = parse_service_string(PACKAGE, "Probe", text)
        return [_part(service.request), _part(service.response)]
    action = parse_action_string(PACKAGE, "Probe", text)
    return [_part(part) for part in (action.goal, action.result, action.feedback)]


def _part(message):
    return {
        "fields": [
            (field.name, str(field.type), _generated(field.default_value)) for field in message.fields
        ],
        "constants": [(each.name, each.type, _generated(each.value)) for each in message.constants],
    }


def _generated(value):
    """Return a value as it arrives in the generated code: strings travel through an `.idl` file."""
    if not isinstance(value, str):
        return value
    literal = string_to_idl_string_literal(value).encode("iso-8859-1").decode()
    if "\n" in literal or "\r" in literal:
        raise ValueError("no line of an .idl file")
    return get_string_literal_value(Tree("string_literal", [Token("ESCAPED_STRING", literal)]))

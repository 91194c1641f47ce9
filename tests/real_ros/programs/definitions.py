"""How ROS 2 reads `.msg`, `.srv` and `.action` text: rosidl_adapter, whose result the generators get."""

from __future__ import annotations

from rosidl_adapter.parser import parse_action_string, parse_message_string, parse_service_string

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
        "fields": [(field.name, str(field.type), field.default_value) for field in message.fields],
        "constants": [(constant.name, constant.type, constant.value) for constant in message.constants],
    }

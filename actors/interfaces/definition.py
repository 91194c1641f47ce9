"""A type's canonical definition and its hash, by ROS 2's rule (REP 2011, RIHS01).

The definition is the JSON text of ROS's TypeDescription without default values and comments: the described
type and, sorted by name, every type it refers to. The hash is "RIHS01_" and the SHA-256 of that text in hex,
so ROS tools and clients in any language compute the same value from the definition alone.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Final

from actors.interfaces.fields import FieldType, fields_of, nested_classes
from actors.interfaces.naming import MessageType, message_name

if TYPE_CHECKING:
    from collections.abc import Mapping

Description = dict[str, Any]
"""One type: {"type_name": …, "fields": [{"name": …, "type": {…}}]}."""

_NESTED: Final = 1
# `char` is uint8: in .msg files it has been an unsigned byte since ROS 1.
TYPE_IDS: Final = {
    "int8": 2, "uint8": 3, "char": 3, "int16": 4, "uint16": 5, "int32": 6, "uint32": 7, "int64": 8,
    "uint64": 9, "float32": 10, "float64": 11, "bool": 15, "byte": 16, "string": 17, "wstring": 18,
}  # fmt: skip
STRING_BOUND_OFFSET: Final = 4
_FIXED, _BOUNDED, _UNBOUNDED = 48, 96, 144
EMPTY_MEMBER: Final = "structure_needs_at_least_one_member"
"""The only field of a message without fields."""

_TIME: Final = "builtin_interfaces/msg/Time"
_DURATION_FIELDS: Final = [("sec", "int32"), ("nanosec", "uint32")]
_EVENT_INFO: Final = "service_msgs/msg/ServiceEventInfo"
_UUID: Final = "unique_identifier_msgs/msg/UUID"


def _field(
    name: str, type_id: int, *, nested: str = "", capacity: int = 0, string_capacity: int = 0
) -> Description:
    return {
        "name": name,
        "type": {
            "type_id": type_id,
            "capacity": capacity,
            "string_capacity": string_capacity,
            "nested_type_name": nested,
        },
    }


def _of_type(name: str, field_type: FieldType) -> Description:
    is_message = "/" in field_type.base
    type_id = _NESTED if is_message else TYPE_IDS[field_type.base]
    if field_type.string_bound:
        type_id += STRING_BOUND_OFFSET
    if field_type.is_array:
        offset = _FIXED if field_type.is_fixed else _UNBOUNDED if field_type.high is None else _BOUNDED
        type_id += offset
    nested = field_type.base if is_message else ""
    return _field(
        name,
        type_id,
        nested=nested,
        capacity=field_type.high or 0,
        string_capacity=field_type.string_bound,
    )


def _type(name: str, fields: list[Description]) -> Description:
    # As in ROS, whose C structures cannot be empty.
    empty = [_field(EMPTY_MEMBER, TYPE_IDS["uint8"])]
    return {"type_name": name, "fields": fields or empty}


def _message(cls: MessageType) -> Description:
    return _type(message_name(cls), [_of_type(field.name, field.type) for field in fields_of(cls)])


def _closure(*classes: MessageType) -> list[Description]:
    """Describe `classes` and all that they contain."""
    every = set[MessageType]().union(*(nested_classes(cls) for cls in classes))
    return [_message(cls) for cls in every]


def _canonical(described: Description, referenced: list[Description]) -> bytes:
    by_name = {each["type_name"]: each for each in referenced}
    # A type that contains itself is described once.
    by_name.pop(described["type_name"], None)
    whole = {
        "type_description": described,
        "referenced_type_descriptions": [by_name[name] for name in sorted(by_name)],
    }
    # With the separators of Python's default and the keys in this order: REP 2011 hashes exactly this text.
    return json.dumps(whole).encode()


def _nested(name: str, type_name: str) -> Description:
    return _field(name, _NESTED, nested=type_name)


def _time() -> Description:
    return _type(_TIME, [_field(name, TYPE_IDS[kind]) for name, kind in _DURATION_FIELDS])


def _event_info() -> Description:
    return _type(
        _EVENT_INFO,
        [
            _field("event_type", TYPE_IDS["uint8"]),
            _nested("stamp", _TIME),
            _field("client_gid", TYPE_IDS["uint8"] + _FIXED, capacity=16),
            _field("sequence_number", TYPE_IDS["int64"]),
        ],
    )


def _service_types(name: str) -> list[Description]:
    """Describe service `name` and the types ROS adds to its request and response."""
    event = _type(
        f"{name}_Event",
        [
            _nested("info", _EVENT_INFO),
            _field("request", _NESTED + _BOUNDED, nested=f"{name}_Request", capacity=1),
            _field("response", _NESTED + _BOUNDED, nested=f"{name}_Response", capacity=1),
        ],
    )
    service = _type(
        name,
        [
            _nested("request_message", f"{name}_Request"),
            _nested("response_message", f"{name}_Response"),
            _nested("event_message", f"{name}_Event"),
        ],
    )
    return [service, event, _event_info(), _time()]


def array_kind(type_id: int) -> tuple[str, int]:
    """Return the brackets of a field's type id, with {} for the capacity, and the id of its element.

    Raises:
        KeyError: The type id is unknown.
    """
    offset = type_id - type_id % _FIXED
    return {0: "", _FIXED: "[{}]", _BOUNDED: "[<={}]", _UNBOUNDED: "[]"}[offset], type_id - offset


def message_definition(cls: MessageType) -> bytes:
    """Return a message type's canonical definition: JSON, UTF-8."""
    return _canonical(_message(cls), _closure(cls))


def definition_of_fields(name: str, types: Mapping[str, Mapping[str, FieldType]]) -> bytes:
    """Return the canonical definition of a message without a class.

    Args:
        name: Its type name.
        types: The fields of this type and of all that it contains, by type name. The classes of their types
            are not used, and other types are left out.

    Raises:
        KeyError: It contains a type without fields here; the key is its name.
    """
    described, pending = dict[str, Description](), [name]
    while pending:
        this = pending.pop()
        if this not in described:
            described[this] = _type(this, [_of_type(*field) for field in types[this].items()])
            pending += [field.base for field in types[this].values() if "/" in field.base]
    return _canonical(described[name], list(described.values()))


def service_definition(name: str, request: MessageType, response: MessageType) -> bytes:
    """Return a service type's canonical definition, with the event type ROS adds to each service."""
    service, *others = _service_types(name)
    return _canonical(service, others + _closure(request, response))


def action_definition(name: str, goal: MessageType, result: MessageType, feedback: MessageType) -> bytes:
    """Return an action type's canonical definition, with the two services and one topic that carry it."""
    send, get = f"{name}_SendGoal", f"{name}_GetResult"
    uuid = _type(_UUID, [_field("uuid", TYPE_IDS["uint8"] + _FIXED, capacity=16)])
    types = [
        uuid,
        _type(f"{send}_Request", [_nested("goal_id", _UUID), _nested("goal", f"{name}_Goal")]),
        _type(f"{send}_Response", [_field("accepted", TYPE_IDS["bool"]), _nested("stamp", _TIME)]),
        _type(f"{get}_Request", [_nested("goal_id", _UUID)]),
        _type(f"{get}_Response", [_field("status", TYPE_IDS["int8"]), _nested("result", f"{name}_Result")]),
        _type(
            f"{name}_FeedbackMessage", [_nested("goal_id", _UUID), _nested("feedback", f"{name}_Feedback")]
        ),
    ]
    action = _type(
        name,
        [
            _nested("goal", f"{name}_Goal"),
            _nested("result", f"{name}_Result"),
            _nested("feedback", f"{name}_Feedback"),
            _nested("send_goal_service", send),
            _nested("get_result_service", get),
            _nested("feedback_message", f"{name}_FeedbackMessage"),
        ],
    )
    types += _service_types(send) + _service_types(get) + _closure(goal, result, feedback)
    return _canonical(action, types)

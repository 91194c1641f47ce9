"""What a form is told of a message."""

from __future__ import annotations

import json
from typing import Any

import msgspec
import pytest

from actors.interfaces.convert import message_from_fields
from actors.interfaces.geometry_msgs.msg import Pose, Quaternion
from actors.interfaces.message import Message
from actors.interfaces.registry import find_interface
from actors.interfaces.runtime_types import runtime_message
from actors.web.forms import MAX_DEFAULTS, FormTooLargeError, form_of
from tests.interfaces.imported import TYPES


def _fields(name: str) -> dict[str, dict[str, Any]]:
    cls: Any = find_interface(name)
    form = form_of(cls)
    return {field["name"]: field for field in form["types"][form["type"]]}


@pytest.mark.parametrize("package", TYPES)
def test_every_standard_message_has_a_form(package: str) -> None:
    """It is JSON, describes each type that it refers to, and its defaults make a message."""
    for name in TYPES[package]:
        found: Any = find_interface(name)
        for cls in [found] if "/msg/" in name else [getattr(found, "Request", None) or found.Goal]:
            form = json.loads(msgspec.json.encode(form_of(cls)))
            for fields in form["types"].values():
                assert {each["message"] for each in fields if each["kind"] == "message"} <= set(form["types"])
            own = form["types"][form["type"]]
            values = {each["name"]: each["default"] for each in own if "default" in each}
            assert message_from_fields(cls, values) == cls()


def test_integers_have_their_range() -> None:
    """A form refuses what the type refuses."""
    fields = _fields("test_msgs/msg/Defaults")
    assert (fields["int8_value"]["minimum"], fields["int8_value"]["maximum"]) == (-128, 127)
    assert fields["uint64_value"]["maximum"] == 2**64 - 1
    assert fields["byte_value"] == {
        "name": "byte_value", "type": "byte", "kind": "integer", "minimum": 0, "maximum": 255, "default": 50
    }  # fmt: skip


def test_sequences_have_their_lengths() -> None:
    """Fixed, bounded and unbounded."""
    assert _fields("test_msgs/msg/Arrays")["int32_values"]["array"] == {"low": 3, "high": 3}
    assert _fields("test_msgs/msg/BoundedSequences")["int32_values"]["array"] == {"low": 0, "high": 3}
    assert _fields("test_msgs/msg/UnboundedSequences")["int32_values"]["array"] == {"low": 0, "high": None}


def test_constants_belong_to_the_field_whose_name_they_begin_with() -> None:
    """Without such a name, all constants of the type may be meant."""
    battery = _fields("sensor_msgs/msg/BatteryState")
    health = [each["name"] for each in battery["power_supply_health"]["choices"]]
    assert all(name.startswith("POWER_SUPPLY_HEALTH_") for name in health)
    level = _fields("diagnostic_msgs/msg/DiagnosticStatus")["level"]
    assert {"name": "WARN", "value": 1} in level["choices"]


class Tree(Message, type_name="forms_test/msg/Tree"):
    """A type that contains itself, a bound, and defaults of its own."""

    name: str
    """How it is called."""
    limit: float = float("inf")
    pose: Pose = Pose(orientation=Quaternion(w=0.5))
    children: list[Tree] = msgspec.field(default_factory=list)


def test_a_type_that_contains_itself_ends() -> None:
    """It is described once; a field without default has none, infinity is a text, a default pose is given."""
    form = form_of(Tree)
    name, limit, pose, children = form["types"]["forms_test/msg/Tree"]
    assert name["required"]
    assert name["comment"] == "How it is called."
    assert "comment" not in limit
    assert "default" not in name
    assert limit["default"] == "inf"
    assert pose["default"]["orientation"]["w"] == 0.5
    assert children["message"] == form["type"]


def test_a_form_has_a_limit() -> None:
    """Case 78: the defaults of a type that a peer has invented, in a sequence or in nested messages."""
    long, short = (
        msg("many/msg/Many", field("x", NESTED_ARRAY, length, "many/msg/One")) for length in (5001, 2000)
    )
    one = msg("many/msg/One", field("y", INT32), field("z", INT32))
    numbers = msg("many/msg/Numbers", field("x", INT32_ARRAY, MAX_DEFAULTS + 1))
    for top, *others in ((numbers,), (long, one)):
        with pytest.raises(FormTooLargeError, match="too many for a form"):
            form_of(runtime_message(described(top, *others)))
    form = form_of(runtime_message(described(short, one)))
    (found,) = form["types"]["many/msg/Many"]
    assert found["default"] == [{"y": 0, "z": 0}] * 2000


INT32, INT32_ARRAY, NESTED_ARRAY = 6, 6 + 48, 1 + 48
"""Of type_description_interfaces/msg/FieldType: fixed arrays are 48 above their element."""


def field(name: str, kind: int, length: int = 0, nested: str = "") -> dict[str, Any]:
    """Return a field of a definition."""
    types = {"type_id": kind, "capacity": length, "string_capacity": 0, "nested_type_name": nested}
    return {"name": name, "type": types}


def msg(name: str, *fields: dict[str, Any]) -> dict[str, Any]:
    """Return a type of a definition."""
    return {"type_name": name, "fields": fields}


def described(top: dict[str, Any], *others: dict[str, Any]) -> bytes:
    """Return a definition."""
    return json.dumps({"type_description": top, "referenced_type_descriptions": others}).encode()

"""Classes of types that are not installed, from their definitions."""

from __future__ import annotations

import json
from operator import itemgetter
from typing import Any

import pytest

from actors.interfaces.action import action_types
from actors.interfaces.codec import codec_for
from actors.interfaces.convert import message_to_ordereddict
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.message import Action, Message, Service, definition, type_hash, type_name
from actors.interfaces.registry import find_interface
from actors.interfaces.runtime_types import (
    runtime_action,
    runtime_message,
    runtime_service,
    service_of_event,
)
from actors.interfaces.service_event import service_event
from actors.interfaces.std_msgs.msg import Bool, Header
from actors.interfaces.std_srvs.srv import SetBool
from proto.wire.type_hash import hash_of
from tests.interfaces.imported import TYPES


def _foreign(described: bytes, package: str) -> bytes:
    """Return the definition of a type as if its package were not installed."""
    whole: Any = json.loads(described.replace(f'"{package}/'.encode(), f'"foreign_{package}/'.encode()))
    whole["referenced_type_descriptions"].sort(key=itemgetter("type_name"))
    return json.dumps(whole).encode()


@pytest.mark.parametrize("package", TYPES)
def test_every_standard_type_can_be_made(package: str) -> None:
    """As others have declared it, so that both match; and a new message of it can be sent."""
    for name in TYPES[package]:
        installed: Any = find_interface(name)
        made: Any
        if issubclass(installed, Action):
            derived = action_types(installed)
            parts = (derived.send_goal, derived.get_result, derived.feedback_message)
            made = runtime_action(*(_foreign(definition(part), package) for part in parts))
            messages = [(getattr(installed, part), getattr(made, part)) for part in ("Goal", "Feedback")]
        elif issubclass(installed, Service):
            described = _foreign(definition(installed), package)
            made = runtime_service(described)
            assert type_hash(made) == hash_of(described)
            messages = [(getattr(installed, part), getattr(made, part)) for part in ("Request", "Response")]
        else:
            described = _foreign(definition(installed), package)
            made = runtime_message(described)
            assert type_hash(made) == hash_of(described)
            messages = [(installed, made)]
        assert type_name(made) == f"foreign_{name}"
        for original, copy in messages:
            assert codec_for(copy).decode(codec_for(copy).encode(copy())) == copy()
            if name != "test_msgs/msg/Defaults":
                assert message_to_ordereddict(copy()).keys() == message_to_ordereddict(original()).keys()


def test_installed_parts_keep_their_classes() -> None:
    """Also in a message that is not installed itself; those that differ here are made."""

    class Outer(Message, type_name="runtime_test/msg/Outer"):
        header: Header = Header()

    made = runtime_message(definition(Outer).replace(b"Outer", b"Other"))
    assert type(getattr(made(), "header")) is Header  # noqa: B009 - not known to type checkers
    changed = definition(Outer).replace(b"Outer", b"Third").replace(b'"frame_id"', b'"frame"')
    assert type(getattr(runtime_message(changed)(), "header")) is not Header  # noqa: B009


def _definition(*messages: tuple[str, list[dict[str, Any]]]) -> bytes:
    described = [{"type_name": name, "fields": fields} for name, fields in messages]
    whole = {"type_description": described[0], "referenced_type_descriptions": described[1:]}
    return json.dumps(whole).encode()


def _field(name: str, number: int, nested: str = "", capacity: int = 0) -> dict[str, Any]:
    kind = {"type_id": number, "capacity": capacity, "string_capacity": 0, "nested_type_name": nested}
    return {"name": name, "type": kind}


@pytest.mark.parametrize(
    ("described", "text"),
    [
        (b"nonsense", "cannot be read"),
        (_definition(("evil/msg/A", [_field("a", 1, "evil/msg/A")])), "contains itself"),
        (_definition(("evil/msg/A", [_field("a", 1, "evil/msg/B")])), "does not describe"),
        (_definition(("evil/msg/A", [_field("__class__", 6)])), "no class can have"),
        (_definition(("evil/msg/A", [_field("lambda", 6)])), "no class can have"),
        (_definition(("evil/msg/A", [_field("a", 6 + 48, capacity=2**40)])), "more than"),
        (
            _definition(
                ("evil/msg/A", [_field("a", 1 + 48, "evil/msg/B", 2**12)]),
                ("evil/msg/B", [_field("b", 6 + 48, capacity=2**12)]),
            ),
            "more than",
        ),
        (
            _definition(
                ("evil/msg/A", [_field("a", 1 + 48, "evil/msg/B", 2**12)]),
                ("evil/msg/B", [_field("b", 1 + 48, "evil/msg/C", 2**12)]),
                ("evil/msg/C", []),
            ),
            "more than",
        ),
        (
            _definition(*((f"evil/msg/A{n}", [_field("a", 1, f"evil/msg/A{n + 1}")]) for n in range(5000))),
            "levels deep",
        ),
        (_definition(("evil", [_field("a", 6)])), "does not describe"),
    ],
)
def test_hostile_definitions_are_refused(described: bytes, text: str) -> None:
    """With the reason; nothing is made that is too large, or that hides what each class has."""
    with pytest.raises(InvalidMessageError, match=text):
        runtime_message(described)


def test_the_service_of_its_events() -> None:
    """The installed class if it is the same, else one with the parts that the events have."""
    event: Any = service_event(SetBool)
    assert service_of_event(event) is SetBool
    made: Any = service_of_event(runtime_message(_foreign(definition(event), "std_srvs")))
    assert (made.__name__, made.Request(data=True).data) == ("SetBool", True)
    for cls in (SetBool.Request, Bool):
        with pytest.raises(InvalidMessageError, match="no message about the calls of a service"):
            service_of_event(cls)


def test_large_arrays_of_numbers_can_be_made() -> None:
    """They are packed, so a new message may have as many bytes as can be sent."""
    fields = [_field("a", 3 + 48, capacity=2**21), _field("b", 11 + 48, capacity=2**21)]
    made: Any = runtime_message(_definition(("images/msg/Big", fields)))()
    assert (len(made.a), len(made.b), made.b[-1]) == (2**21, 2**21, 0.0)


def test_a_definition_of_something_else_is_refused() -> None:
    """A message is no service, and a service is no action."""
    message = definition(find_interface("std_msgs/msg/String"))
    with pytest.raises(InvalidMessageError):
        runtime_service(message)
    with pytest.raises(InvalidMessageError):
        runtime_action(message, message, message)

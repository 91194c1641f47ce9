"""Event classes: consistent with the service's definition, for every kind of service class."""

from __future__ import annotations

import copy
import json
import pickle
from typing import Any

import pytest

import actors
from actors.interfaces.codec import codec_for
from actors.interfaces.errors import InvalidMessageError, UnknownInterfaceError
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.message import definition, is_message_type, type_name
from actors.interfaces.registry import find_interface
from actors.interfaces.service_event import service_event
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import Trigger


class Weigh(actors.Service):
    class Request(actors.Message):
        label: String = String()

    class Response(actors.Message):
        grams: list[float] = []  # noqa: RUF012 - msgspec copies it


def descriptions(cls: object) -> dict[str, Any]:
    """Return the descriptions of a type and of all that it refers to, by name."""
    whole = json.loads(definition(cls))
    every = [whole["type_description"], *whole["referenced_type_descriptions"]]
    return {each["type_name"]: each for each in every}


@pytest.mark.parametrize("srv_type", [AddTwoInts, Trigger, Weigh])
def test_the_class_is_what_the_services_definition_says(srv_type: Any) -> None:
    """Generated or written by hand: the event's own definition is the part of the service's about it."""
    name = type_name(srv_type)
    of_service, of_event = descriptions(srv_type), descriptions(srv_type.Event)
    assert type_name(srv_type.Event) == f"{name}_Event"
    assert of_event == {key: value for key, value in of_service.items() if key != name}


def test_the_class_is_made_once() -> None:
    """However it is asked for; it is a message class like others."""
    assert AddTwoInts.Event is AddTwoInts.Event is service_event(AddTwoInts)
    assert type_name(Trigger.Event) == "std_srvs/srv/Trigger_Event"
    assert is_message_type(AddTwoInts.Event)
    assert AddTwoInts().Event is AddTwoInts.Event


def test_an_event_travels_and_can_be_copied() -> None:
    """Encoded, decoded, copied and pickled it is equal; its lists hold at most one."""
    event = AddTwoInts.Event(request=[AddTwoInts.Request(a=1)])
    event.info.client_gid = b"g" * 16
    codec = codec_for(AddTwoInts.Event)
    decoded = codec.decode(codec.encode(event))
    assert decoded.request == event.request
    assert bytes(decoded.info.client_gid) == event.info.client_gid
    assert copy.deepcopy(event) == pickle.loads(pickle.dumps(event)) == event
    event.request.append(AddTwoInts.Request())
    with pytest.raises(InvalidMessageError, match="request"):
        codec.encode(event)


def test_events_are_found_by_name() -> None:
    """As tools see it in the graph; only services have events."""
    assert find_interface("example_interfaces/srv/AddTwoInts_Event") is AddTwoInts.Event
    for name in ("std_msgs/msg/String_Event", "nothing/srv/Nothing_Event", "_Event"):
        with pytest.raises(UnknownInterfaceError):
            find_interface(name)


@pytest.mark.parametrize("other", [String, Fibonacci, actors.Service, "text"])
def test_other_classes_have_no_events(other: Any) -> None:
    """Only a service class has one."""
    with pytest.raises(TypeError, match="service class"):
        service_event(other)

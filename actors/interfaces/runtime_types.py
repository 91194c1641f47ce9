"""Makes the class of a type that is not installed, from the definition that its users have declared.

    definition = await node.get_type_definition(type_hash)
    Calibrate = runtime_service(definition)
    client = node.create_client(Calibrate, "calibrate")

A definition has neither constants nor defaults: all fields begin at zero or empty. Types that it contains and
that are installed here keep their classes.
"""

from __future__ import annotations

import keyword
from types import GenericAlias
from typing import Annotated, Any, Final, TypeVar, cast

import msgspec

from actors.interfaces import types
from actors.interfaces.action import action_types
from actors.interfaces.arrays import ARRAY_BY_ELEMENT
from actors.interfaces.described import described_types
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.fields import BINARY, FieldType, nested_classes
from actors.interfaces.message import (
    Action,
    Message,
    Service,
    definition,
    message_class,
    type_hash,
    type_name,
)
from actors.interfaces.registry import installed_interface
from actors.interfaces.service_event import service_event
from actors.interfaces.source import sequence_name
from actors.interfaces.specs import PARTS
from proto.wire.type_hash import hash_of

MAX_ELEMENTS: Final = 1 << 20
"""Fields and elements that a new message has, at all levels: a definition may come from anywhere."""

_OBJECT_BYTES: Final = 64
"""Memory of an element that is an object, about."""

T = TypeVar("T", bound=type[Any])

MAX_DEPTH: Final = 64
"""Levels of nesting; real types have about ten."""

_ZERO: Final[dict[str, Any]] = {
    "bool": False, "float32": 0.0, "float64": 0.0, "string": "", "wstring": "", "byte": b"\0"
}  # fmt: skip


def runtime_message(described: bytes) -> type[Message]:
    """Return the class of a message.

    Args:
        described: As returned by `Node.get_type_definition`.

    Raises:
        InvalidMessageError: It is no definition, or of a type that contains itself or has too many elements.
    """
    made = _Maker(described)
    return _checked(made.message(made.name), described)


def runtime_service(described: bytes) -> type[Service]:
    """Return the class of a service.

    Args:
        described: The service's definition.

    Raises:
        InvalidMessageError: As for `runtime_message`, or it is of no service.
    """
    made = _Maker(described)
    parts = {part: made.message(f"{made.name}_{part}") for part in ("Request", "Response")}
    return cast("type[Service]", _checked(_namespace(Service, made.name, parts), described))


def service_of_event(event: type[Message]) -> type[Service]:
    """Return the class of the service whose calls a message class describes.

    Args:
        event: The message of service introspection, such as `std_srvs/srv/SetBool_Event`.

    Returns:
        The installed class if it is the same, or one that is made.

    Raises:
        InvalidMessageError: Such messages describe no calls of a service.
    """
    name = type_name(event).removesuffix("_Event")
    installed = installed_interface(name)
    candidates = [] if installed is None or not issubclass(installed, Service) else [installed]
    nested = {type_name(each): each for each in nested_classes(cast("Any", event))}
    parts = {part: nested.get(f"{name}_{part}") for part in PARTS["srv"]}
    if None not in parts.values():
        candidates.append(_namespace(Service, name, cast("dict[str, type[Message]]", parts)))
    for each in candidates:
        if type_hash(service_event(cast("Any", each))) == type_hash(event):
            return each
    raise InvalidMessageError(f"{type_name(event)} is no message about the calls of a service")


def runtime_action(send_goal: bytes, get_result: bytes, feedback_message: bytes) -> type[Action]:
    """Return the class of an action, whose server declares three types.

    Args:
        send_goal: The definition of the service that accepts goals.
        get_result: That of the service for results.
        feedback_message: That of the message with feedback.

    Raises:
        InvalidMessageError: As for `runtime_message`, or they are of no action.
    """
    goals = _Maker(send_goal)
    name = goals.name.removesuffix("_SendGoal")
    parts = {
        "Goal": goals.message(f"{name}_Goal"),
        "Result": _Maker(get_result).message(f"{name}_Result"),
        "Feedback": _Maker(feedback_message).message(f"{name}_Feedback"),
    }
    made = _namespace(Action, name, parts)
    # An action is never declared as such, only what it is made of. If all three match, so does it.
    derived = action_types(made)
    _checked(derived.send_goal, send_goal)
    _checked(derived.get_result, get_result)
    _checked(derived.feedback_message, feedback_message)
    return cast("type[Action]", made)


def _namespace(base: Any, name: str, parts: dict[str, type[Message]]) -> Any:
    """Return a service or action class."""
    return type(base)(name.rpartition("/")[2], (base,), dict(parts), type_name=name)


def _checked(made: T, described: bytes) -> T:
    """Return a class.

    Raises:
        InvalidMessageError: It would not match the endpoints that have declared the definition.
    """
    # The proof that nothing was lost on the way from the definition to the class.
    if type_hash(made) != hash_of(described):
        raise InvalidMessageError(f"The definition of {type_name(made)} has parts that cannot be made again")
    return made


class _Maker:
    """Makes the classes of one definition, each after those that it contains."""

    def __init__(self, described: bytes) -> None:
        self._described = described_types(described)
        self.name = next(iter(self._described))
        self._made: dict[str, type[Message]] = {}
        self._elements: dict[str, int] = {}
        self._open: list[str] = []
        """The types that contain the one that is being made, outermost first."""

    def message(self, name: str) -> type[Message]:
        if name in self._made:
            return self._made[name]
        if name in self._open:
            raise InvalidMessageError(f"{name} contains itself; its class must be installed")
        if len(self._open) >= MAX_DEPTH:
            raise InvalidMessageError(f"{self.name} is nested more than {MAX_DEPTH} levels deep")
        fields = self._described.get(name)
        if fields is None or name.count("/") != 2:
            raise InvalidMessageError(f"The definition does not describe the type {name!r}")
        self._open.append(name)
        annotated = {field: self._field(name, field, kind) for field, kind in fields.items()}
        # Counted while the classes are made, before any message exists: ten nested arrays of a thousand
        # elements each are a short text, and no memory holds one message of them.
        self._elements[name] = 1 + sum(map(self._size, fields.values()))
        if self._elements[name] > MAX_ELEMENTS:
            raise InvalidMessageError(f"{name} has more than {MAX_ELEMENTS} elements; it must be installed")
        self._open.pop()
        # An installed class is preferred: its messages are then instances of the class that the program
        # knows.
        self._made[name] = self._installed(name) or message_class(Message, name, annotated)
        return self._made[name]

    def _installed(self, name: str) -> type[Message] | None:
        """Return the installed class of a type that is the same here as in the definition."""
        found = installed_interface(name)
        if found is None or not issubclass(found, Message):
            return None
        # By fields at all levels, since the same name may have another definition in another installation.
        own = described_types(definition(found))
        same = bool(own) and all(self._described.get(each) == fields for each, fields in own.items())
        return found if same else None

    def _size(self, kind: FieldType) -> int:
        """Return how many elements a new field has, at any depth."""
        if kind.is_array and (kind.base in BINARY or kind.base in ARRAY_BY_ELEMENT):
            # Packed, and so far smaller than that many objects.
            item_size = 1 if kind.base in BINARY else ARRAY_BY_ELEMENT[kind.base].item_size
            return 1 + kind.low * item_size // _OBJECT_BYTES
        return (kind.low if kind.is_array else 1) * self._elements.get(kind.base, 1)

    def _field(self, owner: str, name: str, kind: FieldType) -> tuple[Any, Any]:
        """Return the annotation and the default of a field."""
        # Or a field would replace a method of the class: the definition comes from another process.
        if keyword.iskeyword(name) or name.startswith("_") or hasattr(Message, name):
            raise InvalidMessageError(f"{owner} has a field named {name!r}, which no class can have")
        nested = self.message(kind.base) if "/" in kind.base else None
        base: Any = nested or getattr(types, "boolean" if kind.base == "bool" else kind.base)
        if kind.string_bound:
            base = Annotated[base, types.AtMost(kind.string_bound)]
        if not kind.is_array:
            return base, nested or _ZERO.get(kind.base, 0)
        if kind.base in ARRAY_BY_ELEMENT or kind.base in BINARY:
            base = getattr(types, f"{sequence_name(kind.base)}Sequence")
        else:
            base = GenericAlias(list, (base,))
        if kind.high is not None:
            base = Annotated[base, types.Length(kind.high) if kind.is_fixed else types.AtMost(kind.high)]
        return base, msgspec.field(default_factory=_elements(kind, nested))


def _elements(kind: FieldType, nested: type[Message] | None) -> Any:
    """Return a function that makes the value of a new sequence."""
    count, array = kind.low, ARRAY_BY_ELEMENT.get(kind.base)
    if kind.base in BINARY:
        return lambda: bytes(count)
    if array is not None:
        return lambda: array.from_packed(bytes(count * array.item_size))
    if not count:
        return list
    if nested is not None:
        return lambda: [nested() for _ in range(count)]
    return lambda: [_ZERO[kind.base]] * count

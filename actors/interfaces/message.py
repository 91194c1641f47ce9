"""Message, Service and Action: the bases of all interface types.

    class Reading(actors.Message):                      # "<top module>/msg/Reading"
        sensor: str = ""
        value: float = 0.0

    class Calibrate(actors.Service):                    # "<top module>/srv/Calibrate"
        class Request(actors.Message):
            sensor: str = ""

        class Response(actors.Message):
            ok: bool = False

The type name of a class in a script begins with the script's name: the same class in `pub.py` and in `sub.py`
is two types, which do not match. Put it in a module that both import, or give both classes the same type
name: `class Reading(actors.Message, type_name="lab/msg/Reading")`.

Fields are checked when a message is sent and when it is received, not when they are assigned, unless
`checking.check_assignments` is called.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any, Final, Protocol, TypeVar, cast

import msgspec

from actors.interfaces.definition import action_definition, message_definition, service_definition
from actors.interfaces.docstrings import Documentation
from actors.interfaces.fields import check_annotations, fields_of
from actors.interfaces.naming import TYPE_NAME, MessageType, message_name, package_of
from actors.interfaces.values import has_sequences, same, sequences_of, value_repr
from proto.wire.type_hash import hash_of

if TYPE_CHECKING:
    from actors.interfaces.action import ActionImpl
    from actors.interfaces.service_event import ServiceEvent
    from actors.interfaces.slot_types import AbstractType


_GENERATED: Final = "actors.interfaces."


def _plain(value: Any) -> Any:
    return bytes(cast("bytes", value)) if isinstance(value, memoryview) else value


def _rebuilt(cls: type[Message], values: dict[str, Any]) -> Message:
    return cls(**values)


def rebuilt_by_name(module: str, name: str, values: dict[str, Any]) -> Message:
    """Return a pickled message of a program written for ROS 2, where classes have other names.

    Args:
        module: The module that has the class here.
        name: Its name there, with that of its service or action.
        values: The fields.
    """
    from importlib import import_module  # noqa: PLC0415 - seldom needed

    found: Any = import_module(module)
    for each in name.split("."):
        found = getattr(found, each)
    return _rebuilt(found, values)


class _SlotTypes:
    """Gives a message class's `SLOT_TYPES` on first use."""

    def __get__(self, instance: object, owner: Any) -> tuple[AbstractType, ...]:
        from actors.interfaces.slot_types import slot_types  # noqa: PLC0415 - seldom needed

        return slot_types(owner)


class _FieldTypes:
    """Gives a message class's `_fields_and_field_types`, which some programs for ROS 2 read."""

    def __get__(self, instance: object, owner: Any) -> dict[str, str]:
        return cast("dict[str, str]", owner.get_fields_and_field_types())


class Message(msgspec.Struct, metaclass=MessageType):
    """Base of all message types, generated or written by hand.

    The class keyword `type_name` sets the ROS type name; by default it is derived from the class's top
    module, or the script's file name. Field types are those of `actors.interfaces.types`; another one raises
    TypeError where the class is defined.

    Attributes:
        SLOT_TYPES: The types of the fields in order, as objects of `actors.interfaces.slot_types`.
    """

    SLOT_TYPES = _SlotTypes()
    _fields_and_field_types = _FieldTypes()

    def __init_subclass__(cls) -> None:
        # Those of `actors.interfaces` are generated and tested, and importing them has to be quick.
        if not cls.__module__.startswith(_GENERATED):
            check_annotations(cls)

    @classmethod
    def get_fields_and_field_types(cls) -> dict[str, str]:
        """Return the names of the fields in order, and their types in IDL, such as "sequence<double>".

        Raises:
            TypeError: A field has no ROS type.
        """
        return {field.name: field.type.idl for field in fields_of(cls)}

    def __repr__(self) -> str:
        name = message_name(type(self)).replace("/", ".")
        types = sequences_of(type(self))
        fields = (
            f"{field}={value_repr(types.get(field), getattr(self, field))}"
            for field in self.__struct_fields__
        )
        return f"{name}({', '.join(fields)})"

    def __eq__(self, other: object) -> bool:
        cls = type(self)
        # Without sequences msgspec's own comparison is right, and many times faster.
        if type(other) is not cls or not has_sequences(cls) or not cls.__struct_config__.eq:
            return super().__eq__(other)
        types = sequences_of(cls)
        for name in self.__struct_fields__:
            left, right = getattr(self, name), getattr(other, name)
            if not (same(types[name], left, right) if name in types else left == right):
                return False
        return True

    # Defining `__eq__` would otherwise remove it.
    __hash__ = msgspec.Struct.__hash__

    def __reduce__(self) -> tuple[Any, ...]:
        # A memoryview can be neither copied nor pickled.
        plain = {name: _plain(getattr(self, name)) for name in self.__struct_fields__}
        return _rebuilt, (type(self), plain)


def _adopt(owner: type, parts: tuple[str, ...], kind: str, type_name: str | None) -> None:
    """Set the type names of a service or action and of its parts.

    Raises:
        TypeError: A part is missing or is not a message class.
    """
    name = type_name or f"{package_of(owner.__module__)}/{kind}/{owner.__name__}"
    setattr(owner, TYPE_NAME, name)
    owner.__doc__ = cast("str", Documentation(owner.__dict__.get("__doc__")))
    for part in parts:
        message = getattr(owner, part, None)
        if not isinstance(message, MessageType):
            raise TypeError(
                f"Class {owner.__qualname__} needs a nested message class: class {part}(Message): ..."
            )
        # A message that is defined elsewhere and only used as a part keeps its own name.
        if message.__qualname__ == f"{owner.__qualname__}.{part}" and message.__dict__[TYPE_NAME] is None:
            setattr(message, TYPE_NAME, f"{name}_{part}")


RequestT = TypeVar("RequestT", bound=Message)
ResponseT = TypeVar("ResponseT", bound=Message)


class _EventClass:
    """Makes a service's event class on first use."""

    def __get__(
        self, instance: object, owner: type[ServiceType[RequestT, ResponseT]]
    ) -> type[ServiceEvent[RequestT, ResponseT]]:
        from actors.interfaces.service_event import service_event  # noqa: PLC0415 - circular, and seldom needed

        return service_event(owner)


class Service:
    """Base of service types: a namespace with the message classes `Request` and `Response`.

    Attributes:
        Event: The message class of service introspection; made on first use.
    """

    # On first use: most programs never look at service events, and each class costs time to make.
    Event = _EventClass()

    def __init_subclass__(cls, *, type_name: str | None = None) -> None:
        _adopt(cls, ("Request", "Response"), "srv", type_name)


class _ActionImpl:
    """Gives an action's `Impl` on first use."""

    def __get__(self, instance: object, owner: Any) -> ActionImpl:
        # `help` asks the bases of a class, too.
        if owner is Action:
            return cast("ActionImpl", self)
        from actors.interfaces.action import action_impl  # noqa: PLC0415 - circular, and seldom needed

        return action_impl(owner)


class Action:
    """Base of action types: a namespace with the message classes `Goal`, `Result` and `Feedback`.

    Attributes:
        Impl: The services and messages that carry it, with ROS's names; made on first use.
    """

    Impl = _ActionImpl()

    def __init_subclass__(cls, *, type_name: str | None = None) -> None:
        _adopt(cls, ("Goal", "Result", "Feedback"), "action", type_name)


RequestT_co = TypeVar("RequestT_co", bound=Message, covariant=True)
ResponseT_co = TypeVar("ResponseT_co", bound=Message, covariant=True)
GoalT_co = TypeVar("GoalT_co", bound=Message, covariant=True)
ResultT_co = TypeVar("ResultT_co", bound=Message, covariant=True)
FeedbackT_co = TypeVar("FeedbackT_co", bound=Message, covariant=True)


class ServiceType(Protocol[RequestT_co, ResponseT_co]):
    """Type of a service class for type checkers.

    `def create_client(srv_type: type[ServiceType[RequestT, ResponseT]])` infers both message types from
    `AddTwoInts`, in pyright and in mypy.
    """

    @property
    def Request(self) -> type[RequestT_co]:  # noqa: N802 - rclpy's name
        """The request's class."""
        ...

    @property
    def Response(self) -> type[ResponseT_co]:  # noqa: N802 - rclpy's name
        """The response's class."""
        ...


class ActionType(Protocol[GoalT_co, ResultT_co, FeedbackT_co]):
    """Type of an action class for type checkers; see `ServiceType`."""

    @property
    def Goal(self) -> type[GoalT_co]:  # noqa: N802 - rclpy's name
        """The goal's class."""
        ...

    @property
    def Result(self) -> type[ResultT_co]:  # noqa: N802 - rclpy's name
        """The result's class."""
        ...

    @property
    def Feedback(self) -> type[FeedbackT_co]:  # noqa: N802 - rclpy's name
        """The feedback's class."""
        ...


def message_class(owner: type, name: str, fields: dict[str, tuple[Any, Any]]) -> type[Message]:
    """Return a new message class that ROS derives from another type.

    Args:
        owner: The class that it is derived from, whose module it gets.
        name: The new type's name, such as "example_interfaces/action/Fibonacci_FeedbackMessage".
        fields: Field name to type and default: a value, or a class whose new instance is the default.
    """
    namespace: dict[str, Any] = {
        "__module__": owner.__module__,
        "__annotations__": {field: kind for field, (kind, _) in fields.items()},
    }
    for field, (_, default) in fields.items():
        namespace[field] = msgspec.field(default_factory=default) if isinstance(default, type) else default
    made = MessageType(name.rpartition("/")[2], (Message,), namespace, type_name=name)
    return cast("type[Message]", made)


def is_message_type(cls: object) -> bool:
    """Return whether `cls` is a message class other than `Message` itself."""
    return isinstance(cls, MessageType) and cls is not Message


def _check_type(cls: object) -> None:
    if is_message_type(cls):
        return
    if isinstance(cls, type) and issubclass(cls, Service | Action) and cls not in {Service, Action}:
        return
    shown = f"{cls.__module__}.{cls.__qualname__}" if isinstance(cls, type) else repr(cls)
    hint = "the class, not an instance of it" if isinstance(cls, Message) else "such as std_msgs.msg.String"
    raise TypeError(f"Expected a message, service or action class, {hint}; got {shown}")


def type_name(cls: object) -> str:
    """Return the ROS type name of a message, service or action class: "std_msgs/msg/String".

    Raises:
        TypeError: `cls` is not such a class.
    """
    return _name(_hashable(cls))


def _hashable(cls: object) -> Any:
    """Return a class; raise TypeError for anything else, which may have no hash."""
    # The cached functions below need a hash, and an unhashable argument should give the same error as
    # others.
    if not isinstance(cls, type):
        _check_type(cls)
    return cls


@cache
def _name(cls: Any) -> str:
    _check_type(cls)
    return message_name(cls) if isinstance(cls, MessageType) else str(getattr(cls, TYPE_NAME))


@cache
def _definition(cls: Any) -> bytes:
    _check_type(cls)
    if isinstance(cls, MessageType):
        return message_definition(cls)
    name = type_name(cls)
    if issubclass(cls, Service):
        return service_definition(name, cast("Any", cls).Request, cast("Any", cls).Response)
    return action_definition(name, cls.Goal, cls.Result, cls.Feedback)


@cache
def _hash(cls: Any) -> str:
    return hash_of(_definition(cls))


def definition(cls: object) -> bytes:
    """Return the canonical definition of a message, service or action class: JSON, UTF-8.

    Raises:
        TypeError: `cls` is not such a class, or one of its fields has no ROS type.
    """
    return _definition(_hashable(cls))


def type_hash(cls: object) -> str:
    """Return the RIHS01 hash of a message, service or action class: "RIHS01_…", 71 characters.

    Raises:
        TypeError: `cls` is not such a class, or one of its fields has no ROS type.
    """
    return _hash(_hashable(cls))


@cache
def declared_type(cls: Any) -> tuple[str, str]:
    """Return the type name and the hash of a class that has them: a declaration needs both."""
    return type_name(cls), type_hash(cls)

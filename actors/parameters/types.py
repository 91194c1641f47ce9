"""Types, values and descriptors of parameters."""

from __future__ import annotations

import array
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from dataclasses import fields as dataclass_fields
from enum import IntEnum
from typing import TYPE_CHECKING, Any, Final, cast

if TYPE_CHECKING:
    from actors.interfaces.rcl_interfaces import msg as rcl_interfaces

ParameterValue = (
    bool
    | int
    | float
    | str
    | Sequence[bytes]
    | Sequence[bool]
    | Sequence[int]
    | Sequence[float]
    | Sequence[str]
    | None
)
"""A Python value that a parameter can hold; None is a parameter without a value."""

# A range, for `in`: checking an int against it needs no comparison of two bounds, and works for huge ints.
_INT64: Final = range(-(1 << 63), 1 << 63)


class ParameterType(IntEnum):
    """The type of a parameter's value, with ROS 2's codes."""

    NOT_SET = 0
    BOOL = 1
    INTEGER = 2
    DOUBLE = 3
    STRING = 4
    BYTE_ARRAY = 5
    BOOL_ARRAY = 6
    INTEGER_ARRAY = 7
    DOUBLE_ARRAY = 8
    STRING_ARRAY = 9

    @classmethod
    def from_parameter_value(cls, value: object) -> ParameterType:
        """Return the type of a Python value; an empty list is a byte array, as in rclpy.

        Args:
            value: Any object.

        Raises:
            TypeError: No parameter can hold it; ints have 64 bits.
        """
        if value is None:
            return cls.NOT_SET
        scalar = _scalar_type(value)
        if scalar is not None:
            return scalar
        if isinstance(value, bytes | bytearray):
            return cls.BYTE_ARRAY
        if isinstance(value, list | tuple | array.array):
            items = cast("Sequence[object]", value)
            # An empty list fits all of them. Byte arrays come first in the table, and rclpy makes it one of
            # those.
            for kind in _ARRAYS:
                if kind.check(items):
                    return kind
        raise TypeError(f"The given value is not one of the allowed types: {value!r}")

    def check(self, value: object) -> bool:
        """Return whether a parameter of this type can hold a value.

        Args:
            value: Any object.
        """
        if self is ParameterType.NOT_SET:
            return value is None
        if self not in _ARRAYS:
            return _scalar_type(value) is self
        if isinstance(value, bytes | bytearray):
            return self is ParameterType.BYTE_ARRAY
        if not isinstance(value, list | tuple | array.array):
            return False
        items = cast("Sequence[object]", value)
        item_type = _ARRAYS[self]
        if item_type is None:
            return all(isinstance(item, bytes) and len(item) == 1 for item in items)
        return all(_scalar_type(item) is item_type for item in items)


_ARRAYS: Final[dict[ParameterType, ParameterType | None]] = {
    ParameterType.BYTE_ARRAY: None,
    ParameterType.BOOL_ARRAY: ParameterType.BOOL,
    ParameterType.INTEGER_ARRAY: ParameterType.INTEGER,
    ParameterType.DOUBLE_ARRAY: ParameterType.DOUBLE,
    ParameterType.STRING_ARRAY: ParameterType.STRING,
}


def _scalar_type(value: object) -> ParameterType | None:
    # First, since a bool is an int in Python.
    if isinstance(value, bool):
        return ParameterType.BOOL
    if isinstance(value, int):
        # A larger int has no place in ROS 2's message; it must fail here, and not when another node asks
        # for it.
        return ParameterType.INTEGER if value in _INT64 else None
    if isinstance(value, float):
        return ParameterType.DOUBLE
    return ParameterType.STRING if isinstance(value, str) else None


class Parameter:
    """A name with a typed value. Immutable.

    Args:
        name: Its name, levels separated by dots.
        type_: Its type; None: that of the value.
        value: The value; None for a parameter without one.

    Raises:
        TypeError: No parameter can hold the value, or `type_` is no type.
        ValueError: Type and value do not agree.
    """

    Type = ParameterType

    __slots__ = ("_name", "_type", "_value")

    def __init__(self, name: str, type_: ParameterType | None = None, value: ParameterValue = None) -> None:
        if type_ is None:
            type_ = ParameterType.from_parameter_value(value)
        if not isinstance(cast("object", type_), ParameterType):
            raise TypeError(
                f"{type_!r} is not a type: use one of Parameter.Type, such as Parameter.Type.INTEGER"
            )
        if not type_.check(value):
            raise ValueError(f"Type {type_.name} and value {value!r} do not agree")
        self._name = name
        self._type = type_
        self._value = value

    @property
    def name(self) -> str:
        """Its name."""
        return self._name

    @property
    def type_(self) -> ParameterType:
        """The type of its value."""
        return self._type

    @property
    def value(self) -> ParameterValue:
        """Its value; None if it has none."""
        return self._value

    def get_parameter_value(self) -> rcl_interfaces.ParameterValue:
        """Return the value as ROS 2's message: its `type`, and the value in the field of that type."""
        from actors.interfaces.rcl_interfaces.msg import ParameterValue as Value  # noqa: PLC0415 - seldom needed

        value: object = self._value
        if isinstance(value, bytes | bytearray):
            value = bytes(value)
        elif self._type is ParameterType.BYTE_ARRAY:
            # `byte[]` travels as bytes, while rclpy's parameters hold a list of single bytes.
            value = b"".join(cast("Sequence[bytes]", value))
        elif self._type in _ARRAYS:
            value = [*cast("Sequence[object]", value)]
        made = Value(type=int(self._type))
        if value is not None:
            setattr(made, f"{self._type.name.lower()}_value", value)
        return made

    def to_parameter_msg(self) -> rcl_interfaces.Parameter:
        """Return the parameter as ROS 2's message."""
        from actors.interfaces.rcl_interfaces.msg import Parameter as Message  # noqa: PLC0415 - seldom needed

        return Message(name=self._name, value=self.get_parameter_value())

    @classmethod
    def from_parameter_msg(cls, message: rcl_interfaces.Parameter) -> Parameter:
        """Return the parameter of ROS 2's message.

        Args:
            message: The message.

        Raises:
            ValueError: There is no such type.
        """
        return cls(message.name, ParameterType(message.value.type), parameter_value_to_python(message.value))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Parameter):
            return NotImplemented
        return (self._name, self._type, self._value) == (other._name, other._type, other._value)

    def __hash__(self) -> int:
        return hash((self._name, self._type))  # a value may be a list

    def __repr__(self) -> str:
        return f"Parameter({self._name!r}, {self._type.name}, {self._value!r})"


@dataclass(frozen=True, kw_only=True, slots=True)
class FloatingPointRange:
    """Bounds of a double, included; a step of 0 allows any value between them."""

    from_value: float
    to_value: float
    step: float = 0.0

    def fault(self, value: float, name: str) -> str:
        """Return why a value is outside, "" if it is inside.

        Args:
            value: The value.
            name: The parameter's name, for the reason.

        Returns:
            The reason.
        """
        # The bounds are allowed even if no step leads to the upper one, as in rclpy.
        if _close(value, self.from_value) or _close(value, self.to_value):
            return ""
        # The texts are rclpy's, which programs may look for.
        if not self.from_value <= value <= self.to_value:
            return (
                f"Parameter {name} out of range Min: {self.from_value}, Max: {self.to_value}, value: {value}"
            )
        steps = (value - self.from_value) / self.step if self.step else 0.0
        if not math.isfinite(steps) or math.isclose(steps, round(steps), rel_tol=1e-12, abs_tol=1e-6):
            return ""  # in a range without end, or of tiny steps, every value is on a step
        return (
            f"The parameter value for {name} is not close enough to a valid step."
            f" Min: {self.from_value}, max: {self.to_value}, value: {value}, step: {self.step}"
        )


@dataclass(frozen=True, kw_only=True, slots=True)
class IntegerRange:
    """Bounds of an integer, included; a step of 0 or 1 allows any value between them."""

    from_value: int
    to_value: int
    step: int = 1

    def fault(self, value: int, name: str) -> str:
        """Return why a value is outside, "" if it is inside.

        Args:
            value: The value.
            name: The parameter's name, for the reason.

        Returns:
            The reason.
        """
        if value in {self.from_value, self.to_value}:
            return ""
        if not self.from_value <= value <= self.to_value:
            return (
                f"Parameter {name} out of range. Min: {self.from_value}, Max: {self.to_value}, value: {value}"
            )
        if not self.step or (value - self.from_value) % self.step == 0:
            return ""
        return (
            f"The parameter value for {name} is not a valid step."
            f" Min: {self.from_value}, max: {self.to_value}, value: {value}, step: {self.step}"
        )


@dataclass(frozen=True, kw_only=True, slots=True)
class ParameterDescriptor:
    """Description and constraints of one parameter.

    Attributes:
        name: Its name; filled in by the declaration.
        type: Its type; filled in by the declaration.
        description: Human-readable text.
        additional_constraints: Human-readable text: constraints that callbacks check.
        read_only: Whether it can only be declared, not set.
        dynamic_typing: Whether its type may change; None then removes the value.
        floating_point_range: At most one; for doubles only.
        integer_range: At most one; for integers only.
    """

    name: str = ""
    type: ParameterType = ParameterType.NOT_SET
    description: str = ""
    additional_constraints: str = ""
    read_only: bool = False
    dynamic_typing: bool = False
    floating_point_range: Sequence[FloatingPointRange] = field(default=())
    integer_range: Sequence[IntegerRange] = field(default=())

    def to_msg(self) -> rcl_interfaces.ParameterDescriptor:
        """Return it as ROS 2's message."""
        from actors.interfaces.rcl_interfaces import msg as messages  # noqa: PLC0415 - seldom needed

        fields = {each.name: getattr(self, each.name) for each in dataclass_fields(self)}
        fields["type"] = int(self.type)
        for name, kind in (
            ("floating_point_range", messages.FloatingPointRange),
            ("integer_range", messages.IntegerRange),
        ):
            fields[name] = [
                kind(from_value=each.from_value, to_value=each.to_value, step=each.step)
                for each in fields[name]
            ]
        return messages.ParameterDescriptor(**fields)

    @classmethod
    def from_msg(cls, message: rcl_interfaces.ParameterDescriptor) -> ParameterDescriptor:
        """Return the descriptor of ROS 2's message.

        Args:
            message: The message.

        Raises:
            ValueError: There is no such type.
        """
        return cls(
            name=message.name,
            type=ParameterType(message.type),
            description=message.description,
            additional_constraints=message.additional_constraints,
            read_only=message.read_only,
            dynamic_typing=message.dynamic_typing,
            floating_point_range=tuple(
                FloatingPointRange(from_value=each.from_value, to_value=each.to_value, step=each.step)
                for each in message.floating_point_range
            ),
            integer_range=tuple(
                IntegerRange(from_value=each.from_value, to_value=each.to_value, step=each.step)
                for each in message.integer_range
            ),
        )

    def fault(self, value: ParameterValue) -> str:
        """Return why the ranges refuse a value, "" if they do not.

        Args:
            value: The value.
        """
        if isinstance(value, float):
            return next(
                filter(None, (each.fault(value, self.name) for each in self.floating_point_range)), ""
            )
        if isinstance(value, int) and not isinstance(value, bool):
            return next(filter(None, (each.fault(value, self.name) for each in self.integer_range)), "")
        return ""


@dataclass(frozen=True, slots=True)
class SetParametersResult:
    """Result of setting parameters.

    Attributes:
        successful: Whether they were set.
        reason: Why not.
    """

    successful: bool
    reason: str = ""


@dataclass(frozen=True, slots=True)
class ListParametersResult:
    """Result of listing parameters.

    Attributes:
        names: Their names.
        prefixes: The parts of these names before the last dot, each once.
    """

    names: list[str]
    prefixes: list[str]


def parameter_value_to_python(value: rcl_interfaces.ParameterValue) -> ParameterValue:
    """Return the Python value of ROS 2's message: lists for arrays, bytes for an array of bytes.

    Args:
        value: The message. Its array of bytes may be a list of single bytes, as in rclpy.

    Raises:
        ValueError: There is no such type.
    """
    kind = ParameterType(value.type)
    if kind is ParameterType.NOT_SET:
        return None
    found: Any = getattr(value, f"{kind.name.lower()}_value")
    if kind is ParameterType.BYTE_ARRAY:
        return b"".join(cast("list[bytes]", found)) if isinstance(found, list) else bytes(found)
    return [*found] if kind in _ARRAYS else cast("ParameterValue", found)


def parameter_value_from_string(text: str) -> ParameterValue:
    """Return the value of a string on a command line, by YAML's rules.

    A text that is not a bool, int, double, string or list of one of them is a string.

    Args:
        text: The text.
    """
    from actors.interfaces.yaml_reader import YamlError, load_yaml  # noqa: PLC0415 - for command lines only

    try:
        value = load_yaml(text)
    except YamlError:
        return text
    try:
        ParameterType.from_parameter_value(value)
    except TypeError:
        return text
    # An empty text and `null` are strings: a parameter cannot be given no value on a command line.
    return text if value is None else cast("ParameterValue", value)


def _close(value: float, bound: float) -> bool:
    return math.isclose(value, bound, rel_tol=1e-9, abs_tol=1e-9)

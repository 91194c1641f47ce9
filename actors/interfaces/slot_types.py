"""The types of a message's fields as objects, which ROS 2's message classes have in `SLOT_TYPES`.

They have the names and attributes of ROS 2's `rosidl_parser.definition`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

from actors.interfaces.fields import IDL_NAMES, fields_of

if TYPE_CHECKING:
    from actors.interfaces.fields import FieldType
    from actors.interfaces.naming import MessageType


class AbstractType:
    """A field's type."""


class AbstractNestableType(AbstractType):
    """A type that sequences can contain."""


@dataclass(frozen=True)
class BasicType(AbstractNestableType):
    """A number, a boolean or a byte.

    Attributes:
        typename: Its name in IDL, such as "int32", "double", "boolean" or "octet".
    """

    typename: str


@dataclass(frozen=True)
class NamespacedType(AbstractNestableType):
    """A message.

    Attributes:
        namespaces: The package and the kind: ["std_msgs", "msg"].
        name: The name in the package.
    """

    namespaces: list[str]
    name: str

    def namespaced_name(self) -> tuple[str, ...]:
        """Return the namespaces and the name."""
        return *self.namespaces, self.name


class AbstractGenericString(AbstractNestableType):
    """A string of any kind."""

    def has_maximum_size(self) -> bool:
        """Return whether its length is limited."""
        return isinstance(self, BoundedString | BoundedWString)


class AbstractString(AbstractGenericString):
    """A `string`."""


class AbstractWString(AbstractGenericString):
    """A `wstring`."""


@dataclass(frozen=True)
class UnboundedString(AbstractString):
    """A `string` of any length."""


@dataclass(frozen=True)
class BoundedString(AbstractString):
    """A `string` of limited length.

    Attributes:
        maximum_size: Its greatest length.
    """

    maximum_size: int


@dataclass(frozen=True)
class UnboundedWString(AbstractWString):
    """A `wstring` of any length."""


@dataclass(frozen=True)
class BoundedWString(AbstractWString):
    """A `wstring` of limited length.

    Attributes:
        maximum_size: Its greatest length.
    """

    maximum_size: int


@dataclass(frozen=True)
class AbstractNestedType(AbstractType):
    """Several elements of one type.

    Attributes:
        value_type: That type.
    """

    value_type: AbstractNestableType

    def has_maximum_size(self) -> bool:
        """Return whether the number of elements is limited."""
        return not isinstance(self, UnboundedSequence)


@dataclass(frozen=True)
class Array(AbstractNestedType):
    """`T[n]`.

    Attributes:
        value_type: The type of its elements.
        size: Their number.
    """

    size: int


class AbstractSequence(AbstractNestedType):
    """`T[]` or `T[<=n]`."""


@dataclass(frozen=True)
class UnboundedSequence(AbstractSequence):
    """`T[]`.

    Attributes:
        value_type: The type of its elements.
    """


@dataclass(frozen=True)
class BoundedSequence(AbstractSequence):
    """`T[<=n]`.

    Attributes:
        value_type: The type of its elements.
        maximum_size: Their greatest number.
    """

    maximum_size: int


def _element(kind: FieldType) -> AbstractNestableType:
    if "/" in kind.base:
        *namespaces, name = kind.base.split("/")
        return NamespacedType(namespaces, name)
    if kind.base == "string":
        return BoundedString(kind.string_bound) if kind.string_bound else UnboundedString()
    if kind.base == "wstring":
        return BoundedWString(kind.string_bound) if kind.string_bound else UnboundedWString()
    return BasicType(IDL_NAMES.get(kind.base, kind.base))


def _slot_type(kind: FieldType) -> AbstractType:
    element = _element(kind)
    if not kind.is_array:
        return element
    if kind.high is None:
        return UnboundedSequence(element)
    return Array(element, kind.high) if kind.is_fixed else BoundedSequence(element, kind.high)


@cache
def slot_types(cls: MessageType) -> tuple[AbstractType, ...]:
    """Return the types of a message class's fields in order.

    Raises:
        TypeError: A field has no ROS type.
    """
    return tuple(_slot_type(field.type) for field in fields_of(cls))

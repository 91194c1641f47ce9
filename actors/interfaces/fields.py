"""The fields of a message class: their ROS types, and the types for msgspec's decoder.

A class's annotations are read once, here. `fields_of` returns the ROS types, for the definition, the hash and
the rendered text. `wired` gives msgspec the types to check and build, which differ: a plain `int` is checked
as int64, and a numeric sequence is decoded by the hooks of `codec.py`.
"""

from __future__ import annotations

import sys
import threading
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache
from inspect import get_annotations
from types import GenericAlias, UnionType
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    ClassVar,
    Final,
    TypeVar,
    get_args,
    get_origin,
    get_type_hints,
)

import msgspec

from actors.interfaces.arrays import ARRAY_BY_ELEMENT, NumericArray
from actors.interfaces.naming import MessageType, message_name
from actors.interfaces.types import AtMost, Length, Ros

if TYPE_CHECKING:
    from collections.abc import Callable, Generator

BINARY: Final = frozenset({"uint8", "byte", "char"})
"""Element types whose sequences are encoded as msgpack bin."""
IDL_NAMES: Final = {
    "bool": "boolean",
    "byte": "octet",
    "char": "uint8",
    "float32": "float",
    "float64": "double",
}
"""Primitives that have another name in IDL."""
_PLAIN: Final[dict[type, str]] = {
    bool: "bool", int: "int64", float: "float64", str: "string",
    bytes: "uint8[]", bytearray: "uint8[]", memoryview: "uint8[]",
}  # fmt: skip
_INT64: Final = Annotated[int, msgspec.Meta(ge=-(2**63), le=2**63 - 1)]
_NO_ROS_TYPE: Final = (
    "has no ROS type; use bool, int, float, str, bytes, a type of actors.interfaces.types, "
    "a Message class, or a list of one of these"
)


@dataclass(frozen=True)
class FieldType:
    """A field's type in ROS's terms.

    Attributes:
        base: A primitive's name, or the type name of a message ("std_msgs/msg/Header").
        message: The nested message's class; None for a primitive and in parsed text.
        string_bound: The `n` of `string<=n`; 0 if unbounded.
        is_array: Whether this is a sequence of `base`.
        low: The least number of elements.
        high: The greatest number of elements; None if unbounded. Equal to `low`: a fixed-size array.
    """

    base: str
    message: MessageType | None = None
    string_bound: int = 0
    is_array: bool = False
    low: int = 0
    high: int | None = None

    @property
    def is_fixed(self) -> bool:
        """Whether this is `T[n]`."""
        return self.is_array and self.high is not None and self.low == self.high

    @property
    def idl(self) -> str:
        """The type as ROS 2's Python classes name it, such as "sequence<double, 3>" or "std_msgs/Header"."""
        package, _, rest = self.base.partition("/")
        text = f"{package}/{rest.rpartition('/')[2]}" if rest else IDL_NAMES.get(self.base, self.base)
        if self.string_bound:
            text += f"<{self.string_bound}>"
        if not self.is_array:
            return text
        if self.is_fixed:
            return f"{text}[{self.high}]"
        return f"sequence<{text}>" if self.high is None else f"sequence<{text}, {self.high}>"

    def __str__(self) -> str:
        text = self.base.replace("/msg/", "/")
        if self.string_bound:
            text += f"<={self.string_bound}"
        if not self.is_array:
            return text
        if self.is_fixed:
            return f"{text}[{self.high}]"
        return f"{text}[]" if self.high is None else f"{text}[<={self.high}]"


@dataclass(frozen=True)
class Field:
    """One field of a message class, in order of declaration."""

    name: str
    type: FieldType


class SequenceWire(type):
    """The decoder's type of a numeric sequence, whose value a hook builds and checks.

    Attributes:
        field_type: The sequence's ROS type.
        array: The class that holds its elements.
        as_list: Whether the field's value is a plain list.
        is_bounded: Whether its length is limited.
    """

    field_type: FieldType
    array: type[NumericArray]
    as_list: bool
    is_bounded: bool

    def __instancecheck__(cls, instance: object) -> bool:
        # The hook has checked the value, but msgspec checks the type again.
        return True

    def check_length(cls, count: int) -> None:
        """Raise ValueError unless the sequence may have `count` elements."""
        low, high = cls.field_type.low, cls.field_type.high
        if count < low or (high is not None and count > high):
            raise ValueError(f"Expected {cls.field_type}, got {count} elements")


def sequence_wire(field_type: FieldType, array: type[NumericArray], *, as_list: bool) -> SequenceWire:
    """Return the decoder's type for a numeric sequence, read as `array` or as a plain list."""
    # A class for each type, because msgspec tells its hook only the class: the bounds travel in it.
    wire = SequenceWire(str(field_type), (), {})
    wire.field_type, wire.array, wire.as_list = field_type, array, as_list
    wire.is_bounded = field_type.high is not None or field_type.low > 0
    return wire


def _bounded(field_type: FieldType, extras: list[Any]) -> FieldType:
    """Return `field_type` with the bounds that Length, AtMost and msgspec.Meta declare."""
    low, high = 0, None
    for extra in extras:
        if isinstance(extra, Length):
            low = high = extra.count
        elif isinstance(extra, AtMost):
            high = extra.count
        elif isinstance(extra, msgspec.Meta):
            low, high = extra.min_length or low, extra.max_length if extra.max_length is not None else high
    if field_type.is_array:
        return replace(field_type, low=low, high=high)
    # ROS has no lower bound for strings.
    if field_type.base in {"string", "wstring"} and high is not None:
        return replace(field_type, string_bound=high)
    return field_type


def _length_meta(field_type: FieldType) -> msgspec.Meta | None:
    if not field_type.low and field_type.high is None:
        return None
    return msgspec.Meta(min_length=field_type.low or None, max_length=field_type.high)


def _annotated(base: Any, *metas: msgspec.Meta | None) -> Any:
    for meta in metas:
        if meta is not None:
            base = Annotated[base, meta]
    return base


def _list_type(item: Any, extras: list[Any]) -> tuple[FieldType, Any]:
    """Resolve `list[item]`."""
    element, wire = _resolve(item)
    if element.is_array:
        raise TypeError("is a sequence of sequences, which ROS does not have")
    # Such a list would be one object for each byte of an image; `bytes` is the same thing in one.
    if element.base in BINARY:
        raise TypeError(f"is a list of {element.base}; use bytes or types.UInt8Sequence")
    field_type = _bounded(replace(element, is_array=True), extras)
    array = ARRAY_BY_ELEMENT.get(element.base)
    if array is not None:
        return field_type, sequence_wire(field_type, array, as_list=True)
    return field_type, _annotated(GenericAlias(list, (wire,)), _length_meta(field_type))


def _resolve(annotation: Any) -> tuple[FieldType, Any]:
    """Return the ROS type of an annotation, and the decoder's type for it.

    Raises:
        TypeError: It has no ROS type; the text continues "field x of class Y …".
    """
    extras: list[Any] = []
    while get_origin(annotation) is Annotated:
        annotation, *metadata = get_args(annotation)
        # In front: an outer annotation comes later in the list, and so wins over an alias's own.
        extras[:0] = metadata
    marker = next((extra.name for extra in extras if isinstance(extra, Ros)), "")
    if get_origin(annotation) is list:
        return _list_type(get_args(annotation)[0], extras)
    if isinstance(annotation, MessageType):
        return FieldType(message_name(annotation), annotation), annotation
    if isinstance(annotation, type) and issubclass(annotation, NumericArray):
        field_type = _bounded(FieldType(annotation.element, is_array=True), extras)
        return field_type, sequence_wire(field_type, annotation, as_list=False)
    if get_origin(annotation) is UnionType or annotation not in _PLAIN:
        raise TypeError(_NO_ROS_TYPE)
    name = marker or _PLAIN[annotation]
    field_type = _bounded(FieldType(name.removesuffix("[]"), is_array=name.endswith("[]")), extras)
    if field_type.is_array:
        return field_type, _annotated(annotation, _length_meta(field_type))
    if field_type.string_bound:
        return field_type, Annotated[str, msgspec.Meta(max_length=field_type.string_bound)]
    metas = [extra for extra in extras if isinstance(extra, msgspec.Meta)]
    return field_type, _INT64 if name == "int64" and not metas else _annotated(annotation, *metas)


def _check_options(cls: MessageType) -> None:
    config = cls.__struct_config__
    # Each of these changes the bytes on the wire, for which the type hash, made of names and types, stays
    # the same.
    if config.array_like or config.tag is not None or cls.__struct_encode_fields__ != cls.__struct_fields__:
        raise TypeError(
            f"Message class {cls.__qualname__} uses array_like, tag or rename; "
            "messages travel as maps of their field names, so leave these out"
        )


@cache
def _resolved(cls: MessageType) -> tuple[tuple[Field, ...], dict[str, Any]]:
    _check_options(cls)
    try:
        # With the class's own name, so that a message of a local scope may refer to itself in its
        # annotations.
        hints = get_type_hints(cls, localns={cls.__name__: cls}, include_extras=True)
    except NameError as error:
        raise TypeError(
            f"A field of message class {cls.__qualname__} has a type that is not found: {error}. "
            "Define the types of its fields at the top level of a module"
        ) from error
    fields: list[Field] = []
    wires: dict[str, Any] = {}
    for name in cls.__struct_fields__:
        try:
            field_type, wires[name] = _resolve(hints[name])
        except TypeError as error:
            raise TypeError(_field_error(name, cls, error)) from None
        fields.append(Field(name, field_type))
    return tuple(fields), wires


def check_annotations(cls: type) -> None:
    """Check the field types of a class that is being made, as far as they are known yet.

    Names that are not found are left to `fields_of`: they may be defined later in the module.

    Raises:
        TypeError: A field has no ROS type.
    """
    module = sys.modules.get(cls.__module__)
    names = {} if module is None else vars(module)
    for field, annotation in get_annotations(cls).items():
        try:
            # One by one: those that are known are checked, whatever the others are.
            one = type(cls.__name__, (), {"__annotations__": {field: annotation}})
            # As in `_resolved`: a field does not hide the type that has its name.
            hint = get_type_hints(one, names, {cls.__name__: cls}, include_extras=True)[field]
        except NameError:
            continue
        inner = hint
        while get_origin(inner) in {Annotated, list}:
            inner = get_args(inner)[0]
        # A message class may not have its name yet, which `_resolve` would set: a service gives names to its
        # parts when it is made.
        if get_origin(hint) is not ClassVar and not isinstance(inner, MessageType):
            try:
                _resolve(hint)
            except TypeError as error:
                raise TypeError(_field_error(field, cls, error)) from None


def _field_error(field: str, cls: type, error: TypeError) -> str:
    return f"Field '{field}' of message class {cls.__qualname__} {error}"


def fields_of(cls: MessageType) -> tuple[Field, ...]:
    """Return the fields of a message class in order.

    Raises:
        TypeError: A field has no ROS type, or the class uses options that change how it travels.
    """
    return _resolved(cls)[0]


def wires_of(cls: MessageType) -> dict[str, Any]:
    """Return the decoder's types of the fields of a message class; raise as `fields_of`."""
    return _resolved(cls)[1]


@cache
def constants_of(cls: MessageType) -> tuple[tuple[str, FieldType, object], ...]:
    """Return the ROS constants of a message class in order: name, type, value."""
    constants: list[tuple[str, FieldType, object]] = []
    for name, hint in get_type_hints(cls, include_extras=True).items():
        if get_origin(hint) is ClassVar and name.isupper():
            constants.append((name, _resolve(get_args(hint)[0])[0], getattr(cls, name)))
    return tuple(constants)


def nested_classes(cls: MessageType) -> set[MessageType]:
    """Return every message class that `cls` contains, at any depth, and `cls` itself."""
    found: set[MessageType] = set()
    pending = [cls]
    while pending:
        this = pending.pop()
        # Messages may contain one another in a circle (in lists); each is visited once.
        if this not in found:
            found.add(this)
            pending += [field.type.message for field in fields_of(this) if field.type.message is not None]
    return found


T = TypeVar("T")
_annotations_lock = threading.Lock()


@contextmanager
def _wired_annotations(classes: set[MessageType]) -> Generator[None]:
    saved = [(cls, cls.__annotations__) for cls in classes]
    for cls in classes:
        cls.__annotations__ = dict(_resolved(cls)[1])
    try:
        yield
    finally:
        for cls, annotations in saved:
            cls.__annotations__ = annotations


def wired(cls: MessageType, build: Callable[[], T]) -> T:
    """Call `build`, which makes msgspec decoders for `cls`, while the classes have the decoder's annotations.

    msgspec reads a Struct's annotations once, when it first makes a decoder for it; before and after that the
    annotations are the author's.
    """
    # A lock, as the annotations are visible to every thread while they are replaced.
    with _annotations_lock, _wired_annotations(nested_classes(cls)):
        return build()


_strict_classes: Final[dict[tuple[MessageType, bool], Any]] = {}
_strict_lock: Final = threading.RLock()


def strict(cls: MessageType) -> Any:
    """Return a type for a decoder that checks messages of a class; nested ones must have the right fields.

    A message travels as a map, and a reader fills in what a map leaves out: a Point in a field for a Pose
    would arrive as a new Pose. In this type each nested message has all fields of its class and no others;
    only the outermost may have more, as an instance of a subclass does. It is also faster than `cls`: it has
    no defaults, and the garbage collector does not track its instances.

    Returns:
        `cls` itself, to be used within `wired`, if it has no nested messages.

    Raises:
        TypeError: As for `fields_of`.
    """
    if all(field.type.message is None for field in fields_of(cls)):
        return cls
    # Such a type may be in its own fields, and so has their types only some time after it is made.
    with _strict_lock:
        return _strict(cls, nested=False)


def _strict(cls: MessageType, *, nested: bool) -> Any:
    key = (cls, nested)
    if key not in _strict_classes:
        fields, wires = _resolved(cls)
        # What such a class leaves out on the wire is no mistake.
        default = {"default": None} if cls.__struct_config__.omit_defaults else {}
        made = msgspec.defstruct(
            cls.__name__,
            [(field.name, object, msgspec.field(**default)) for field in fields],
            forbid_unknown_fields=nested,
            gc=False,
        )
        _strict_classes[key] = made
        made.__annotations__ = {field.name: _strict_type(field.type, wires[field.name]) for field in fields}
    return _strict_classes[key]


def _strict_type(field_type: FieldType, wire: Any) -> Any:
    if field_type.message is None:
        return wire
    made = _strict(field_type.message, nested=True)
    if not field_type.is_array:
        return made
    return _annotated(GenericAlias(list, (made,)), _length_meta(field_type))

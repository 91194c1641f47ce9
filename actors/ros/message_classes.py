"""Gives the classes of interfaces what ROS 2's generated classes have, in processes that import its names.

callboard's messages have bytes for `uint8[]`, which are not copied, and need no NumPy. ROS 2's have an
`array.array` for a sequence of numbers, a NumPy array for one of fixed size and a list for `byte[]`; what is
assigned or given to a constructor is copied. They are in modules such as `std_msgs.msg._string`, and have
names such as `SetBool_Request`.

The classes stay the same objects. The field of such a sequence becomes a property, which converts what a
received or new message holds when it is first read. The codec reads what is behind the property, so nobody
pays for fields that nobody reads, and messages that are passed on are not converted at all.

Only classes of interface definitions are changed. Those that a program writes by hand keep their values.
"""

from __future__ import annotations

import re
import sys
from array import array
from collections.abc import Mapping
from functools import cache
from itertools import zip_longest
from typing import TYPE_CHECKING, Any, Final, cast

from msgspec import StructMeta

from actors.interfaces.arrays import ARRAY_BY_ELEMENT
from actors.interfaces.checking import check_field, check_fields
from actors.interfaces.fields import FieldType, constants_of, fields_of
from actors.interfaces.message import Action, Message, Service, rebuilt_by_name
from actors.interfaces.naming import TYPE_NAME, MessageType, message_name

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import ModuleType

_MODULE: Final = re.compile(r"(?:.*\.)?([a-z][a-z0-9_]*\.(?:msg|srv|action)\._\w+)")
"""Modules of generated classes, and what ROS 2 calls them."""
_READ_ONLY: Final = (memoryview, bytes)
"""What a decoded or new message has for `uint8[]`, `char[]` and `byte[]`."""

_make: Final[Any] = StructMeta.__call__
"""Makes a message. `super` would take a third of the time of a small one."""

_reduce_plain: Final[Any] = Message.__reduce__
_own_names: Final[dict[type, tuple[str, str]]] = {}
"""Renamed classes: their modules and names in callboard."""
_converters: Final[dict[Any, dict[str, Any]]] = {}
"""Classes with such sequences: what their constructors convert, by the names of the fields."""


def adopt_all(is_ours: Callable[[str], bool]) -> None:
    """Change all classes of interfaces in this process, also those that are made later.

    Args:
        is_ours: Tells whether ROS 2's name of an interface package means callboard's.
    """
    global _has_adopted  # noqa: PLW0603 - of the process, as the classes are
    if _has_adopted:
        return
    _has_adopted = True
    make = MessageType.__new__
    checks = "__call__" in MessageType.__dict__

    def make_adopted(
        mcls: type[MessageType],
        name: str,
        bases: tuple[type, ...],
        namespace: dict[str, Any],
        **options: Any,
    ) -> MessageType:
        generated = None if _MODULE.fullmatch(namespace.get("__module__", "")) else _generated(bases)
        if generated is None:
            made = make(mcls, name, bases, namespace, **options)
        else:  # a program's own: with attributes, and of the same type for ROS 2
            init = namespace.pop("__init__", None)
            namespace.pop("__slots__", None)  # msgspec refuses them
            namespace.setdefault("__copy__", _copy)  # msgspec's forgets the attributes
            made = make(_Initialized if init else mcls, name, bases, namespace, dict=True, **options)
            if init:
                type.__setattr__(made, "__init__", init)
            if made.__struct_fields__ == generated.__struct_fields__:
                type.__setattr__(made, TYPE_NAME, message_name(generated))
        adopt(made)
        rename(made, is_ours)
        return made

    setattr(MessageType, "__new__", make_adopted)  # noqa: B010 - not for type checkers
    setattr(MessageType, "__call__", _checked_call if checks else _call)  # noqa: B010
    setattr(MessageType, "__getattr__", _constants)  # noqa: B010
    setattr(Message, "_check_fields", False)  # noqa: B010
    setattr(Message, "__init__", _init)  # noqa: B010
    setattr(Message, "__reduce__", _reduce)  # noqa: B010
    for base in (Service, Action):
        _follow(base, is_ours)
    for cls in _subclasses(Message):
        adopt(cast("MessageType", cls))
        rename(cls, is_ours)
    for base in (Service, Action):
        for cls in _subclasses(base):
            _rename_parts(cls, is_ours)


_has_adopted = False


def _generated(bases: tuple[type, ...]) -> Any:
    """Return the class of ROS 2 that one with these bases is derived from."""
    ancestors = (cls for base in bases for cls in base.__mro__)
    return next(
        (cls for cls in ancestors if isinstance(cls, MessageType) and _MODULE.fullmatch(cls.__module__)), None
    )


class _Initialized(MessageType):
    """The class of a program's subclasses with an `__init__`, which msgspec neither allows nor calls."""

    def __call__(cls, *args: Any, **fields: Any) -> Any:  # noqa: N805 - a metaclass
        """Make a message of the defaults, and let the program's `__init__` set the fields."""
        message = _make(cls)
        message.__init__(*args, **fields)
        return message


def _init(message: Message, *, check_fields: object = None, **fields: Any) -> None:
    """Set fields, for `super().__init__` in such a class."""
    del check_fields
    for name, value in fields.items():
        if name not in message.__struct_fields__:
            raise TypeError(f"Unexpected keyword argument '{name}'")
        setattr(message, name, value)


def _reduce(message: Message) -> tuple[Any, ...]:
    """Return what pickle and copy make the message of: in callboard's own processes, too."""
    cls = type(message)
    rebuilt, (_, values) = _reduce_plain(message)
    if hasattr(message, "__dict__"):
        return _remade, (cls, values, vars(message))
    name = _own_names.get(cls)
    return (rebuilt, (cls, values)) if name is None else (rebuilt_by_name, (*name, values))


def _copy(message: Message) -> Any:
    make, arguments = _reduce(message)
    return make(*arguments)


def _remade(cls: type[Message], values: dict[str, Any], attributes: dict[str, Any]) -> Message:
    message: Message = _make(cls, **values)
    vars(message).update(attributes)
    return message


def _follow(base: type, is_ours: Callable[[str], bool]) -> None:
    """Rename the services or actions that are made from now on, with their parts."""
    original: Any = base.__dict__["__init_subclass__"].__func__

    def init_subclass(cls: Any, /, **options: Any) -> None:
        original(cls, **options)
        _rename_parts(cls, is_ours)

    setattr(base, "__init_subclass__", classmethod(init_subclass))  # noqa: B010


def _subclasses(base: type) -> list[type]:
    found: list[type] = []
    subclasses: list[type] = base.__subclasses__()
    for cls in subclasses:
        found += [cls, *_subclasses(cls)]
    return found


def rename(cls: type, is_ours: Callable[[str], bool], name: str = "") -> None:
    """Give a class the module, and if it is a part of a service or action the name, that it has in ROS 2.

    Args:
        cls: The class.
        is_ours: As for `adopt_all`.
        name: The new name; "" if it keeps its own.
    """
    match = _MODULE.fullmatch(cls.__module__)
    module = sys.modules.get(cls.__module__)
    if match is None or module is None:
        return
    own = cls.__module__, cls.__qualname__
    if match[1] != cls.__module__:
        if not is_ours(match[1].partition(".")[0]):
            return
        # The module is known by both names, and is one object: pickle and annotations find the class.
        cls.__module__ = match[1]
        sys.modules.setdefault(match[1], module)
        _own_names.setdefault(cls, own)
    if name:
        _own_names.setdefault(cls, own)
        cls.__name__ = cls.__qualname__ = name
    if "_" in cls.__name__:
        setattr(module, cls.__name__, cls)


def _rename_parts(owner: type, is_ours: Callable[[str], bool]) -> None:
    for part, cls in list(vars(owner).items()):
        if isinstance(cls, MessageType) and cls.__qualname__ == f"{owner.__qualname__}.{part}":
            rename(cls, is_ours, f"{owner.__name__}_{part}")
    rename(owner, is_ours)
    module = sys.modules.get(owner.__module__)
    if module is not None and _MODULE.fullmatch(owner.__module__) is not None:
        # The parts that callboard makes when they are used first, such as an action's FeedbackMessage: the
        # package knows them.
        package = module.__name__.rpartition(".")[0]

        def find_part(name: str) -> object:
            return getattr(sys.modules[package], name)

        vars(module).setdefault("__getattr__", find_part)


def adopt(cls: MessageType) -> None:
    """Make properties of the fields of a generated class that are sequences of numbers or bytes.

    `_name` and `__slots__` are there, too, as some libraries read messages.
    """
    if _MODULE.fullmatch(cls.__module__) is None or cls in _converters:
        return
    members = vars(cls)
    names = [name for name in cls.__struct_fields__ if name in members]
    # Resolving annotations takes longer than all else here, and most classes have no such field.
    annotations = cast("dict[str, object]", members.get("__annotations__") or {}).values()
    types = (
        {field.name: field.type for field in fields_of(cls)}
        if any(not isinstance(each, str) or "Sequence" in each for each in annotations)
        else {}
    )
    converters: dict[str, Any] = {}
    for name in names:
        member = members[name]
        kind = types.get(name)
        convert = _converter(kind) if kind is not None else None
        if convert is not None:
            converters[name] = convert
            member = _property(member, convert)
            type.__setattr__(cls, name, member)
        type.__setattr__(cls, f"_{name}", member)
    type.__setattr__(cls, "__slots__", [*(f"_{name}" for name in cls.__struct_fields__), "_check_fields"])
    if converters:
        _converters[cls] = converters


def has_adopted(cls: type) -> bool:
    """Return whether a class has such properties."""
    return cls in _converters


def _constants(cls: MessageType, name: str) -> dict[str, object]:
    """Return the constants of a class, by a private name that `ros2 service echo` uses."""
    if name != f"_Metaclass_{cls.__name__}__constants":
        raise AttributeError(f"type object {cls.__name__!r} has no attribute {name!r}")
    return {constant: value for constant, _, value in constants_of(cls)}


def _call(cls: MessageType, *args: Any, **fields: Any) -> Any:
    """Make a message; copy the sequences that it is given."""
    if not (args or fields):
        return _make(cls)
    if "check_fields" in fields and fields.pop("check_fields"):
        check_fields(cls, args, fields)
        return _call(_checked(cls), *args, **fields)
    converters = _converters.get(cls)
    if converters is not None:
        if args:
            # Those that are too many, and given by name, too, stay: the class refuses them.
            names = cls.__struct_fields__[: len(args)]
            args = tuple(
                converters[name].given(value) if name in converters else value
                for name, value in zip_longest(names, args)
            )
        for name in fields.keys() & converters:
            fields[name] = converters[name].given(fields[name])
    return _make(cls, *args, **fields)


def _checked_call(cls: MessageType, *args: Any, **fields: Any) -> Any:
    """Do the same where all messages check what they are given."""
    fields.pop("check_fields", None)
    check_fields(cls, args, fields)
    return _call(cls, *args, **fields)


@cache
def _checked(cls: MessageType) -> MessageType:
    """Return a subclass whose messages check what is assigned to them; it has the same name."""

    def set_value(message: Any, name: str, value: object) -> None:
        check_field(cls, name, value)
        cast("Any", cls).__setattr__(message, name, value)

    def plain(message: Any) -> Any:
        values = {name: getattr(message, name) for name in cls.__struct_fields__}
        return super(MessageType, cls).__call__(**values)

    def equals(message: Any, other: Any) -> bool:
        return bool(plain(message) == (plain(other) if type(other) is type(message) else other))

    def reduce(message: Any) -> Any:
        return plain(message).__reduce__()

    namespace: dict[str, Any] = {
        "__module__": cls.__module__,
        "__qualname__": cls.__qualname__,
        "__setattr__": set_value,
        "__eq__": equals,
        "__hash__": None,
        "__reduce__": reduce,
    }
    made = MessageType(cls.__name__, (cls,), namespace, type_name=message_name(cls))
    type.__setattr__(made, "_check_fields", True)
    converters = _converters.get(cls)
    if converters is not None:
        _converters[made] = converters
    return made


def _property(member: Any, convert: Any) -> property:
    get, put, held = member.__get__, member.__set__, convert.held

    def read(message: Message) -> Any:
        value = get(message)
        if type(value) is not convert.type:
            made = held(value)
            if made is not value:
                put(message, made)
                return made
        return value

    def write(message: Message, value: Any) -> None:
        put(message, convert.given(value))

    return property(read, write)


def _converter(kind: FieldType) -> Any:
    if not kind.is_array or kind.message is not None:
        return None
    if kind.base == "byte":
        return _Bytes()
    element = "uint8" if kind.base == "char" else kind.base
    if element != "uint8" and element not in ARRAY_BY_ELEMENT:
        return None
    return _Fixed(element) if kind.is_fixed else _Array(element)


class _Bytes:
    """`byte[]`: a list of bytes objects of length 1, and whatever else it is given."""

    type = list

    def held(self, value: Any) -> Any:
        """Return what a message holds as ROS 2's messages have it."""
        return [bytes([each]) for each in cast("bytes", value)] if isinstance(value, _READ_ONLY) else value

    def given(self, value: Any) -> Any:
        """Return what a program gives as the message holds it."""
        return value


class _Array:
    """A sequence of numbers: an `array.array`."""

    type = array

    def __init__(self, element: str) -> None:
        self._made = ARRAY_BY_ELEMENT.get(element)
        self._code = "B" if self._made is None else self._made.format

    def held(self, value: Any) -> Any:
        """Return what a message holds as ROS 2's messages have it."""
        return self.given(value)

    def given(self, value: Any) -> Any:
        """Return a copy of what a program gives.

        Raises:
            TypeError: It is no sequence of such numbers; so are ValueError and OverflowError.
        """
        if self._made is not None:
            _refuse(value)
            if isinstance(value, list | tuple) or getattr(value, "typecode", "") == self._code:
                return array(self._code, cast("Any", value))
            return array(self._code, self._made(value))
        made = array("B")
        if isinstance(value, bytes | bytearray) or _is_octets(value):
            made.frombytes(value)
            return made
        _refuse(value)
        made.extend(value.tolist() if hasattr(value, "tolist") else value)
        return made


def _refuse(value: object) -> None:
    """Raise TypeError for what Python iterates over, but is no sequence of numbers."""
    if isinstance(value, Mapping | str):
        raise TypeError(f"Expected a sequence of numbers, got {type(cast('object', value)).__name__}")


def _is_octets(value: Any) -> bool:
    try:
        with memoryview(value) as view:
            return view.format == "B" and view.ndim == 1 and view.c_contiguous
    except TypeError:
        return False


class _Fixed:
    """A sequence of numbers of fixed size: a NumPy array; without NumPy an `array.array`."""

    def __init__(self, element: str) -> None:
        self._element = element
        self._array = _Array(element)

    @property
    def type(self) -> type:
        """The class of the values."""
        numpy: Any = numpy_module()
        return array if numpy is None else cast("type", numpy.ndarray)

    def held(self, value: Any) -> Any:
        """Return what a message holds as ROS 2's messages have it."""
        numpy: Any = numpy_module()
        if numpy is None:
            return self._array.given(value)
        if isinstance(value, array | bytes | memoryview):
            made = numpy.frombuffer(value, self._element)
            # Bytes are copied, because they are read-only; arrays share their memory.
            return made.copy() if isinstance(value, _READ_ONLY) else made
        return self.given(value)

    def given(self, value: Any) -> Any:
        """Return a copy of what a program gives.

        Raises:
            TypeError: It is no sequence of such numbers; so are ValueError and OverflowError.
        """
        numpy: Any = numpy_module()
        if numpy is None:
            return self._array.given(value)
        if isinstance(value, bytes | bytearray | memoryview):
            return numpy.array(self._array.given(value), self._element)
        made = numpy.array(value, self._element)
        source = numpy.asarray(value)
        is_exact = source.dtype == made.dtype or (made.dtype.kind == "f" and source.dtype.kind in "fiub")
        if not is_exact and not numpy.array_equal(made, source):
            raise ValueError(f"Expected {self._element} numbers, got {value!r}")
        return made


@cache
def numpy_module() -> ModuleType | None:
    """Return NumPy, which is imported now unless it has been; None if it is not installed."""
    try:
        import numpy as np  # noqa: PLC0415 - an extra, and slow to import
    except ImportError:
        return None
    return np

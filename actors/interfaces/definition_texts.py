"""Definition texts of message types, as bags and live tools have them: a type and all that it contains.

    std_msgs/Header header                      `ros2msg`: the text of a .msg file,
    float64 value
    ================================================================================
    MSG: std_msgs/Header                        then each type that it uses, below its name
    builtin_interfaces/Time stamp
    string frame_id
    ================================================================================
    MSG: builtin_interfaces/Time
    …

In `ros2idl` every part has such a heading (`IDL: …`), also the type itself. A definition from a bag is parsed
like an interface file and becomes a class like a definition from the graph (`runtime_types`): no part of it
is executed.
"""

from __future__ import annotations

import re
from functools import lru_cache
from typing import TYPE_CHECKING, Final, cast

from actors.interfaces.catalog import is_standard
from actors.interfaces.definition import definition_of_fields
from actors.interfaces.described import described_types
from actors.interfaces.errors import InterfaceSyntaxError, InvalidMessageError, UnknownInterfaceError
from actors.interfaces.fields import FieldType, nested_classes
from actors.interfaces.idl import parse_idl
from actors.interfaces.interface_names import DERIVED_NAME, KINDS, PACKAGE_NAME
from actors.interfaces.message import Message, definition, type_name
from actors.interfaces.parser import parse
from actors.interfaces.registry import installed_interface, source_of
from actors.interfaces.runtime_types import runtime_message
from actors.interfaces.specs import PARTS

if TYPE_CHECKING:
    from actors.interfaces.naming import MessageType
    from actors.interfaces.specs import InterfaceSpec

ROS2MSG: Final = "ros2msg"
ROS2IDL: Final = "ros2idl"

MAX_DEFINITION_CHARS: Final = 1 << 20
"""Limit for a whole definition; the longest one of ROS 2's own packages has 10,000 characters."""
MAX_PARTS: Final = 500
"""Limit for the types in a definition; those of ROS 2's own packages have up to 20."""
_CACHED_CLASSES: Final = 256
"""Classes to keep in the cache: a bag has a few dozen types."""

_LINE: Final = "=" * 80
_HEADING: Final = re.compile(r"^={80}\n(?:MSG|IDL): ([^\n]*)\n?", re.MULTILINE)
_KIND: Final = re.compile(r"^(\w+)/(?:srv|action)/", re.MULTILINE)


def definition_text(cls: type[Message]) -> str:
    """Return the `ros2msg` definition of a message class, whether generated or written by hand.

    Raises:
        TypeError: `cls` is not a message class, or one of its fields has no ROS type.
    """
    name = type_name(cls)
    nested = {type_name(each): each for each in nested_classes(cast("MessageType", cls))}
    del nested[name]
    parts = [_text(cls), *(f"{_LINE}\nMSG: {_short(each)}\n{_text(nested[each])}" for each in sorted(nested))]
    return "".join(parts)


def _text(cls: object) -> str:
    # Readers expect names of two parts, so the kind goes. SetBool_Request stays unique without it.
    return _KIND.sub(r"\1/", source_of(cast("type[Message]", cls)))


def _short(name: str) -> str:
    package, _, word = name.split("/")
    return f"{package}/{word}"


def has_stated_hash(name: str) -> bool:
    """Return whether a bag states the hash of a type: for messages, not for parts of services and actions.

    rosbags compares all hashes when it opens a bag. It knows the parts of services and actions by other
    names, computes other hashes for them, and would refuse the whole bag.

    Args:
        name: The type's name, with three parts.
    """
    return "/msg/" in name


def full_type_name(name: str) -> str:
    """Return a type name with three parts, as "std_msgs/msg/String" for "std_msgs/String".

    Args:
        name: A type name from a bag. Text that is not a type name is returned unchanged.
    """
    package, _, word = name.partition("/")
    return f"{package}/msg/{word}" if word and "/" not in word else name


def class_of_definition(name: str, text: str, text_format: str) -> type[Message]:
    """Return the class of a type: the installed one if its definition is the same, or a new one.

    Args:
        name: The type's name.
        text: Its definition; "" to use the installed type.
        text_format: "ros2msg" or "ros2idl".

    Raises:
        InterfaceSyntaxError: The definition breaks a rule of its format.
        InvalidMessageError: No class can be made from it: a type contains itself, or has too many elements.
        UnknownInterfaceError: There is no definition, and the type is not installed.
    """
    return _class(full_type_name(name), text, text_format)


@lru_cache(maxsize=_CACHED_CLASSES)
def _class(name: str, text: str, text_format: str) -> type[Message]:
    # An empty text: the message has no fields, or the recorder did not find the definition.
    found = None if text.strip() else installed_interface(name)
    if found is not None and issubclass(found, Message):
        return found
    if text_format not in {ROS2MSG, ROS2IDL}:
        raise UnknownInterfaceError(f"The bag has no definition of {name}, and it is not installed here")
    return runtime_message(canonical_definition(name, text, text_format))


def canonical_definition(name: str, text: str, text_format: str) -> bytes:
    """Return the canonical definition of a type, from which `hash_of` computes its type hash.

    Args:
        name: The type's name, with three parts.
        text: Its definition.
        text_format: "ros2msg" or "ros2idl".

    Raises:
        InterfaceSyntaxError: The definition breaks a rule of its format, or is too long.
        InvalidMessageError: It uses a type that it does not define.
    """
    types = _types(name, text, text_format)
    try:
        return definition_of_fields(name, types)
    except KeyError as error:
        raise InvalidMessageError(f"The definition of {name} does not define {error.args[0]}") from None


def _types(name: str, text: str, text_format: str) -> dict[str, dict[str, FieldType]]:
    """Return the fields of all types that a definition defines, and of standard types that it only uses."""
    if len(text) > MAX_DEFINITION_CHARS:
        raise InterfaceSyntaxError(name, 0, f"The definition has more than {MAX_DEFINITION_CHARS} characters")
    _, kind, _ = _name_parts(name)
    own, *rest = _HEADING.split(text.replace("\r\n", "\n"))
    headed = [
        (full_type_name(heading.strip()), part) for heading, part in zip(rest[::2], rest[1::2], strict=True)
    ]
    if len(headed) > MAX_PARTS:
        raise InterfaceSyntaxError(name, 0, f"The definition has more than {MAX_PARTS} types")
    types: dict[str, dict[str, FieldType]] = {}
    if text_format == ROS2MSG:
        headers = {each.partition("/")[0] for each, _ in headed if each.endswith("/msg/Header")}
        for each, part in (*headed, (name, own)):
            types |= _parsed(each, part, kind, headers)
    else:
        for each, part in headed:
            package, kind, word = _name_parts(each)
            types |= _fields(parse_idl(part, package, kind, word))
    if name not in types:
        types |= _derived(name, types)
    return types | _standard_types(types)


def _name_parts(name: str) -> tuple[str, str, str]:
    package, _, rest = name.partition("/")
    kind, _, word = rest.partition("/")
    if kind not in KINDS or not PACKAGE_NAME.fullmatch(package):
        raise InterfaceSyntaxError(name, 0, "Expected a type name, such as std_msgs/msg/String")
    return package, kind, word


def _parsed(name: str, text: str, kind: str, headers: set[str]) -> dict[str, dict[str, FieldType]]:
    """Return the fields of the types in one part of a `ros2msg` definition.

    Args:
        name: The part's name.
        text: Its text.
        kind: The kind of the whole definition.
        headers: The packages that have a message `Header` of their own.
    """
    package, own_kind, word = _name_parts(name)
    has_header = package in headers
    separators = sum(line.strip() == "---" for line in text.splitlines())
    if separators and own_kind != "msg":
        # rosbag2 writes the text of the whole service or action from which the message is derived.
        whole = ("", "srv", "action")[min(separators, 2)]
        return _fields(parse(text, package, whole, word.partition("_")[0], name, has_header=has_header))
    if DERIVED_NAME.fullmatch(word) and kind != "msg":
        spec = parse(text, package, "msg", word, name, has_header=has_header, derived_kind=kind)
        return {f"{package}/{kind}/{word}": {field.name: field.type for field in spec.parts[0].fields}}
    return _fields(parse(text, package, "msg", word, name, has_header=has_header))


def _fields(spec: InterfaceSpec) -> dict[str, dict[str, FieldType]]:
    names = (f"{spec.type_name}_{part}" if part else spec.type_name for part in PARTS[spec.kind])
    return {
        name: {field.name: field.type for field in part.fields}
        for name, part in zip(names, spec.parts, strict=True)
    }


def _derived(name: str, types: dict[str, dict[str, FieldType]]) -> dict[str, dict[str, FieldType]]:
    """Return the fields of a message that ROS 2 derives from a service or an action."""
    base, _, part = name.rpartition("_")
    if part == "Event" and f"{base}_Request" in types:
        return {
            name: {
                "info": FieldType("service_msgs/msg/ServiceEventInfo"),
                "request": FieldType(f"{base}_Request", is_array=True, high=1),
                "response": FieldType(f"{base}_Response", is_array=True, high=1),
            }
        }
    if part == "FeedbackMessage" and f"{base}_Feedback" in types:
        return {
            name: {
                "goal_id": FieldType("unique_identifier_msgs/msg/UUID"),
                "feedback": FieldType(f"{base}_Feedback"),
            }
        }
    raise InterfaceSyntaxError(name, 0, "The definition does not define this type")


def _standard_types(types: dict[str, dict[str, FieldType]]) -> dict[str, dict[str, FieldType]]:
    """Return the fields of standard types that definitions use without defining them, as some writers do."""
    found: dict[str, dict[str, FieldType]] = {}
    for base in {field.base for fields in types.values() for field in fields.values()} - types.keys():
        cls = installed_interface(base) if is_standard(base.partition("/")[0]) else None
        if cls is not None:
            found |= described_types(definition(cls))
    return found

"""Messages and their bytes, written by hand from the rules of CDR.

The rules are those of "Common Object Request Broker Architecture (CORBA)", part 2, section 9.3 (OMG
formal/2021-08-01): a primitive is aligned to its size; a string is its length with the NUL, and the NUL;
and of "DDS-XTypes" 1.3, section 7.6.3.1.2: 00 01 before a little-endian message, 00 00 before another.
`tests/real_ros/test_cdr.py` shows that real ROS 2 reads them so.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

from actors.interfaces.message import type_name
from actors.interfaces.registry import find_interface
from tests.interfaces.random_messages import message_classes


class Vector(NamedTuple):
    """A message and its bytes.

    Attributes:
        type_name: The message's type.
        values: Its fields, as `random_messages.values_of` returns them.
        data: Its bytes, as hexadecimal digits.
    """

    type_name: str
    values: dict[str, Any]
    data: str


_BASIC: Final = {
    "bool_value": True,
    "byte_value": 0xFF,
    "char_value": 200,
    "float32_value": 1.5,
    "float64_value": -2.0,
    "int8_value": -1,
    "uint8_value": 254,
    "int16_value": -2,
    "uint16_value": 65535,
    "int32_value": -3,
    "uint32_value": 4294967295,
    "int64_value": -4,
    "uint64_value": 18446744073709551615,
}

WRITTEN: Final = (
    Vector("std_msgs/msg/String", {"data": "a"}, "00010000 02000000 6100"),
    Vector("std_msgs/msg/String", {"data": "é"}, "00010000 03000000 c3a900"),
    Vector("std_msgs/msg/String", {"data": ""}, "00010000 01000000 00"),
    # A message without fields has one byte: structs of IDL have at least one member.
    Vector("std_msgs/msg/Empty", {}, "00010000 00"),
    Vector("std_srvs/srv/Empty_Request", {}, "00010000 00"),
    Vector("std_msgs/msg/Char", {"data": 200}, "00010000 c8"),
    Vector("std_msgs/msg/Byte", {"data": 255}, "00010000 ff"),
    Vector(
        "test_msgs/msg/BasicTypes",
        _BASIC,
        "00010000 01 ff c8 00 0000c03f 00000000000000c0 ff fe feff ffff 0000 fdffffff ffffffff"
        "fcffffffffffffff ffffffffffffffff",
    ),
    Vector(
        "std_msgs/msg/Header",
        {"stamp": {"sec": -1, "nanosec": 2}, "frame_id": "map"},
        "00010000 ffffffff 02000000 04000000 6d617000",
    ),
    # After a string of three bytes with its NUL, the next double is aligned to eight.
    Vector(
        "geometry_msgs/msg/PointStamped",
        {
            "header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": "ab"},
            "point": {"x": 1.0, "y": 0.0, "z": -2.0},
        },
        "00010000 00000000 00000000 03000000 616200 00000000000000f03f 0000000000000000 00000000000000c0",
    ),
    # Nothing is aligned for the elements of a sequence that has none.
    Vector(
        "sensor_msgs/msg/JointState",
        {
            "header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""},
            "name": [],
            "position": [],
            "velocity": [],
            "effort": [2.0],
        },
        "00010000 00000000 00000000 01000000 00 000000 00000000 00000000 00000000 01000000 0000000000000040",
    ),
    # Four bytes for each UTF-16 unit, and no terminator: so Fast DDS does, which ROS 2 uses by default.
    Vector(
        "test_msgs/msg/WStrings",
        {
            "wstring_value": "ä\U0001f600",
            "wstring_value_default1": "",
            "wstring_value_default2": "",
            "wstring_value_default3": "",
            "array_of_wstrings": ["", "b", ""],
            "bounded_sequence_of_wstrings": [],
            "unbounded_sequence_of_wstrings": ["a\0b"],
        },
        "00010000 03000000 e4000000 3dd80000 00de0000 00000000 00000000 00000000"
        "00000000 01000000 62000000 00000000 00000000 01000000 03000000 61000000 00000000 62000000",
    ),
    Vector(
        "std_msgs/msg/Float64MultiArray",
        {"layout": {"dim": [], "data_offset": 7}, "data": [1.0]},
        "00010000 00000000 07000000 01000000 00000000 000000000000f03f",
    ),
    Vector(
        "std_msgs/msg/ByteMultiArray",
        {"layout": {"dim": [], "data_offset": 0}, "data": [0, 255]},
        "00010000 00000000 00000000 02000000 00ff",
    ),
)
"""callboard and ROS 2 write these bytes, and read these values from them."""

READ: Final = (
    Vector("std_msgs/msg/String", {"data": "a"}, "00000000 00000002 6100"),  # big-endian
    Vector("std_msgs/msg/Int16", {"data": 1}, "00000000 0001"),
    Vector("std_msgs/msg/String", {"data": "a"}, "0001ffff 02000000 6100"),  # options, which are ignored
    Vector("std_msgs/msg/String", {"data": "a"}, "00010000 02000000 6100 ffffffff"),  # surplus bytes
    Vector("std_msgs/msg/String", {"data": ""}, "00010000 00000000"),  # no NUL
    Vector("std_msgs/msg/String", {"data": "ab"}, "00010000 02000000 6162"),
    Vector("std_msgs/msg/String", {"data": "a"}, "00010000 04000000 61006200"),  # NUL in it
    Vector("std_msgs/msg/String", {"data": "�a"}, "00010000 03000000 ff6100"),  # not UTF-8
    Vector("std_msgs/msg/Bool", {"data": True}, "00010000 02"),
)
"""Both read these values from bytes that they would not write."""

REFUSED: Final = (
    ("std_msgs/msg/String", ""),
    ("std_msgs/msg/String", "000100"),
    ("std_msgs/msg/String", "00010000"),
    ("std_msgs/msg/String", "00010000 05000000 6100"),
    ("std_msgs/msg/Empty", "00010000"),
    ("std_msgs/msg/Int32", "00010000 010000"),
    ("std_msgs/msg/String", "00020000 02000000 6100"),  # a parameter list
    ("std_msgs/msg/String", "00060000 02000000 6100"),  # XCDR version 2
)
"""Both refuse these bytes."""

MISREAD: Final = (
    ("std_msgs/msg/String", "00070000 02000000 6100"),  # XCDR version 2, which has other alignments
    (
        "test_msgs/action/Fibonacci_GetResult_Response",
        "00010000 04000000 02000000",
    ),  # two numbers are missing
    (
        "test_msgs/msg/Strings",
        f"00010000 {'0100000000000000 ' * 6}18000000 {'61' * 23}00{' 0100000000000000' * 5}",
    ),  # a string<=22 has 23 characters
)
"""ROS 2 reads these bytes, although they are no messages of their types."""


def class_of(name: str) -> Any:
    """Return the class of a type, such as "std_srvs/srv/SetBool_Request"."""
    package, kind, word = name.split("/")
    classes = message_classes(find_interface(f"{package}/{kind}/{word.partition('_')[0]}"))
    return next(cls for cls in classes if type_name(cls) == name)

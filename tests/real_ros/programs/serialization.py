"""Messages to bytes and back, by real ROS 2."""

from __future__ import annotations

import sys
from importlib import import_module

from rclpy.serialization import deserialize_message, serialize_message

from tests.real_ros.programs.message_types import plain


def find_class(name):
    """Return a class by its ROS name, such as "std_srvs/srv/SetBool_Request"."""
    package, kind, word = name.split("/")
    owner = getattr(import_module(f"{package}.{kind}"), word.partition("_")[0])
    return getattr(sys.modules[owner.__module__], word)


def exchanged(name, messages):
    """Read messages that callboard has written, and write them again.

    Args:
        name: As for `find_class`.
        messages: Their bytes, as hexadecimal digits.

    Returns:
        The values of each message, and its bytes as this side writes them.
    """
    cls = find_class(name)
    found = [deserialize_message(bytes.fromhex(each), cls) for each in messages]
    return [[plain(each), serialize_message(each).hex()] for each in found]


def written(name, values):
    """Return the bytes of a message with these fields; those that are bytes are given as numbers."""
    cls = find_class(name)
    return serialize_message(cls(**{field: _given(value) for field, value in values.items()})).hex()


def _given(value):
    return bytes(value["bytes"]) if isinstance(value, dict) else value


def read(name, messages):
    """Return the values of each message, or the name of the error that reading its bytes raises."""
    return [_read(find_class(name), bytes.fromhex(each)) for each in messages]


def _read(cls, data):
    try:
        return plain(deserialize_message(data, cls))
    except Exception as error:  # noqa: BLE001 - whatever it raises
        return {"raises": type(error).__name__}

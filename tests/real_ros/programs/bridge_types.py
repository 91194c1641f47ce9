"""The types of callboard's bridge, in a process that has both rclpy and callboard: run with real ROS 2."""

from __future__ import annotations

import json
import sys
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from rclpy.serialization import serialize_message

from actors.bridges.ros2.errors import UnknownTypeError
from actors.bridges.ros2.types import MessageTypes, Types
from actors.interfaces.codec import codec_for


@cache
def _types() -> Types:
    return Types()


def known(name: str) -> dict[str, Any]:
    """Return what the bridge knows of a type."""
    found = _types().known(name)
    return {**found._asdict(), "ours": found.ours is not None, "theirs": found.theirs is not None}


def difference(name: str, endpoint_hash: str) -> str:
    """Return why an endpoint has another type."""
    return _types().known(name).difference(endpoint_hash)


def refused(kind: str, name: str) -> str:
    """Return why the bridge cannot use a type."""
    try:
        getattr(_types(), kind)(name)
    except UnknownTypeError as error:
        return str(error)
    return ""


def of_other_hashes() -> list[str]:
    """Return the types whose classes are missing or have another hash than ROS 2 says, of all that it has."""
    wrong: list[str] = []
    for kind in ("msg", "srv", "action"):
        for file in Path(sys.prefix, "share").glob(f"*/{kind}/*.json"):
            own = f"{file.parent.parent.name}/{kind}/{file.stem}"
            for each in json.loads(file.read_text(encoding="utf-8"))["type_hashes"]:
                if each["type_name"].startswith(own):
                    found = _types().known(each["type_name"])
                    is_equal = found.our_hash == found.their_hash == each["hash_string"]
                    if found.reason or not is_equal:
                        wrong.append(f"{found}")
    return wrong


def _crossed(types: MessageTypes, message: Any) -> bool:
    """Return whether a message of rclpy is the same after it was callboard's, as bytes and as an object."""
    packed = types.to_callboard(serialize_message(message))
    codec = codec_for(types.ours)
    codec.encode(codec.decode(packed))  # what was not verified is valid
    return packed == types.from_object(message) and types.to_object(packed) == message


def not_crossed() -> list[str]:
    """Return the messages of ROS 2's own test packages that are others on the way back."""
    from test_msgs import message_fixtures  # noqa: PLC0415

    wrong: list[str] = []
    makers = [name for name in dir(message_fixtures) if name.startswith("get_msg_")]
    for maker in makers:
        for message in getattr(message_fixtures, maker)():
            cls = type(message)
            name = f"{cls.__module__.partition('.')[0]}/msg/{cls.__name__}"
            if not _crossed(_types().message(name), message):
                wrong.append(repr(message))
    return wrong if makers else ["no messages"]


def service_objects() -> list[str]:
    """Return requests and responses of a service and of a part of an action after both ways."""
    found: list[str] = []
    for name in ("std_srvs/srv/SetBool", "test_msgs/action/Fibonacci_GetResult"):
        types = _types().service(name)
        for part in (types.request, types.response):
            there = part.to_object(part.from_object(part.theirs()))
            found += [f"{name} {type(there).__name__}"]
    return found


def large_image() -> bool:
    """Return whether a large image has the same data on the other side."""
    image = import_module("sensor_msgs.msg").Image(data=bytes(range(256)) * 4096)
    types = _types().message("sensor_msgs/msg/Image")
    return _crossed(types, image)

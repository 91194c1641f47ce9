"""What the generated classes of interfaces say of themselves."""

from __future__ import annotations

import json
import sys
from importlib import import_module
from pathlib import Path

SHARE = Path(sys.prefix, "share")
PARTS = {"msg": ("",), "srv": ("Request", "Response"), "action": ("Goal", "Result", "Feedback")}


def names():
    """Return the names of all interfaces that real ROS 2 has here."""
    return sorted(f"{file.parent.parent.name}/{file.parent.name}/{file.stem}" for file in _files())


def _files():
    return [file for kind in PARTS for file in SHARE.glob(f"*/{kind}/*.json")]


def hashes(name):
    """Return the hashes of an interface and of all types in it, by name."""
    found = json.loads((SHARE / f"{name}.json").read_text())["type_hashes"]
    return {each["type_name"]: each["hash_string"] for each in found}


def type_description(name):
    """Return the TypeDescription message of an interface."""
    return json.loads((SHARE / f"{name}.json").read_text())["type_description_msg"]


def described(name):
    """Return the fields, defaults and constants of each message class of an interface.

    Args:
        name: Such as "std_msgs/msg/String".
    """
    package, kind, word = name.split("/")
    owner = getattr(import_module(f"{package}.{kind}"), word)
    return {part: _described(getattr(owner, part) if part else owner) for part in PARTS[kind]}


def _described(cls):
    # `X__DEFAULT`, which the classes have for some fields, is not for programs.
    constants = [name for name in dir(cls) if name.isupper() and "__" not in name and name != "SLOT_TYPES"]
    return {
        "fields": [*cls.get_fields_and_field_types().items()],
        "defaults": plain(cls()),
        "constants": {name: plain(getattr(cls, name)) for name in constants},
    }


def plain(value):
    """Return the value of a field as JSON has it.

    A byte is its number, and a sequence the list of its elements: callboard has bytes where the classes of
    ROS 2 have an array of bytes, or a list of them.
    """
    if hasattr(value, "get_fields_and_field_types"):
        return {name: plain(getattr(value, name)) for name in value.get_fields_and_field_types()}
    if isinstance(value, bytes) and len(value) == 1:
        return value[0]
    if hasattr(value, "__iter__") and not isinstance(value, str):
        return [plain(each) for each in value]
    return value.item() if hasattr(value, "item") else value

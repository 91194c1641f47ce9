"""The bundled types and test_msgs are those of real ROS 2: fields, defaults, constants, hashes."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

from actors.interfaces.message import Message, definition, type_hash, type_name
from actors.interfaces.registry import find_interface
from tests.interfaces.imported import TYPES
from tests.real_ros.differences import agree

if TYPE_CHECKING:
    from tests.real_ros.sides import Side

ONLY_HERE = {
    "action_tutorials_interfaces",
    "callboard_interfaces",
    "composition_interfaces",
    "example_interfaces",
    "rosbag2_interfaces",
    "statistics_msgs",
    "tf2_msgs",
}
"""Packages that PyPI does not have."""


def common(package: str, real: Side) -> list[str]:
    """Return the interfaces of a package that both have: some are of a later ROS 2 than Kilted."""
    theirs = {name for name in real.call("message_types.names") if name.startswith(f"{package}/")}
    ours = set(TYPES[package])
    assert theirs <= ours
    return sorted(theirs)


def parts(name: str) -> list[type[Any]]:
    """Return the classes of an interface: its own, and those of its request, goal and so on."""
    cls = find_interface(name)
    inner = [each for each in vars(cls).values() if isinstance(each, type) and issubclass(each, Message)]
    return [cls, *inner]


def without_defaults(description: Any) -> Any:
    """Return a TypeDescription as the hash has it: without defaults."""
    for each in (description["type_description"], *description["referenced_type_descriptions"]):
        for field in each["fields"]:
            del field["default_value"]
    return description


@pytest.mark.parametrize("package", sorted(TYPES.keys() - ONLY_HERE))
def test_types_of_a_package_are_those_of_ros(package: str, real: Side, face: Side) -> None:
    """Each has the same fields, types, bounds, defaults and constants."""
    names = common(package, real)
    assert names
    for name in names:
        truth, answer = (side.call("message_types.described", name) for side in (real, face))
        agree("type", name, real=truth, callboard=answer)


@pytest.mark.parametrize("package", sorted(TYPES.keys() - ONLY_HERE))
def test_hashes_of_a_package_are_those_of_ros(package: str, real: Side) -> None:
    """Each type, request, goal and so on has the same description and the same hash."""
    for name in common(package, real):
        truth = real.call("message_types.hashes", name)
        hashes = {type_name(cls): type_hash(cls) for cls in parts(name)}
        agree("hash", name, real={each: truth[each] for each in hashes}, callboard=hashes)
        description = without_defaults(real.call("message_types.type_description", name))
        agree("description", name, real=description, callboard=json.loads(definition(find_interface(name))))

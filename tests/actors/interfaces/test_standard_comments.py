"""The comments of the standard types that people use most."""

from __future__ import annotations

import importlib
import inspect
import re
import sys
from importlib.util import find_spec
from types import CodeType
from typing import TYPE_CHECKING, Any, Final

import pytest

from actors.interfaces.comments import comments_of

if TYPE_CHECKING:
    from collections.abc import Iterator

PACKAGES: Final = (
    *(
        "builtin_interfaces",
        "diagnostic_msgs",
        "geometry_msgs",
        "nav_msgs",
        "sensor_msgs",
        "std_msgs",
        "tf2_msgs",
    ),
)
MOST: Final = 100
"""Characters of a comment: one line of a terminal."""


def types_of(package: str) -> Iterator[Any]:
    """Return the classes of a package's messages, services and actions."""
    for kind in ("msg", "srv", "action"):
        name = f"actors.interfaces.{package}.{kind}"
        if find_spec(name) is not None:
            module = importlib.import_module(name)
            yield from (getattr(module, each) for each in module.__all__)


def parts_of(cls: Any) -> Iterator[Any]:
    """Return a message's class, or those of the parts of a service or an action."""
    parts = ("Request", "Response", "Goal", "Result", "Feedback")
    found = [getattr(cls, part) for part in parts if hasattr(cls, part)]
    yield from found or [cls]


def names_of(cls: Any) -> list[str]:
    """Return the fields and constants of a message class."""
    return [name for name in cls.__annotations__ if not name.startswith("_")]


@pytest.mark.parametrize("package", PACKAGES)
def test_every_type_and_field_has_a_comment(package: str) -> None:
    """A short one that says more than the name."""
    for cls in types_of(package):
        texts = {cls.__name__: comments_of(cls).own}
        for part in parts_of(cls):
            found = comments_of(part).fields
            assert sorted(found) == sorted(names_of(part)), part
            texts |= {f"{part.__qualname__}.{name}": text for name, text in found.items()}
        for name, text in texts.items():
            assert 0 < len(text) <= MOST, (name, text)
            assert text.isascii(), (name, text)
            assert text.endswith("."), (name, text)
            assert re.sub(r"\W|_", "", text).lower() != re.sub(r"\W|_", "", name.split(".")[-1]).lower()


@pytest.mark.parametrize(
    ("module", "field", "unit"),
    [
        ("sensor_msgs.msg.LaserScan", "angle_min", "radians"),
        ("sensor_msgs.msg.LaserScan", "ranges", "metres"),
        ("sensor_msgs.msg.Imu", "angular_velocity", "rad/s"),
        ("sensor_msgs.msg.MagneticField", "magnetic_field", "teslas"),
        ("sensor_msgs.msg.FluidPressure", "fluid_pressure", "pascals"),
        ("sensor_msgs.msg.NavSatFix", "latitude", "Degrees"),
        ("sensor_msgs.msg.RelativeHumidity", "relative_humidity", "from 0"),
        ("geometry_msgs.msg.Twist", "linear", "m/s"),
        ("geometry_msgs.msg.Wrench", "torque", "newton metres"),
        ("geometry_msgs.msg.PoseWithCovariance", "covariance", "row-major"),
        ("nav_msgs.msg.OccupancyGrid", "data", "-1 is unknown"),
        ("nav_msgs.msg.Odometry", "twist", "child_frame_id"),
    ],
)
def test_units_and_frames_are_told(module: str, field: str, unit: str) -> None:
    """As REP 103 and the definitions have them."""
    path, _, name = module.rpartition(".")
    cls = getattr(importlib.import_module(f"actors.interfaces.{path}"), name)
    assert unit in comments_of(cls).fields[field]


def strings_in(code: CodeType) -> Iterator[str]:
    """Return the strings that compiled code keeps, also in its classes."""
    for each in code.co_consts:
        if isinstance(each, CodeType):
            yield from strings_in(each)
        elif isinstance(each, str):
            yield each


def test_comments_of_fields_cost_nothing_at_import() -> None:
    """The compiler drops them, so that no module of types becomes larger or slower by them."""
    for cls in types_of("sensor_msgs"):
        source = inspect.getsource(sys.modules[cls.__module__])
        kept = set(strings_in(compile(source, cls.__module__, "exec")))
        for part in parts_of(cls):
            assert not kept & {*comments_of(part).fields.values()}

"""Names that rclpy's modules have because they import them themselves."""

from __future__ import annotations

import ast
import importlib
from typing import TYPE_CHECKING

import pytest

from actors.ros import rclpy
from actors.ros.rclpy import imported_names
from tests.actors.ros.test_rclpy_names import modules

if TYPE_CHECKING:
    from collections.abc import Iterator


def uses() -> Iterator[tuple[str, str]]:
    """Yield the modules that have such names, and each of the names."""
    for module, path in modules():
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and ast.unparse(node.func) == "imported_names":
                for name in ast.literal_eval(node.args[1]).split():
                    yield module, name


def test_each_name_is_what_its_home_has() -> None:
    """Every entry can be imported, is not shadowed, and nothing of the table is unused."""
    found = list(uses())
    assert ("rclpy.node", "Parameter") in found
    for module, name in found:
        loaded = importlib.import_module(f"actors.ros.{module}")
        assert getattr(loaded, name) is not None
    assert {name for _, name in found} == set(" ".join(imported_names.NAMES_BY_HOME.values()).split())


def test_other_names_are_an_error() -> None:
    """A typo gets Python's usual answer."""
    with pytest.raises(AttributeError, match="has no attribute 'Paramter'"):
        rclpy.node.Paramter  # noqa: B018


def test_a_star_gives_every_public_name() -> None:
    """`from rclpy.qos import *` gives what ROS 2's gives: no module limits it."""
    for module in ("qos", "duration", "parameter", "exceptions", "event_handler", "logging"):
        loaded = importlib.import_module(f"actors.ros.rclpy.{module}")
        assert not hasattr(loaded, "__all__"), module
    names: dict[str, object] = {}
    exec("from actors.ros.rclpy.qos import *", names)
    assert {"QoSProfile", "ReliabilityPolicy", "QoSHistoryPolicy", "qos_profile_sensor_data"} <= names.keys()

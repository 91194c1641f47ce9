"""Imports `test_msgs`, ROS 2's package of types for tests, from its files beside this module.

Programs under rclpy's names import it in the same way if this folder is on their path.
"""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path
from typing import Any, Final
from unittest import mock

from actors.interfaces.catalog import interfaces_of, standard_packages
from actors.ros.finder import RosFinder

FOLDER: Final = Path(__file__).parent


def _import_all(package: str) -> dict[str, Any]:
    """Return the classes of a package by the names of their types.

    All are imported at once, because the path and the finder are not left behind for other tests.
    """
    with (
        mock.patch.object(sys, "path", [*sys.path, str(FOLDER)]),
        mock.patch.object(sys, "meta_path", [RosFinder(), *sys.meta_path]),
    ):
        modules = {kind: import_module(f"{package}.{kind}") for kind in ("msg", "srv", "action")}
        return {
            f"{package}/{kind}/{name}": getattr(module, name)
            for kind, module in modules.items()
            for name in module.__all__
        }


_CLASSES: Final = _import_all("test_msgs")
_STANDARD: Final = {package: interfaces_of(package) for package in standard_packages()}
TYPES: Final = {**_STANDARD, "test_msgs": list(_CLASSES)}
"""The standard packages and `test_msgs`, with the names of their types. `find_interface` finds these."""


def __getattr__(name: str) -> Any:  # type checkers do not see the classes, so they are Any for them
    """Return a message of `test_msgs`."""
    try:
        return _CLASSES[f"test_msgs/msg/{name}"]
    except KeyError:
        raise AttributeError(name) from None

"""Finds interface packages of .msg, .srv, .action and .idl files where ROS 2 has them.

src/robot_interfaces/msg/Wheel.msg       with src on the import path, or
install/share/robot_interfaces/msg/Wheel.msg    with install in AMENT_PREFIX_PATH
"""

from __future__ import annotations

from importlib.machinery import ModuleSpec
from pathlib import Path
from typing import TYPE_CHECKING

from actors.config.environment import ament_prefixes
from actors.interfaces import file_packages
from actors.interfaces.interface_names import KINDS

if TYPE_CHECKING:
    from collections.abc import Sequence


def find_in_folders(fullname: str, path: Sequence[str] | None) -> ModuleSpec | None:
    """Return the spec of a module that is made of interface files; None for other modules.

    Args:
        fullname: "robot_interfaces.msg" or "robot_interfaces.msg._wheel"; also "robot_interfaces" itself, if
            only AMENT_PREFIX_PATH has it.
        path: The folders of the module above; None for a top-level name.
    """
    if "." in fullname:
        return file_packages.find_in_folders(fullname, path)
    shares = [Path(prefix) / "share" / fullname for prefix in ament_prefixes()]
    folders = [str(each) for each in shares if any(file_packages.has_files(each, kind) for kind in KINDS)]
    if not folders:
        return None
    spec = ModuleSpec(fullname, None, is_package=True)  # a namespace: nothing is to be executed
    spec.submodule_search_locations = folders
    return spec

"""callboard's classes for ROS 2's packages, in a process that has ROS 2's own: run with real ROS 2."""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actors.interfaces.action import action_types
from actors.interfaces.catalog import interfaces_of, known_packages
from actors.interfaces.message import is_message_type, type_hash, type_name
from actors.interfaces.registry import find_interface
from actors.tools.prefixes import use_ros_interfaces

if TYPE_CHECKING:
    from types import ModuleType


def hashes() -> dict[str, str]:
    """Return the hash of each type that ROS 2 has, and of what it is made of, as callboard's class has it.

    ROS 2's own modules are imported before, and must not be changed or used.
    """
    share = Path(sys.prefix, "share")
    folders = [each for kind in ("msg", "srv", "action") for each in share.glob(f"*/{kind}")]
    own: dict[str, ModuleType] = {
        f"{each.parent.name}.{each.name}": import_module(f"{each.parent.name}.{each.name}")
        for each in folders
    }
    use_ros_interfaces()
    found: dict[str, str] = {}
    for name in [name for package in known_packages() for name in interfaces_of(package)]:
        cls: Any = find_interface(name)
        parts: list[Any] = [cls]
        if name.split("/")[1] == "srv":
            parts += [cls.Request, cls.Response, cls.Event]
        elif name.split("/")[1] == "action":
            made = action_types(cls)
            services: list[Any] = [made.send_goal, made.get_result]
            parts += [cls.Goal, cls.Result, cls.Feedback, made.feedback_message]
            parts += [part for each in services for part in (each, each.Request, each.Response, each.Event)]
        found |= {type_name(part): type_hash(part) for part in parts}
    for name, module in own.items():
        assert sys.modules[name] is module
        assert not any(map(is_message_type, vars(module).values()))
    return found

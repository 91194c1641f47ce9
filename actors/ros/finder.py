"""Finds ROS 2's Python packages in callboard: `rclpy`, and interface packages such as `std_msgs`.

A module has two names then, such as `std_msgs.msg` and `actors.interfaces.std_msgs.msg`, and is the same
object under both: no class exists twice.
"""

from __future__ import annotations

import importlib
import pkgutil
import sys
from importlib.abc import Loader
from importlib.machinery import ModuleSpec, PathFinder
from importlib.util import find_spec
from typing import TYPE_CHECKING, Final

from actors.config.environment import checks_fields
from actors.interfaces.file_packages import FileFinder
from actors.ros.interface_packages import find_in_folders

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from types import ModuleType

LIBRARIES: Final = {
    "ament_index_python": "actors.ros.ament_index_python",
    "launch": "actors.ros.launch",
    "launch_ros": "actors.ros.launch_ros",
    "launch_xml": "actors.ros.launch_xml",
    "launch_yaml": "actors.ros.launch_yaml",
    "rclpy": "actors.ros.rclpy",
    "rosidl_parser": "actors.ros.rosidl_parser",
    "rosidl_runtime_py": "actors.ros.rosidl_runtime_py",
    "rpyutils": "actors.ros.rpyutils",
    "sensor_msgs_py": "actors.ros.sensor_msgs_py",
}
"""Top-level names of ROS 2's libraries, and callboard's packages for them."""
UNSUPPORTED: Final = {
    "launch_pytest": "actors.testing.launch runs a launch in a test",
    "launch_testing": "actors.testing.launch runs a launch in a test",
    "launch_testing_ros": "actors.testing.launch runs a launch in a test",
    "tf2_ros": "publish and read tf2_msgs.msg.TFMessage on /tf and /tf_static",
}
"""Top-level names of libraries that callboard does not have, and what to do instead."""
INTERFACES: Final = "actors.interfaces"


class RealPackageError(ImportError):
    """ROS 2's own rclpy is installed, and it would be hidden."""


def module_names() -> dict[str, str]:
    """Return the top-level names that callboard has, with the names of its packages for them."""
    interfaces = importlib.import_module(INTERFACES)
    # Only those with an underscore, as interface packages have: a program may have a module named `cdr`.
    packages = {
        each.name for each in pkgutil.iter_modules(interfaces.__path__) if each.ispkg and "_" in each.name
    }
    return {**{name: f"{INTERFACES}.{name}" for name in packages}, **LIBRARIES}


class AliasLoader(Loader):
    """Loads a module by its name in callboard.

    Args:
        target: That name.
        before: What to call before it is imported.
    """

    def __init__(self, target: str, before: Callable[[], None] | None = None) -> None:
        self._target = target
        self._before = before
        self._spec: ModuleSpec | None = None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """Return the module itself."""
        del spec
        if self._before is not None:
            self._before()
        module = importlib.import_module(self._target)
        self._spec = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        """Give the module back its own spec, which importlib has replaced. It has been executed already."""
        module.__spec__ = self._spec


class RosFinder(FileFinder):
    """Finds ROS 2's names in callboard, unless a regular package of that name is installed.

    Args:
        force: Find them even then.
        adopts: Whether to give message classes what ROS 2's have, once the program imports rclpy or an
            interface package.

    Attributes:
        force: As given.
    """

    def __init__(self, *, force: bool = False, adopts: bool = False) -> None:
        self.force = force
        self._adopts = adopts
        self._targets: dict[str, str | None] = {}
        """Top-level names, and callboard's packages for them; None if they are found elsewhere."""
        self._found: dict[str, ModuleSpec] = {}
        """The specs of modules under callboard's names, for the loaders that import them next."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return the spec of an alias, or of a package of interface files.

        Returns:
            None if the name is neither, or is installed.

        Raises:
            ModuleNotFoundError: callboard does not have this library of ROS 2; the text says what to do.
        """
        del target
        if fullname in self._found:
            return self._found.pop(fullname)
        top, dot, rest = fullname.partition(".")
        if top in UNSUPPORTED and not is_installed(top):
            raise ModuleNotFoundError(f"callboard has no {top}: {UNSUPPORTED[top]}", name=top)
        target_package = self._targets[top] if self.is_ours(top) else None
        if target_package is None:
            spec = find_in_folders(fullname, path)
            return None if spec is not None and path is None and is_installed(top) else spec
        name = target_package + dot + rest
        spec = PathFinder.find_spec(name, path or importlib.import_module(name.rpartition(".")[0]).__path__)
        if spec is None and _is_module_of_class(name):
            name = name.rpartition(".")[0]
            spec = find_spec(name)
        if spec is None:
            return None
        if name not in sys.modules:
            self._found[name] = spec
        before = self._adopt if self._adopts and (top == "rclpy" or top not in LIBRARIES) else None
        is_package = spec.submodule_search_locations is not None
        return ModuleSpec(fullname, AliasLoader(name, before), is_package=is_package)

    def _adopt(self) -> None:
        from actors.ros.message_classes import adopt_all  # noqa: PLC0415 - launch files need no messages

        adopt_all(self.is_ours)
        self._adopts = False

    def is_ours(self, top: str) -> bool:
        """Return whether a top-level name is found in callboard."""
        if top not in self._targets:
            self._targets[top] = self._target(top)
        return self._targets[top] is not None

    def _target(self, top: str) -> str | None:
        target = _cached_module_names().get(top)
        return None if target is None or (not self.force and is_installed(top)) else target


def _is_module_of_class(name: str) -> bool:
    """Return whether ROS 2 has a module of this name for a class that callboard has in the package itself.

    For example `launch.actions.execute_process`, since the package `launch.actions` has `ExecuteProcess`.
    """
    package, _, module = name.rpartition(".")
    word = module.replace("_", "")
    classes = {each.lower() for each in dir(sys.modules.get(package)) if not each.islower()}
    return not classes.isdisjoint((word, word.removesuffix("action")))


def _cached_module_names() -> dict[str, str]:
    global _cached_names  # noqa: PLW0603 - read from the disk once, at the first import after `install`
    if _cached_names is None:
        _cached_names = {}  # `module_names` imports modules, for which this is called again
        _cached_names = module_names()
        if checks_fields():
            from actors.interfaces.checking import check_assignments  # noqa: PLC0415 - seldom needed

            check_assignments()
    return _cached_names


_cached_names: dict[str, str] | None = None


def is_installed(top: str) -> bool:
    """Return whether a package or module of a name is on `sys.path`.

    A folder without `__init__.py` does not count.
    """
    spec = PathFinder.find_spec(top)
    return spec is not None and spec.origin is not None


def install(*, force: bool = False) -> None:
    """Let this process find ROS 2's names in callboard. A second call does nothing.

    Args:
        force: Even those of packages that are installed.

    Raises:
        RealPackageError: rclpy is installed, and `force` is not set.
    """
    if any(isinstance(each, RosFinder) for each in sys.meta_path):
        return
    if not force and is_installed("rclpy"):
        raise RealPackageError(
            "ROS 2's own rclpy is installed here. Run the program without --ros to use that, or with --force"
            " to use callboard's."
        )
    sys.meta_path.insert(0, RosFinder(force=force, adopts=True))


def is_forced() -> bool:
    """Return whether this process finds even the names of installed packages in callboard."""
    return any(isinstance(each, RosFinder) and each.force for each in sys.meta_path)

"""Makes the classes of interface packages that ROS 2 has installed, from their files.

    /opt/ros/kilted/share/robot_interfaces/msg/Wheel.msg        with /opt/ros/kilted/share in `share_folders`

The Python package of the same name may be ROS 2's own, whose classes are no messages of callboard. So each
type has a module with another name, such as `actors.interfaces.share.robot_interfaces.msg._Wheel`. If the
class is made elsewhere (by callboard, the program, or the import path), that module only names it.
"""

from __future__ import annotations

import sys
from functools import cache
from importlib.machinery import ModuleSpec
from typing import TYPE_CHECKING, Final, cast

from actors.interfaces.catalog import SHARE_ROOT, share_folders, shared_file, shared_module
from actors.interfaces.errors import InterfaceSyntaxError
from actors.interfaces.parser import parse_file
from actors.interfaces.registry import defined_interface, installed_interface
from actors.interfaces.source import render_module

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from importlib.abc import Loader
    from pathlib import Path
    from types import ModuleType

    from actors.interfaces.specs import InterfaceSpec

MAX_NESTED: Final = 64
"""Levels of nested messages, as in a package that is generated: importing them is recursive."""


class TypeLoader:
    """Loads the module of one type.

    Args:
        type_name: The type's full name.
    """

    def __init__(self, type_name: str) -> None:
        self._type_name = type_name

    def get_source(self, fullname: str) -> str:
        """Return the module's text, which `interface generate` would write.

        Args:
            fullname: The module's name.

        Raises:
            ImportError: No share folder has the type, or its file cannot be read.
            InterfaceSyntaxError: A file of the type, or of one that it contains, breaks a rule, or a type
                that it contains is not installed.
        """
        spec = _spec(self._type_name)
        if spec is None:
            raise ImportError(f"There is no {self._type_name} in {_places()}", name=fullname)
        _check(spec, [], {})
        return render_module(spec, lambda name: shared_module(*name.split("/")), spec.package)

    def create_module(self, spec: ModuleSpec) -> None:
        """Leave it to Python to make the module."""

    def exec_module(self, module: ModuleType) -> None:
        """Make the class, or name the one that there is.

        Raises:
            ImportError, InterfaceSyntaxError: As for `get_source`.
        """
        found = _made(self._type_name)
        if found is not None:
            vars(module)[self._type_name.rpartition("/")[2]] = found
            return
        name = module.__name__
        exec(compile(self.get_source(name), f"<{name}>", "exec", dont_inherit=True), vars(module))  # noqa: S102


class ShareFinder:
    """Finds the modules below `SHARE_ROOT`."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return the spec of the module of a type, or of a package of such modules; None for others.

        Args:
            fullname: The module's name.
            path: Not used; `importlib` passes it.
            target: Not used; `importlib` passes it.
        """
        del path, target
        root, *rest = fullname.removeprefix(SHARE_ROOT).split(".")
        if root or not fullname.startswith(SHARE_ROOT) or len(rest) > 3:
            return None
        if len(rest) < 3:
            return ModuleSpec(fullname, None, is_package=True)  # a namespace: nothing is to be executed
        package, kind, module = rest
        return ModuleSpec(fullname, cast("Loader", TypeLoader(f"{package}/{kind}/{module[1:]}")))


def add_share_folders(folders: Iterable[Path]) -> None:
    """Let `find_interface`, `known_packages` and the like find packages in folders, too.

    Types that callboard brings, or that packages on the import path have, remain as they are.

    Args:
        folders: `share` of ROS 2's prefixes; the first that has a type counts.
    """
    share_folders.extend(each for each in dict.fromkeys(folders) if each not in share_folders)
    if not any(isinstance(each, ShareFinder) for each in sys.meta_path):
        sys.meta_path.append(ShareFinder())


def _made(type_name: str) -> type | None:
    """Return the class of a type that the share folders need not make; None if there is none."""
    if shared_file(*type_name.split("/")) is None:
        return installed_interface(type_name)
    return defined_interface(type_name)


def _spec(type_name: str) -> InterfaceSpec | None:
    file = shared_file(*type_name.split("/"))
    return None if file is None else _parsed(file, type_name.partition("/")[0])


@cache
def _parsed(file: Path, package: str) -> InterfaceSpec:
    return parse_file(file, package)


def _check(spec: InterfaceSpec, outer: list[str], checked: dict[str, int]) -> None:
    """Raise InterfaceSyntaxError if a type contains itself, is nested too deeply, or needs what is missing.

    Args:
        spec: The type.
        outer: The types that contain it, outermost first.
        checked: The deepest level at which each type has been checked. A type can be contained in many ways,
            whose number grows exponentially with the levels.
    """
    path = [*outer, spec.type_name]
    for name in sorted(spec.dependencies):
        if name in path:
            raise _error(spec, f"Messages contain one another: {' -> '.join([*path, name])}")
        if len(path) >= MAX_NESTED:
            raise _error(spec, f"{path[0]} is nested more than {MAX_NESTED} levels deep")
        if checked.get(name, 0) >= len(path):
            continue
        checked[name] = len(path)
        if _made(name) is not None:
            continue
        inner = _spec(name)
        if inner is None:
            package = name.partition("/")[0]
            missing = f"{spec.type_name} contains {name}, and no such type is installed"
            if package == spec.package:
                raise _error(spec, f"{missing}: the package is not complete")
            raise _error(
                spec, f"{missing}: install the package {package}, or add its prefix to AMENT_PREFIX_PATH"
            )
        _check(inner, path, checked)


def _error(spec: InterfaceSpec, reason: str) -> InterfaceSyntaxError:
    return InterfaceSyntaxError(str(shared_file(*spec.type_name.split("/"))), 0, reason)


def _places() -> str:
    return ", ".join(map(str, share_folders)) or "any folder"

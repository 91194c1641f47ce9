"""Imports interface packages from their .msg, .srv, .action and .idl files, without a build.

    src/robot_interfaces/msg/Wheel.msg       with src on the import path

With a `FileFinder` in `sys.meta_path`, `from robot_interfaces.msg import Wheel` executes what
`callboard interface generate` would write.
"""

from __future__ import annotations

import sys
from functools import cache
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path
from typing import TYPE_CHECKING, cast

from actors.interfaces.catalog import SHARE_ROOT, file_in, share_folders
from actors.interfaces.interface_names import KINDS

if TYPE_CHECKING:
    from collections.abc import Sequence
    from importlib.abc import Loader
    from types import ModuleType


class InterfaceLoader:
    """Executes the generated module of a package.

    Neither it nor the finder has a base class: `importlib.abc` takes 10 ms, and most commands need these.

    Args:
        folder: The package's folder.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def get_source(self, fullname: str) -> str:
        """Return the module's text.

        Args:
            fullname: "robot_interfaces.msg" or "robot_interfaces.msg._wheel".

        Raises:
            ImportError: There is no such interface.
            InterfaceSyntaxError: A file of the package breaks a rule; the text names it.
        """
        text = _text(self._folder, fullname)
        if text is None:
            raise ImportError(f"{self._folder} has no {fullname}", name=fullname)
        return text

    def create_module(self, spec: ModuleSpec) -> None:
        """Leave it to Python to make the module."""

    def exec_module(self, module: ModuleType) -> None:
        """Execute the module's text, or name the class if `share_packages` has made it already.

        Raises:
            ImportError, InterfaceSyntaxError: As for `get_source`; or it was made of another text.
        """
        name = module.__name__
        made = _made_of_share(self._folder, name)
        if made is not None:
            for each in (made, *vars(made).values()):  # with the parts of a service or an action
                if isinstance(each, type) and each.__module__.startswith(SHARE_ROOT):
                    each.__module__ = name  # as if it had been made here
            vars(module)[made.__name__] = made
            return
        exec(compile(self.get_source(name), f"<{name}>", "exec", dont_inherit=True), vars(module))  # noqa: S102

    def is_package(self, fullname: str) -> bool:
        """Return whether the module has others in it: `robot_interfaces.msg`."""
        return fullname.count(".") == 1


class FileFinder:
    """Finds interface packages without generated modules on the import path."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return the spec of a module that is made of interface files; None for other modules.

        Args:
            fullname: As for `find_in_folders`.
            path: As for `find_in_folders`.
            target: Not used; `importlib` passes it.
        """
        del target
        return find_in_folders(fullname, path)


def has_finder() -> bool:
    """Return whether this process can import interface packages from their files."""
    return any(isinstance(each, FileFinder) for each in sys.meta_path)


def install_finder() -> None:
    """Let this process import interface packages from their files."""
    if not has_finder():
        # The first, or Python would find the folder `msg` as a package without modules.
        sys.meta_path.insert(0, FileFinder())


def find_in_folders(fullname: str, path: Sequence[str] | None) -> ModuleSpec | None:
    """Return the spec of a module that is made of interface files; None for other modules.

    Args:
        fullname: "robot_interfaces.msg" or "robot_interfaces.msg._wheel".
        path: The folders of the module above; None for a top-level name.
    """
    package, *rest = fullname.split(".")
    if not rest or rest[0] not in KINDS:
        return None
    # The parent of "robot_interfaces.msg._wheel" has its own folder there.
    folders = [Path(each).parent if len(rest) > 1 else Path(each) for each in path or ()]
    folder = next((each for each in folders if each.name == package and has_files(each, rest[0])), None)
    if folder is None and len(rest) == 1:
        folder = _hidden_folder(package, rest[0], path)
    if folder is None or _text(folder, fullname) is None:
        return None
    loader = cast("Loader", InterfaceLoader(folder))
    spec = ModuleSpec(fullname, loader, is_package=len(rest) == 1)
    if spec.submodule_search_locations is not None:
        spec.submodule_search_locations.append(str(folder / rest[0]))
    return spec


def _hidden_folder(package: str, kind: str, path: Sequence[str] | None) -> Path | None:
    """Return the folder of an interface package that a module of its name hides, such as Python's `test`.

    Without one, or where that module has a `msg` of its own, return None.
    """
    if PathFinder.find_spec(f"{package}.{kind}", path) is not None:
        return None
    folders = (Path(entry or ".").absolute() / package for entry in sys.path)
    return next((each for each in folders if has_files(each, kind)), None)


def has_files(folder: Path, kind: str) -> bool:
    """Return whether a package's folder has interface files of a kind, and no modules generated from them."""
    if (folder / kind / "__init__.py").exists():
        return False
    return any(next((folder / kind).glob(f"*.{suffix}"), None) for suffix in (kind, "idl"))


def _made_of_share(folder: Path, module: str) -> type | None:
    """Return the class of a module of a type that `share_packages` has made before this was imported."""
    from actors.interfaces.source import module_name  # noqa: PLC0415 - seldom needed

    package, kind, *rest = module.split(".")
    root = f"{SHARE_ROOT}.{package}.{kind}._"
    names = (each.removeprefix(root) for each in tuple(sys.modules) if each.startswith(root))
    name = next((each for each in names if [module_name(each)] == rest), None)
    if name is None:
        return None
    shared = file_in([each / package for each in share_folders], kind, name)
    own = file_in([folder], kind, name)
    if shared is None or own is None or shared.read_bytes() != own.read_bytes():
        raise ImportError(
            f"{package}/{kind}/{name} is in use as {shared} defines it, and {own} differs: import it first,"
            " or remove one of the files",
            name=module,
        )
    return cast("type", vars(sys.modules[root + name])[name])


def _text(folder: Path, fullname: str) -> str | None:
    package, _, name = fullname.partition(".")
    files = _rendered(folder, package)
    path = name.replace(".", "/")
    return files.get(f"{path}/__init__.py", files.get(f"{path}.py"))


@cache
def _rendered(folder: Path, package: str) -> dict[str, str]:
    from actors.interfaces.generator import read_package, render_package  # noqa: PLC0415 - seldom needed

    return render_package(read_package(folder), package, shared=True)

"""Lists interface packages and types without importing a class.

An interface package is one of callboard's, a Python package written by `interface generate`, or a folder on
the import path, or in one of `share_folders`, with msg/*.msg, srv/*.srv or action/*.action, or *.idl in these
folders.
"""

from __future__ import annotations

import ast
import difflib
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Final

from actors.interfaces.errors import UnknownInterfaceError
from actors.interfaces.interface_names import KINDS, PACKAGE_NAME, TYPE_NAME
from actors.regular_files import read_regular

STANDARD_ROOT: Final = "actors.interfaces"
"""The Python package of the standard interface packages."""
SHARE_ROOT: Final = f"{STANDARD_ROOT}.share"
"""The Python package of those that `share_packages` makes."""
share_folders: Final[list[Path]] = []
"""`share` of ROS 2's prefixes, where installed packages have the texts of their interfaces."""
_STANDARD: Final = Path(__file__).parent
_GENERATED: Final = "from actors.interfaces.lazy import lazy_exports"
"""A line in every package written by `interface generate`."""


def standard_packages() -> list[str]:
    """Return the names of the interface packages that callboard ships, sorted."""
    # By their modules: a package that was removed from a checkout may have left folders of bytecode.
    found = (path for kind in KINDS for path in _STANDARD.glob(f"*/{kind}/__init__.py"))
    return sorted({path.parent.parent.name for path in found})


def is_standard(package: str) -> bool:
    """Return whether callboard ships an interface package.

    Args:
        package: Any name.
    """
    if not PACKAGE_NAME.fullmatch(package):
        return False
    return any((_STANDARD / package / kind / "__init__.py").is_file() for kind in KINDS)


def known_packages() -> list[str]:
    """Return the names of all interface packages: the standard ones, installed ones and files, sorted."""
    found = set(standard_packages())
    for entry in [*sys.path, *map(str, share_folders)]:
        try:
            folders = [each for each in Path(entry or ".").iterdir() if PACKAGE_NAME.fullmatch(each.name)]
        except OSError:  # a zip file or a missing folder
            continue
        found.update(folder.name for folder in folders if any(_has(folder / kind, kind) for kind in KINDS))
    # Without generated packages that another module of the name hides: they cannot be imported.
    return sorted(name for name in found if any(_names(name, kind) for kind in KINDS))


def python_package(package: str, kind: str) -> str | None:
    """Return the name of the Python package with the interfaces of a kind, or None."""
    # The standard packages first, so that a folder of the same name on the import path cannot replace them.
    if (_STANDARD / package / kind / "__init__.py").is_file():
        return f"{STANDARD_ROOT}.{package}.{kind}"
    if any((folder / kind / "__init__.py").is_file() for folder in _folders(package)):
        return f"{package}.{kind}"
    return None


def source_file(package: str, kind: str, name: str) -> Path | None:
    """Return the file with the text of an interface, or None."""
    if not _are_names(package, kind, name):
        return None
    if is_standard(package):
        return shared_file(package, kind, name)
    return file_in(_text_folders(package), kind, name) or shared_file(package, kind, name)


def shared_file(package: str, kind: str, name: str) -> Path | None:
    """Return the file of an interface in `share_folders`; None if callboard or the import path have it."""
    if not share_folders or not _are_names(package, kind, name):
        return None
    file = file_in([folder / package for folder in share_folders], kind, name)
    if file is None or file_in(_text_folders(package), kind, name) is not None:
        return None
    # ROS 2's own Python packages have no `__all__`.
    modules = (folder / kind / "__init__.py" for folder in (_STANDARD / package, *_folders(package)))
    return None if any(name in _exported(module) for module in modules) else file


def shared_module(package: str, kind: str, name: str) -> str:
    """Return the name of the module that `share_packages` makes for an interface."""
    return f"{SHARE_ROOT}.{package}.{kind}._{name}"


def _are_names(package: str, kind: str, name: str) -> bool:
    return bool(PACKAGE_NAME.fullmatch(package) and kind in KINDS and TYPE_NAME.fullmatch(name))


def file_in(folders: list[Path], kind: str, name: str) -> Path | None:
    """Return the file of an interface in the first of these folders of a package that has it, or None."""
    # The folder first: most names in a graph without a class have no files, and a search for these is slow.
    found = (interface_files(folder, kind).get(name) for folder in folders if (folder / kind).is_dir())
    return next(filter(None, found), None)


def interface_files(folder: Path, kind: str) -> dict[str, Path]:
    """Return the files of a package's interfaces of a kind, by name, sorted.

    A `.msg`, `.srv` or `.action` file takes precedence over an `.idl` file, which a build makes of it.

    Args:
        folder: The package's folder.
        kind: "msg", "srv" or "action".
    """
    found = {file.stem: file for suffix in ("idl", kind) for file in (folder / kind).glob(f"*.{suffix}")}
    return dict(sorted(found.items()))


def interfaces_of(package: str) -> list[str]:
    """Return the type names of all interfaces of a package, messages first.

    Raises:
        UnknownInterfaceError: There is no such interface package.
    """
    names = [f"{package}/{kind}/{name}" for kind in KINDS for name in _names(package, kind)]
    if not names:
        raise UnknownInterfaceError(unknown_package(package))
    return names


def unknown_package(package: str) -> str:
    """Return the error text for an unknown package, with a suggestion."""
    close = difflib.get_close_matches(package, known_packages(), n=1)
    if close:
        return f"Unknown package '{package}'; did you mean {close[0]}?"
    remedy = "; install it, or add its prefix to AMENT_PREFIX_PATH" if share_folders else ""
    return f"Unknown package '{package}'{remedy}"


def _names(package: str, kind: str) -> list[str]:
    standard = is_standard(package)
    shared = {name for folder in share_folders for name in interface_files(folder / package, kind)}
    for folder in [_STANDARD / package] if standard else _folders(package):
        # Generated packages list their names; only folders with texts alone are searched for files.
        exported = _exported(folder / kind / "__init__.py")
        if exported:
            return sorted({*exported, *filter(TYPE_NAME.fullmatch, shared)})
    folders = () if standard else _text_folders(package)
    names = {name for folder in folders for name in interface_files(folder, kind)}
    return sorted(filter(TYPE_NAME.fullmatch, names | shared))


def _exported(module: Path) -> list[str]:
    """Return a module's `__all__` without running it: a package may do anything when it is imported."""
    try:
        body = ast.parse(read_regular(module)).body
    except (OSError, SyntaxError, ValueError):
        return []
    for statement in body:
        match statement:
            case ast.Assign(targets=[ast.Name(id="__all__")], value=ast.List() | ast.Tuple() as names):
                constants = (each.value for each in names.elts if isinstance(each, ast.Constant))
                return [each for each in constants if isinstance(each, str)]
            case _:
                pass
    return []


def _folders(package: str) -> list[Path]:
    """Return the folders of a package on the import path, without importing it."""
    try:
        # Checked first: `find_spec` of a name with a dot imports the packages above it.
        spec = find_spec(package) if PACKAGE_NAME.fullmatch(package) else None
    except (ImportError, ValueError):
        return []
    return [Path(each) for each in (spec.submodule_search_locations or ())] if spec is not None else []


def _text_folders(package: str) -> list[Path]:
    """Return the folders in which a package may have texts: any of its name on the import path.

    A module of the same name, such as Python's own `test`, hides a folder from `import`, and not its texts.
    """
    if not PACKAGE_NAME.fullmatch(package):
        return []
    return list(dict.fromkeys([*_folders(package), *(Path(entry or ".") / package for entry in sys.path)]))


def _has(folder: Path, kind: str) -> bool:
    """Return whether a folder has interfaces of a kind: generated, or as text."""
    try:
        if not folder.is_dir():
            return False
    except OSError:  # a folder above it that nobody may enter
        return False
    try:
        if _GENERATED.encode() in read_regular(folder / "__init__.py"):
            return True
    except OSError:
        pass
    return any(map(TYPE_NAME.fullmatch, interface_files(folder.parent, kind)))

"""Generates a typed Python package from a ROS-style interface package.

    robot_interfaces/msg/Wheel.msg     →     robot_interfaces/__init__.py, py.typed
    robot_interfaces/srv/Home.srv            robot_interfaces/msg/__init__.py, msg/_wheel.py
                                             robot_interfaces/srv/__init__.py, srv/_home.py

`from robot_interfaces.msg import Wheel` then works wherever the folder above is on the import path.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.interfaces.catalog import (
    STANDARD_ROOT,
    interface_files,
    shared_file,
    shared_module,
    source_file,
    standard_packages,
)
from actors.interfaces.errors import InterfaceSyntaxError
from actors.interfaces.interface_names import PACKAGE_NAME
from actors.interfaces.parser import parse_file
from actors.interfaces.source import module_name, render_init, render_module
from actors.interfaces.specs import PARTS
from actors.regular_files import is_within

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from actors.interfaces.specs import InterfaceSpec

MAX_NESTED: Final = 64
"""Levels of nested messages in a package. Deeper ones cannot be printed, and importing them is recursive."""


def read_package(source_dir: Path) -> list[InterfaceSpec]:
    """Parse the interfaces of a package folder.

    Args:
        source_dir: The folder, named as the package, with msg, srv and action folders.

    Returns:
        Their specifications; those of messages come before those that use them.

    Raises:
        InterfaceSyntaxError: The folder's name is not a package name, it has no interfaces, a file breaks a
            rule, or messages contain one another in a cycle.
        OSError: A file cannot be read.
    """
    source_dir = source_dir.resolve()
    package = source_dir.name
    if not PACKAGE_NAME.fullmatch(package):
        raise InterfaceSyntaxError(
            str(source_dir),
            0,
            f"'{package}' is not a package name: use lower case letters, digits and underscores",
        )
    files = [path for kind in PARTS for path in interface_files(source_dir, kind).values()]
    if not files:
        raise InterfaceSyntaxError(
            str(source_dir),
            0,
            "No interfaces: put them into msg/*.msg, srv/*.srv, action/*.action, or *.idl there",
        )
    specs = {spec.type_name: spec for spec in (parse_file(path, package) for path in files)}
    _check_modules(source_dir, list(specs.values()))
    return _in_order(source_dir, specs)


def _check_modules(source_dir: Path, specs: list[InterfaceSpec]) -> None:
    # `HTTPServer` and `HttpServer`, for example, would be written to one file.
    seen: dict[tuple[str, str], str] = {}
    for spec in specs:
        other = seen.setdefault((spec.kind, module_name(spec.name)), spec.name)
        if other != spec.name:
            reason = f"{other} and {spec.name} have the same module name; rename one"
            raise InterfaceSyntaxError(str(source_dir), 0, reason)


def _spec_of(type_name: str, folder: Path) -> InterfaceSpec | None:
    """Return a message of another package, whose folder is in `folder` or on the import path.

    None also if its file is wrong: then that package says so.
    """
    package, kind, name = type_name.split("/")
    path = interface_files(folder / package, kind).get(name) or source_file(package, kind, name)
    try:
        return None if path is None else parse_file(path, package)
    except (InterfaceSyntaxError, OSError):
        return None


def _check_dependencies(source_dir: Path, specs: dict[str, InterfaceSpec]) -> None:
    for spec in specs.values():
        for dependency in sorted(spec.dependencies):
            if dependency.startswith(f"{spec.package}/") and dependency not in specs:
                reason = f"{spec.type_name} has a field of type {dependency}, which is not in the package"
                raise InterfaceSyntaxError(str(source_dir), 0, reason)


def _in_order(source_dir: Path, specs: dict[str, InterfaceSpec]) -> list[InterfaceSpec]:
    ordered: list[InterfaceSpec] = []
    done: set[str] = set()
    standard = {*standard_packages()}

    def visit(type_name: str, path: list[str]) -> None:
        if type_name in path:
            cycle = " -> ".join([*path[path.index(type_name) :], type_name])
            raise InterfaceSyntaxError(str(source_dir), 0, f"Messages contain one another: {cycle}")
        if type_name in done:
            return
        if len(path) >= MAX_NESTED:
            reason = f"{path[0]} has messages that are nested more than {MAX_NESTED} levels deep"
            raise InterfaceSyntaxError(str(source_dir), 0, reason)
        # Another package's message may contain one of this package, which could then never be imported.
        spec = specs.get(type_name) or _spec_of(type_name, source_dir.parent)
        for dependency in sorted(() if spec is None else spec.dependencies):
            if dependency in specs or dependency.partition("/")[0] not in standard:
                visit(dependency, [*path, type_name])
        done.add(type_name)
        if type_name in specs:
            ordered.append(specs[type_name])

    for type_name in specs:
        visit(type_name, [])
    _check_dependencies(source_dir, specs)
    return ordered


def _locator(package: str, root: str, *, shared: bool) -> Callable[[str], str]:
    """Return a function from a message's type name to the module of its class; see `render_package`."""
    standard = set(standard_packages())

    def module_of(type_name: str) -> str:
        owner, kind, name = type_name.split("/")
        if owner == package:
            return f"{root}.{kind}.{module_name(name)}"
        if owner in standard:
            return f"{STANDARD_ROOT}.{owner}.{kind}.{module_name(name)}"
        if shared and shared_file(owner, kind, name) is not None:
            return shared_module(owner, kind, name)
        # Another tool may have generated it, with other names for the modules below.
        return f"{owner}.{kind}"

    return module_of


def render_package(specs: list[InterfaceSpec], root: str, *, shared: bool = False) -> dict[str, str]:
    """Return the files of a generated package: path in the package to text.

    Args:
        specs: All interfaces of one package.
        root: The Python package's full name.
        shared: Whether the text is for this process only, and may import what `share_packages` makes.
    """
    package = specs[0].package
    module_of = _locator(package, root, shared=shared)
    files = {"__init__.py": f'"""Interfaces of {package}."""\n', "py.typed": ""}
    for kind in PARTS:
        names = [spec.name for spec in specs if spec.kind == kind]
        if names:
            files[f"{kind}/__init__.py"] = render_init(package, kind, names, root)
    for spec in specs:
        files[f"{spec.kind}/{module_name(spec.name)}.py"] = render_module(spec, module_of, root)
    return files


def generate(source_dir: Path, output_dir: Path | None = None, *, root: str = "") -> list[Path]:
    """Write the Python package of the interface package in `source_dir`.

    Args:
        source_dir: The package's folder, named as the package, with msg, srv and action folders.
        output_dir: Parent of the Python package's folder; None: write into `source_dir`.
        root: The Python package's full name, if it is not a top-level package.

    Returns:
        The written files; an existing `__init__.py` is not overwritten.

    Raises:
        InterfaceSyntaxError: The package or one of its files breaks a rule.
        OSError: A file cannot be read or written.
    """
    source_dir = source_dir.resolve()
    specs = read_package(source_dir)
    target = source_dir if output_dir is None else output_dir / source_dir.name
    written: list[Path] = []
    files = render_package(specs, root or source_dir.name)
    # All are compiled before the first is written: an error leaves the package as it was.
    for name, text in files.items():
        compile(text, str(target / name), "exec", dont_inherit=True)
        if not is_within(target / name, target):
            reason = "It is a link to elsewhere, or no regular file: nothing is written through it; remove it"
            raise InterfaceSyntaxError(str(target / name), 0, reason)
    for name, text in files.items():
        path = target / name
        if "/" not in name and path.exists():
            continue  # the author may have written it
        path.parent.mkdir(parents=True, exist_ok=True)
        # The same bytes on every system, so that generated packages can be compared and checked in.
        path.write_text(text, encoding="utf-8", newline="\n")
        written.append(path)
    return written

"""Writes stub files, so that type checkers and editors know ROS 2's names.

    python -m actors.ros.stubs typings

The stub of `rclpy.node` has the names of `actors.ros.rclpy.node`, and so on. pyright finds the folder
`typings` of a project by itself; mypy has the option `mypy_path`.
"""

from __future__ import annotations

import argparse
import ast
import pkgutil
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from actors.ros.finder import LIBRARIES, module_names

if TYPE_CHECKING:
    from collections.abc import Iterator


def write_stubs(folder: Path, *, suffix: str = "") -> list[Path]:
    """Write the stubs of all packages that the finder finds in callboard.

    Args:
        folder: The folder of their packages, such as `typings`; it is made if it does not exist.
        suffix: "-stubs" for the `site-packages` of a distribution of stubs (PEP 561).

    Returns:
        The files. What else the folder holds stays as it is.
    """
    written: list[Path] = []
    for name, target in sorted(module_names().items()):
        spec = find_spec(target)
        assert spec is not None
        assert spec.origin is not None
        for path, text in _stubs(target, Path(spec.origin).parent, is_lazy=name in LIBRARIES):
            file = folder / f"{name}{suffix}" / path
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text, encoding="utf-8")
            written.append(file)
    return written


def _stubs(target: str, folder: Path, *, is_lazy: bool) -> Iterator[tuple[Path, str]]:
    """Return the stubs of a package and of all modules in it.

    Args:
        target: Its name in callboard.
        folder: Where its modules are.
        is_lazy: Whether its modules are attributes of it without being imported.
    """
    modules = [each for each in pkgutil.iter_modules([str(folder)]) if not each.name.startswith("_")]
    text = _stub(target, folder / "__init__.py")
    if is_lazy:
        text += "".join(f"from . import {each.name} as {each.name}\n" for each in modules)
    yield Path("__init__.pyi"), text
    for module in modules:
        name = f"{target}.{module.name}"
        if not module.ispkg:
            yield Path(f"{module.name}.pyi"), _stub(name, folder / f"{module.name}.py")
            continue
        for path, text in _stubs(name, folder / module.name, is_lazy=is_lazy):
            yield Path(module.name) / path, text


def _stub(target: str, source: Path) -> str:
    names = sorted(set(_public_names(ast.parse(source.read_text(encoding="utf-8")))))
    return "".join(f"from {target} import {name} as {name}\n" for name in names)


def _public_names(module: ast.Module) -> Iterator[str]:
    """Return the names that a module defines, imports as themselves, or has in `__all__`."""
    for node in module.body:
        found: list[object] = []
        match node:
            case ast.FunctionDef() | ast.AsyncFunctionDef() | ast.ClassDef():
                found = [node.name]
            case ast.ImportFrom():
                found = [each.asname for each in node.names if each.asname == each.name]
            case ast.Assign(targets=[ast.Name(id="__all__")], value=ast.List() as names):
                found = [each.value for each in names.elts if isinstance(each, ast.Constant)]
            case ast.Assign(targets=[ast.Name() as name]) | ast.AnnAssign(target=ast.Name() as name):
                found = [name.id]
            case _:
                pass
        yield from (each for each in found if isinstance(each, str) and not each.startswith("_"))


def main(arguments: list[str] | None = None) -> None:
    """Write stubs as the command line says; the default is that of the process."""
    parser = argparse.ArgumentParser(
        prog="python -m actors.ros.stubs", description="Write stub files for ROS 2's Python packages."
    )
    parser.add_argument("folder", type=Path, help="the folder to write them into, such as typings")
    folder: Path = parser.parse_args(arguments).folder
    print(f"{len(write_stubs(folder))} stub files in {folder}")  # noqa: T201 - a command


if __name__ == "__main__":
    main()

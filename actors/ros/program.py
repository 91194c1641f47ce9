"""Runs a program of a script, a module or an installed package in this process."""

from __future__ import annotations

import runpy
import sys
from functools import partial
from importlib.metadata import EntryPoint, entry_points
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from actors.tools.executables import find_package

if TYPE_CHECKING:
    from collections.abc import Callable


class NoProgramError(Exception):
    """There is no such script, module, package or console script."""


def find_program(name: str, arguments: list[str], *, module: bool = False) -> Callable[[], object]:
    """Prepare this process for a program, as Python does: its `sys.argv` and `sys.path`.

    Args:
        name: A file, a folder with a `__main__.py`, or a package whose console script is the first of the
            arguments.
        arguments: Its arguments.
        module: `name` is that of a module, as for `python -m`.

    Returns:
        A function that runs the program. It raises SystemExit if the program does.

    Raises:
        NoProgramError: There is no such program.
    """
    if module:
        return _module(name, arguments)
    path = Path(name)
    is_folder = (path / "__main__.py").is_file()
    if path.is_file() or is_folder:
        sys.argv = [name, *arguments]
        if not is_folder:  # runpy adds a folder itself
            sys.path.insert(0, str(path.resolve().parent))
        return partial(runpy.run_path, name, run_name="__main__")
    if path.suffix == ".py" or not arguments:
        raise NoProgramError(f"No script '{name}'")
    sys.argv = arguments
    script = _script(name, arguments[0])
    if script is not None:
        return partial(runpy.run_path, script, run_name="__main__")
    return partial(_run, _entry_point(name, arguments[0]))


def _module(name: str, arguments: list[str]) -> Callable[[], object]:
    if "" not in sys.path and str(Path.cwd()) not in sys.path:
        sys.path.insert(0, str(Path.cwd()))
    try:
        found = find_spec(name)
    except ModuleNotFoundError:
        found = None
    if found is None:
        raise NoProgramError(f"No module '{name}'")
    sys.argv = [name, *arguments]
    return partial(runpy.run_module, name, run_name="__main__", alter_sys=True)


def _script(package: str, executable: str) -> str | None:
    """Return the path of a program in a package's `lib` folder that is no console script."""
    installed = find_package(package)
    found = None if installed is None else installed.executable(executable)
    return None if found is None or found.module else str(found.path)


def _entry_point(package: str, executable: str) -> EntryPoint:
    scripts = [
        each
        for each in entry_points(group="console_scripts")
        if each.dist is not None and each.dist.name.replace("-", "_") == package.replace("-", "_")
    ]
    for each in scripts:
        if each.name == executable:
            return each
    there = ", ".join(each.name for each in scripts)
    raise NoProgramError(
        f"No program '{executable}' in package '{package}'; there is: {there}"
        if scripts
        else f"No installed package '{package}' with console scripts"
    )


def _run(script: EntryPoint) -> NoReturn:
    sys.exit(script.load()())

"""Runs a program in this process: a script, a module, or an executable of an installed package."""

from __future__ import annotations

import runpy
import sys
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from actors.tools.programs import NoProgramError, find_executable, find_script

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.tools.executables import Executable


def find_program(name: str, arguments: list[str], *, module: bool = False) -> Callable[[], object]:
    """Find a program, and set `sys.argv` and `sys.path` for it, as Python does.

    Args:
        name: A file, a folder with a `__main__.py`, or a package whose executable is the first of the
            arguments.
        arguments: Its arguments.
        module: Whether `name` is the name of a module, as for `python -m`.

    Returns:
        A function that runs the program. It raises SystemExit if the program does.

    Raises:
        NoProgramError: There is no such program.
        ModuleNotFoundError: A package of the module's name imports another module, which does not exist.
    """
    if module:
        return _find_module(name, arguments)
    script = find_script(name)
    if script is not None:
        sys.argv = [name, *arguments]
        if script.is_file():  # runpy adds a folder itself
            sys.path.insert(0, str(script.resolve().parent))
        return partial(runpy.run_path, name, run_name="__main__")
    executable = find_executable(name, arguments)
    sys.argv = arguments
    if not executable.module:
        return partial(runpy.run_path, str(executable.path), run_name="__main__")
    return partial(_run_function, executable)


def _find_module(name: str, arguments: list[str]) -> Callable[[], object]:
    if "" not in sys.path and str(Path.cwd()) not in sys.path:
        sys.path.insert(0, str(Path.cwd()))
    try:
        found = find_spec(name)  # this imports the packages that it is in
    except ModuleNotFoundError as error:
        if error.name is None or not f"{name}.".startswith(f"{error.name}."):
            raise
        found = None
    if found is None:
        raise NoProgramError(f"No module '{name}'")
    sys.argv = [name, *arguments]
    return partial(runpy.run_module, name, run_name="__main__", alter_sys=True)


def _run_function(executable: Executable) -> NoReturn:
    function = attrgetter(executable.function)(import_module(executable.module))
    sys.exit(function())

"""What there is outside of a description: launch files, packages, scripts."""

from __future__ import annotations

import sys
import traceback
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, Final

from actors.callbacks import error_text
from actors.launch.description import LaunchDescription
from actors.launch.errors import LaunchError, LaunchFileError
from actors.launch.factories import find_factory
from actors.tools.executables import find_package

if TYPE_CHECKING:
    from collections.abc import Sequence

    from actors.programs import Factory

FUNCTION: Final = "generate_launch_description"
MAX_FILE_BYTES: Final = 1 << 20
"""A larger launch file is a mistake."""


class Files:
    """The library of this machine: its files, and the packages that are installed here."""

    def description(self, path: str) -> LaunchDescription:
        """Run a launch file's `generate_launch_description`.

        Raises:
            LaunchFileError: It cannot be read, fails, or describes nothing.
        """
        function = getattr(_run(path), FUNCTION, None)
        if not callable(function):
            raise LaunchFileError(f"{path} has no function {FUNCTION}()")
        try:
            made = function()
        except Exception as error:
            raise _failed(path, error) from error
        if not isinstance(made, LaunchDescription):
            raise LaunchFileError(f"{path}: {FUNCTION}() must return a LaunchDescription, not {made!r}")
        return replace(made, file=path)

    def factory(self, name: str) -> Factory:
        """Return what makes a node: "package.module:Class". Its module is imported.

        Raises:
            LaunchError: There is none.
        """
        return find_factory(name)

    def program(self, package: str, executable: str) -> Sequence[str]:
        """Return the command for a console script of an installed package.

        Raises:
            LaunchError: There is none.
        """
        found = find_package(package)
        if found is None:
            raise LaunchError(f"No installed package '{package}'")
        program = found.executable(executable)
        if program is None:
            listed = ", ".join(each.name for each in found.executables())
            raise LaunchError(
                f"No program '{executable}' in package '{package}'; there is: {listed or 'none'}"
            )
        return (sys.executable, "-u", "-P", "-c", program.command())

    def script(self, path: str) -> Sequence[str]:
        """Return the command for a Python file.

        Raises:
            LaunchError: There is none.
        """
        if not Path(path).is_file():
            raise LaunchError(f"No script '{path}'")
        return (sys.executable, "-u", path)


def _run(path: str) -> ModuleType:
    """Run a launch file as a module. Python's own import would leave a folder with its bytecode behind."""
    try:
        with Path(path).open("rb") as file:
            source = file.read(MAX_FILE_BYTES + 1)
    except OSError as error:
        raise LaunchFileError(f"No launch file '{path}': {error.strerror}") from None
    if len(source) > MAX_FILE_BYTES:
        raise LaunchFileError(f"{path} is larger than {MAX_FILE_BYTES} bytes")
    module = ModuleType(f"callboard launch file {path}")
    module.__file__ = path
    # Dataclasses look their module up.
    sys.modules[module.__name__] = module
    try:
        exec(compile(source, path, "exec"), vars(module))  # noqa: S102 - running it is its purpose
    except Exception as error:
        raise _failed(path, error) from error
    return module


def _failed(path: str, error: Exception) -> LaunchFileError:
    """Say what went wrong in a launch file, and where in it."""
    if isinstance(error, LaunchFileError):
        return error
    line: Any = error.lineno if isinstance(error, SyntaxError) and error.filename == path else None
    for frame in traceback.extract_tb(error.__traceback__):
        if frame.filename == path:
            line = frame.lineno
    where = f"{path}, line {line}" if line else path
    text = error.msg if isinstance(error, SyntaxError) else error_text(error)
    return LaunchFileError(f"{where}: {type(error).__name__}: {text}")

"""Finds the program that a command line names: a script, or an executable of an installed package.

    script = find_script("talker.py")
    talker = find_executable("my_package", ["talker", "--ros-args"])

Both raise NoProgramError, whose text is for the user.
"""

from __future__ import annotations

import os
import shlex
from pathlib import Path
from typing import TYPE_CHECKING

from actors.tools.executables import find_package, normalized, packages
from actors.tools.suggestions import did_you_mean

if TYPE_CHECKING:
    from collections.abc import Sequence

    from actors.tools.executables import Executable


class NoProgramError(Exception):
    """There is no such script, module, package or executable; the text says what there is."""


def find_script(name: str) -> Path | None:
    """Return the path of a script, or of a folder with a `__main__.py`.

    Args:
        name: The first word after a command's options.

    Returns:
        None if there is no such script, and the word may be the name of a package.

    Raises:
        NoProgramError: There is no such script, and the word cannot be the name of a package.
    """
    path = Path(name)
    if path.is_file() or (path / "__main__.py").is_file():
        return path
    if path.suffix == ".py" or os.sep in name:
        raise NoProgramError(f"No script '{path}'{_similar_file(path)}")
    return None


def find_executable(package: str, arguments: Sequence[str]) -> Executable:
    """Return an executable of an installed package.

    Args:
        package: The package, in any spelling.
        arguments: The words after it; the first is the executable.

    Raises:
        NoProgramError: There is no such package or executable.
    """
    found = find_package(package)
    if found is None:
        raise NoProgramError(f"No script and no installed package '{package}'{_remedy(package)}")
    programs = {each.name: each for each in found.executables()}
    if not programs:
        raise NoProgramError(f"Package '{package}' has no console scripts to run")
    listed = ", ".join(programs)
    if not arguments:
        raise NoProgramError(f"Which program of '{package}'? There is: {listed}")
    if arguments[0] not in programs:
        hint = did_you_mean(arguments[0], programs) or f"; there is: {listed}"
        raise NoProgramError(f"No program '{arguments[0]}' in package '{package}'{hint}")
    return programs[arguments[0]]


def _similar_file(path: Path) -> str:
    folder = path.parent
    files = [str(each) for each in folder.glob("*.py")] if folder.is_dir() else []
    return did_you_mean(str(path), files)


def _remedy(package: str) -> str:
    """Return a suggestion, or the missing step."""
    if Path(f"{package}.py").is_file():
        return f"; did you mean './{package}.py'?"
    if (Path(package) / "pyproject.toml").is_file():
        return f"; install it with: pip install -e {shlex.quote(f'./{package}')}"
    if Path("pyproject.toml").is_file() and normalized(Path.cwd().name) == normalized(package):
        return "; install it with: pip install -e ."
    known = [each.name for each in packages() if each.uses_callboard or each.executables()]
    return did_you_mean(package, known) or "; write SCRIPT.py [ARGS], or PACKAGE EXECUTABLE [ARGS]"

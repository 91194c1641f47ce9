"""Runs a program of a script or of an installed package in this process."""

from __future__ import annotations

import runpy
import sys
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import NoReturn


class NoProgramError(Exception):
    """There is no such script, package or console script."""


def run_program(name: str, arguments: list[str]) -> None:
    """Run a program as Python does, with its own `sys.argv`.

    Args:
        name: A file, or a package whose console script is the first of the arguments.
        arguments: Its arguments.

    Raises:
        NoProgramError: There is no such program.
        SystemExit: The program has ended so.
    """
    path = Path(name)
    if path.is_file():
        sys.argv = [name, *arguments]
        sys.path.insert(0, str(path.resolve().parent))
        runpy.run_path(name, run_name="__main__")
        return
    if path.suffix == ".py" or not arguments:
        raise NoProgramError(f"No script '{name}'")
    sys.argv = arguments
    _run(_entry_point(name, arguments[0]))


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

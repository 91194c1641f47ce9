"""Imports a generated package in another process: what Python refuses, it refuses before anybody uses it."""

from __future__ import annotations

import importlib
import json
import subprocess
import sys
import traceback
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

from actors.interfaces.errors import InterfaceSyntaxError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from types import TracebackType

CHECK_SEC: Final = 60.0
"""Limit of importing everything: the package's own `__init__.py` may be its author's, and do anything."""


def check_import(folder: Path, written: Sequence[Path]) -> list[str]:
    """Import the modules of a package.

    Args:
        folder: The package's folder.
        written: Files in it; those that are no modules are left out.

    Returns:
        Other packages that they need, and that cannot be imported here.

    Raises:
        InterfaceSyntaxError: One cannot be imported; it names the file and the line.
    """
    root = folder.resolve()
    files = [path.resolve().relative_to(root.parent) for path in written if path.suffix == ".py"]
    modules = [".".join(file.with_suffix("").parts).removesuffix(".__init__") for file in files]
    # It has this process's import path, and writes no bytecode.
    code = (
        f"import sys; sys.path[:] = {sys.path!r}; from {__name__} import report; report{str(root), modules}"
    )
    try:
        done = subprocess.run(  # noqa: S603 - no text of others is in it, except as data
            [sys.executable, "-B", "-c", code],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=CHECK_SEC,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise InterfaceSyntaxError(
            str(folder), 0, f"Importing it has not ended after {CHECK_SEC:g} s"
        ) from None
    last = done.stdout.splitlines()[-1:] or [b""]
    try:
        result: tuple[str, int, str, list[str]] = json.loads(last[0])
    except ValueError:
        result = str(folder), 0, f"Python has ended with {done.returncode}", []
    file, line, reason, missing = result
    if reason:
        raise InterfaceSyntaxError(file, line, f"It was written, but cannot be imported: {reason}")
    return missing


def report(root: str, modules: Sequence[str]) -> None:
    """Import modules, and print the result, for `check_import` in another process.

    Args:
        root: The folder of their package, which is imported from the folder above.
        modules: Their names.
    """
    package = Path(root).name
    sys.excepthook = partial(_report_error, Path(root))
    sys.path.insert(0, str(Path(root).parent))
    missing = set[str]()
    for module in modules:
        try:
            importlib.import_module(module)
        except ImportError as error:
            needed = (error.name or package).partition(".")[0]
            if needed == package:
                raise
            missing.add(needed)  # it may be generated after this one
    _write(root, 0, "", sorted(missing))


def _report_error(
    root: Path, kind: type[BaseException], error: BaseException, trace: TracebackType | None
) -> None:
    """Print an error, and where in the package it is."""
    places = [(each.filename, each.lineno or 0) for each in traceback.extract_tb(trace)]
    if isinstance(error, SyntaxError):
        places.append((error.filename or "", error.lineno or 0))
    own = [place for place in places if Path(place[0]).is_relative_to(root)]
    file, line = own[-1] if own else (str(root), 0)
    _write(file, line, f"{kind.__name__}: {error}", [])


def _write(*result: object) -> None:
    sys.stdout.write(json.dumps(result) + "\n")

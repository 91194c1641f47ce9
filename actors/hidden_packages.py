"""Explains import errors if somebody's own proto.py, or another library, hides one of callboard's packages.

Python only says "No module named 'proto.errors'; 'proto' is not a package". This module is imported after a
failure, and must not need `proto` itself.
"""

from __future__ import annotations

import sys
from importlib.machinery import PathFinder
from pathlib import Path
from typing import Final, NoReturn

_HOME: Final = Path(__file__).resolve().parent.parent


class _Refusal:
    """Refuses to import modules of callboard: none of them would find `proto`.

    The command line is an exception: it prints the text without a traceback.

    Args:
        text: The reason.
    """

    def __init__(self, text: str) -> None:
        self._text = text

    def find_spec(self, name: str, _path: object = None, _target: object = None) -> None:
        """Raise ImportError for a module of callboard."""
        own = ("actors.cli", "actors.hidden_packages")
        if name.startswith(("actors.", "broker.")) and not name.startswith(own):
            raise ImportError(self._text, name="proto")


def refuse_without_proto() -> None:
    """If another module hides `proto`, let imports of callboard's modules fail with its file."""
    if text := _hiding("proto"):
        sys.meta_path.insert(0, _Refusal(text))


def raise_explained(error: ImportError) -> NoReturn:
    """Raise an error that names the module that hides a package of callboard, or the same error.

    Args:
        error: What a failed import of callboard has raised.

    Raises:
        ImportError: Always.
    """
    text = hidden_package(error)
    if not text or text == str(error):
        raise error
    raise ImportError(text, name=error.name) from error


def hidden_package(error: ImportError) -> str:
    """Return a sentence about the module that hides a package of callboard; "" if that is not the reason.

    Args:
        error: What a failed import of callboard has raised.
    """
    # Everything needs `proto`. A hidden broker is no reason for an error that is about another module.
    root = (error.name or "").partition(".")[0]
    return _hiding("proto") or (_hiding(root) if root == "broker" else "")


def _hiding(package: str) -> str:
    """Return a sentence about the module that hides a package, loaded or not; "" if none does."""
    file = getattr(sys.modules.get(package), "__file__", None)
    if file is None:
        spec = PathFinder.find_spec(package)
        file = spec.origin if spec is not None and spec.has_location else None
    if file is None or _HOME / package in Path(file).resolve().parents:
        return ""
    return (
        f"the import name '{package}' belongs to another package here: {file}\n"
        "Rename that, or install callboard into a separate environment: python -m venv"
    )

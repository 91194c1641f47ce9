"""Imports of extension modules."""

from __future__ import annotations

import math
import os
from contextlib import contextmanager
from typing import TYPE_CHECKING

from actors.ros.rpyutils import add_dll_directories_from_env, import_c_library

if TYPE_CHECKING:
    from collections.abc import Generator
    from pathlib import Path

    import pytest


def test_a_module_is_imported() -> None:
    """As `import` does, also by a relative name."""
    assert import_c_library("math") is math
    assert import_c_library(".path", "os") is os.path


def test_windows_gets_the_folders_of_a_variable(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Those that exist, for the duration of a block."""
    added: list[str] = []

    @contextmanager
    def add(folder: str) -> Generator[None]:
        added.append(folder)
        yield
        added.remove(folder)

    monkeypatch.setattr(os, "add_dll_directory", add, raising=False)
    monkeypatch.setenv("FOLDERS", os.pathsep.join([str(tmp_path), str(tmp_path / "none"), ""]))
    with add_dll_directories_from_env("FOLDERS"):
        assert added == [str(tmp_path)]
    assert added == []

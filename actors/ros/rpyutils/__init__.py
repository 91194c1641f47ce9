"""Imports extension modules with the right library folders, as ROS 2's packages do: `rpyutils`."""

from __future__ import annotations

import importlib
import os
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actors.config.environment import foreign_variables

if TYPE_CHECKING:
    from collections.abc import Generator
    from types import ModuleType


@contextmanager
def add_dll_directories_from_env(env_name: str) -> Generator[None]:
    """Let Windows find libraries in the folders of an environment variable, within a `with` block.

    Elsewhere this does nothing.
    """
    add: Any = getattr(os, "add_dll_directory", None)
    folders = foreign_variables().get(env_name, "").split(os.pathsep) if add else []
    with ExitStack() as stack:
        for folder in folders:
            if Path(folder).is_absolute() and Path(folder).is_dir():
                stack.enter_context(add(folder))
        yield


def import_c_library(name: str, package: str | None = None) -> ModuleType:
    """Import an extension module.

    Args:
        name: Its name, which may be relative.
        package: The package that a relative name begins at.

    Raises:
        ImportError: There is no such module. callboard has none of ROS 2's own.
    """
    with add_dll_directories_from_env("PATH"):
        return importlib.import_module(name, package)

"""Factories by name: "module:Class", as launch files that are no Python name what makes a node."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any, Final

from actors.errors import error_text
from actors.launch.errors import LaunchError
from proto.errors import escape

if TYPE_CHECKING:
    from actors.runtime.programs import Factory

_EXPECTED: Final = "write it as node='package.module:Class'"


def find_factory(name: str) -> Factory:
    """Return the class or function with a name. Its module is imported, from Python's search path.

    Raises:
        LaunchError: There is none, its module cannot be imported, or it cannot be called.
    """
    module_name, separator, attribute = name.partition(":")
    if not separator or not attribute or not all(map(str.isidentifier, module_name.split("."))):
        raise LaunchError(f"'{escape(name)}' names no node: {_EXPECTED}")
    try:
        found: Any = importlib.import_module(module_name)
    except Exception as error:
        text = f"{type(error).__name__}: {error_text(error)}"
        raise LaunchError(f"Module '{module_name}' cannot be imported: {escape(text)}") from error
    for part in attribute.split("."):
        found = getattr(found, part, None)
        if found is None:
            raise LaunchError(f"Module '{module_name}' has no '{escape(attribute)}'")
    if not callable(found):
        raise LaunchError(f"{escape(name)} is no class and no function, but {escape(repr(found))}")
    return found  # type: ignore[no-any-return]

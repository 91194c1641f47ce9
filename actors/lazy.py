"""Names of a package that import their modules on first use (PEP 562).

It is not part of `proto`, so that the command line can report another installed package of that name.
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence


_HELPERS: Final = {"TYPE_CHECKING", "annotations", "lazy_names"}
"""What the package roots import for themselves."""


def lazy_names(
    package: str, homes: Mapping[str, Sequence[str]]
) -> tuple[Callable[[str], object], Callable[[], list[str]]]:
    """Return the `__getattr__` and `__dir__` of a package.

    `dir` and `__all__` have these names and those that the package imports for export, not its helpers.

    Args:
        package: Its `__name__`.
        homes: Full names of modules, each with the names to take from it.
    """
    home_of = {name: module for module, names in homes.items() for name in names}
    get = lazy_getattr(package, home_of)

    def exports() -> set[str]:
        own = vars(sys.modules[package]).items()
        return {
            *home_of,
            *(
                name
                for name, value in own
                if name[0] != "_" and name not in _HELPERS and not isinstance(value, ModuleType)
            ),
        }

    def get_name(name: str) -> object:
        return sorted(exports()) if name == "__all__" else get(name)  # what `from package import *` takes

    def names() -> list[str]:
        special = {name for name in vars(sys.modules[package]) if name[:2] == "__"}
        return sorted(exports() | special)

    return get_name, names


def lazy_getattr(package: str, home_of: Mapping[str, str]) -> Callable[[str], object]:
    """Return the `__getattr__` of a package.

    Args:
        package: Its `__name__`.
        home_of: Name to the full name of its module.
    """

    def get(name: str) -> object:
        if name not in home_of:
            raise AttributeError(f"module '{package}' has no attribute '{name}'")
        value: object = getattr(import_module(home_of[name]), name)
        setattr(sys.modules[package], name, value)
        return value

    return get

"""Names of a package that import their modules on first use (PEP 562).

It is not part of `proto`, so that the command line can report another installed package of that name.
"""

from __future__ import annotations

import sys
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence


def lazy_names(
    package: str, homes: Mapping[str, Sequence[str]]
) -> tuple[Callable[[str], object], Callable[[], list[str]]]:
    """Return the `__getattr__` and `__dir__` of a package.

    Args:
        package: Its `__name__`.
        homes: Full names of modules, each with the names to take from it.
    """
    home_of = {name: module for module, names in homes.items() for name in names}

    def names() -> list[str]:
        return sorted({*vars(sys.modules[package]), *home_of})

    return lazy_getattr(package, home_of), names


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

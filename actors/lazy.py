"""Names of a package that import their modules on first use (PEP 562).

    with lazy_imports(__name__):
        from actors.node.node import Node as Node

Type checkers and import-linter read the imports as they are, so each name is written once. At run time they
import nothing until somebody uses the name.

It is not part of `proto`, so that the command line can report another installed package of that name.
"""

from __future__ import annotations

import builtins
import sys
from _thread import allocate_lock
from importlib import import_module
from types import ModuleType

# Type checkers know it without an import; `import actors` shall not load `typing`.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from types import TracebackType
    from typing import Any

_HELPERS = {"annotations", "lazy_imports", "refuse_without_proto"}
"""What the package roots import for themselves."""
_lock = allocate_lock()
"""Held while `__import__` is replaced: two threads must not put back each other's replacement."""


class _Module:
    """Stands for a module in the block, and for each name that is imported from it."""

    __slots__ = ("module",)

    def __init__(self, module: str) -> None:
        self.module = module

    def __getattr__(self, name: str) -> _Module:
        return self


class lazy_imports:  # noqa: N801 - used like a statement
    """Make the imports of a block lazy, and give the package `__getattr__` and `__dir__`.

    The block has statements `from module import Name as Name` only. Imports elsewhere, also those of other
    threads, are not affected. `dir` and `__all__` have the names of the block and those that the package
    imports for export, not its helpers.

    Args:
        package: The package's `__name__`.
        renamed: Former names of exports and the present ones. The former work for one version, with a
            DeprecationWarning, and are not listed.
    """

    def __init__(self, package: str, *, renamed: Mapping[str, str] | None = None) -> None:
        self._package = package
        self._renamed = renamed or {}
        self._namespace = vars(sys.modules[package])

    def __enter__(self) -> None:
        _lock.acquire()
        self._import = builtins.__import__
        builtins.__import__ = self._import_lazily

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        builtins.__import__ = self._import
        _lock.release()
        namespace = self._namespace
        home_of = {name: each.module for name, each in namespace.items() if isinstance(each, _Module)}
        for name in home_of:
            del namespace[name]
        get = lazy_getattr(self._package, home_of)

        def exports() -> set[str]:
            return {
                *home_of,
                *(
                    name
                    for name, value in namespace.items()
                    if name[0] != "_" and name not in _HELPERS and not isinstance(value, ModuleType)
                ),
            }

        def get_name(name: str) -> object:
            if name == "__all__":  # what `from package import *` takes
                return sorted(exports())
            if name not in self._renamed:
                return get(name)
            import warnings  # noqa: PLC0415 - `import actors` shall not load it

            new = self._renamed[name]
            text = f"{self._package}.{name} is called {self._package}.{new}"
            warnings.warn(text, DeprecationWarning, stacklevel=2)
            return getattr(sys.modules[self._package], new)

        def names() -> list[str]:
            return sorted(exports() | {name for name in namespace if name[:2] == "__"})

        namespace["__getattr__"] = get_name
        namespace["__dir__"] = names

    def _import_lazily(
        self,
        name: str,
        globals: Mapping[str, object] | None = None,  # noqa: A002 - the interpreter's names
        locals: Mapping[str, object] | None = None,  # noqa: A002
        fromlist: Sequence[str] | None = (),
        level: int = 0,
    ) -> Any:
        if globals is self._namespace:
            return _Module(name)
        return self._import(name, globals, locals, fromlist, level)


def lazy_getattr(package: str, home_of: Mapping[str, str]) -> Callable[[str], object]:
    """Return the `__getattr__` of a package.

    Args:
        package: Its `__name__`.
        home_of: Name to the full name of its module.
    """

    def get(name: str) -> object:
        if name not in home_of:
            raise AttributeError(f"module '{package}' has no attribute '{name}'")
        try:
            value: object = getattr(import_module(home_of[name]), name)
        except ImportError as error:
            from actors.hidden_packages import raise_explained  # noqa: PLC0415 - after a failure only

            raise_explained(error)
        setattr(sys.modules[package], name, value)
        return value

    return get

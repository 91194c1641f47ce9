"""callboard under one name: the public API of `actors` (nodes) and of `broker`.

    import callboard
    from callboard import Node

The packages behind it keep their names, such as `actors.interfaces` and `actors.launch`.
"""

from __future__ import annotations

from importlib import import_module
from importlib.machinery import PathFinder as _PathFinder
from os import path as _path

# Type checkers know it without an import; `import callboard` shall not load `typing`.
TYPE_CHECKING = False  # pyright: ignore[reportConstantRedefinition] - as `import *` brings it
_PACKAGES = ("actors", "broker")

if TYPE_CHECKING:
    from types import ModuleType

    from actors import *  # noqa: F403 - each package lists its names once
    from broker import *  # noqa: F403
else:  # with a `__getattr__` in sight, type checkers accept each misspelt name

    def _refuse_other(name: str, file: str | None) -> None:
        # As `actors.hidden_packages` does, which may be hidden itself.
        home = _path.dirname(_path.dirname(_path.realpath(__file__)))  # noqa: PTH120 - pathlib takes milliseconds
        if file is not None and not _path.realpath(file).startswith(_path.join(home, name) + _path.sep):  # noqa: PTH118
            raise ImportError(
                f"the import name '{name}' belongs to another package here: {file}\n"
                "Rename that, or install callboard into a separate environment: python -m venv",
                name=name,
            )

    def _package(name: str) -> ModuleType:
        module = import_module(name)
        _refuse_other(name, module.__file__)
        return module

    # Nothing works without these two. Somebody's own broker.py matters only when the broker is used.
    for _name in ("actors", "proto"):
        _spec = _PathFinder.find_spec(_name)
        if _spec is not None and _spec.has_location:
            _refuse_other(_name, _spec.origin)

    def __getattr__(name: str) -> object:
        # The packages are imported when a name is first used, so `import callboard` costs next to nothing.
        if name == "__all__":
            return sorted({name for package in _PACKAGES for name in _package(package).__all__})
        for package in _PACKAGES if not name.startswith("_") else ():
            module = _package(package)
            if name in module.__all__:
                value: object = getattr(module, name)
                globals()[name] = value
                return value
        raise AttributeError(f"module 'callboard' has no attribute '{name}'")

    def __dir__() -> list[str]:
        return [*__getattr__("__all__"), *(name for name in globals() if name.startswith("__"))]

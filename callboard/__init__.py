"""callboard under one name: the public API of `actors` (nodes) and of `broker`.

    import callboard
    from callboard import Node

The packages behind it keep their names, such as `actors.interfaces` and `actors.launch`.
"""

from __future__ import annotations

from importlib import import_module

# Type checkers know it without an import; `import callboard` shall not load `typing`.
TYPE_CHECKING = False  # pyright: ignore[reportConstantRedefinition] - as `import *` brings it
_PACKAGES = ("actors", "broker")

if TYPE_CHECKING:
    from actors import *  # noqa: F403 - each package lists its names once
    from broker import *  # noqa: F403
else:  # with a `__getattr__` in sight, type checkers accept each misspelt name

    def __getattr__(name: str) -> object:
        # The packages are imported when a name is first used, so `import callboard` costs next to nothing.
        if name == "__all__":
            return sorted({name for package in _PACKAGES for name in import_module(package).__all__})
        for package in _PACKAGES if not name.startswith("_") else ():
            module = import_module(package)
            if name in module.__all__:
                value: object = getattr(module, name)
                globals()[name] = value
                return value
        raise AttributeError(f"module 'callboard' has no attribute '{name}'")

    def __dir__() -> list[str]:
        return [*__getattr__("__all__"), *(name for name in globals() if name.startswith("__"))]

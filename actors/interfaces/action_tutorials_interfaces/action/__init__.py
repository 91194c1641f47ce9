"""Actions of action_tutorials_interfaces."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.action_tutorials_interfaces.action._fibonacci import Fibonacci

__all__ = [
    "Fibonacci",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "Fibonacci": "_fibonacci",
        },
    )

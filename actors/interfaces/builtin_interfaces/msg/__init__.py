"""Messages of builtin_interfaces."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.builtin_interfaces.msg._duration import Duration
    from actors.interfaces.builtin_interfaces.msg._time import Time

__all__ = [
    "Duration",
    "Time",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "Duration": "_duration",
            "Time": "_time",
        },
    )

"""Messages of callboard_interfaces."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.callboard_interfaces.msg._callback_times import CallbackTimes

__all__ = [
    "CallbackTimes",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "CallbackTimes": "_callback_times",
        },
    )

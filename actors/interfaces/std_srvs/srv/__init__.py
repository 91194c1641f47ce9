"""Services of std_srvs."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.std_srvs.srv._empty import Empty
    from actors.interfaces.std_srvs.srv._set_bool import SetBool
    from actors.interfaces.std_srvs.srv._trigger import Trigger

__all__ = [
    "Empty",
    "SetBool",
    "Trigger",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "Empty": "_empty",
            "SetBool": "_set_bool",
            "Trigger": "_trigger",
        },
    )

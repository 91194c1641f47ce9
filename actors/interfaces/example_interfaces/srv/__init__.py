"""Services of example_interfaces."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.example_interfaces.srv._add_two_ints import AddTwoInts
    from actors.interfaces.example_interfaces.srv._set_bool import SetBool
    from actors.interfaces.example_interfaces.srv._trigger import Trigger

__all__ = [
    "AddTwoInts",
    "SetBool",
    "Trigger",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "AddTwoInts": "_add_two_ints",
            "SetBool": "_set_bool",
            "Trigger": "_trigger",
        },
    )

"""Services of test_msgs."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.test_msgs.srv._arrays import Arrays
    from actors.interfaces.test_msgs.srv._basic_types import BasicTypes
    from actors.interfaces.test_msgs.srv._empty import Empty

__all__ = [
    "Arrays",
    "BasicTypes",
    "Empty",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "Arrays": "_arrays",
            "BasicTypes": "_basic_types",
            "Empty": "_empty",
        },
    )

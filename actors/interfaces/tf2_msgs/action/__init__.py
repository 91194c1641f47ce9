"""Actions of tf2_msgs."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.tf2_msgs.action._lookup_transform import LookupTransform

__all__ = [
    "LookupTransform",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "LookupTransform": "_lookup_transform",
        },
    )

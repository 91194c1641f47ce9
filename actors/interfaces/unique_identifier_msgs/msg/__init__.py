"""Messages of unique_identifier_msgs."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.unique_identifier_msgs.msg._uuid import UUID

__all__ = [
    "UUID",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "UUID": "_uuid",
        },
    )

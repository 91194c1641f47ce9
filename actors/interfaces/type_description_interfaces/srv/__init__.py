"""Services of type_description_interfaces."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.type_description_interfaces.srv._get_type_description import GetTypeDescription

__all__ = [
    "GetTypeDescription",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "GetTypeDescription": "_get_type_description",
        },
    )

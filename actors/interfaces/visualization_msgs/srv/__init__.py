"""Services of visualization_msgs."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.visualization_msgs.srv._get_interactive_markers import GetInteractiveMarkers

__all__ = [
    "GetInteractiveMarkers",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "GetInteractiveMarkers": "_get_interactive_markers",
        },
    )

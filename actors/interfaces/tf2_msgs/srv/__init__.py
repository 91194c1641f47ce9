"""Services of tf2_msgs."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.tf2_msgs.srv._frame_graph import FrameGraph

__all__ = [
    "FrameGraph",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "FrameGraph": "_frame_graph",
        },
    )

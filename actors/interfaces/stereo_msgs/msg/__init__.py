"""Messages of stereo_msgs."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.stereo_msgs.msg._disparity_image import DisparityImage

__all__ = [
    "DisparityImage",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "DisparityImage": "_disparity_image",
        },
    )

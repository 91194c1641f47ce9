"""Messages of tf2_msgs."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.tf2_msgs.msg._tf2_error import TF2Error
    from actors.interfaces.tf2_msgs.msg._tf_message import TFMessage

__all__ = [
    "TF2Error",
    "TFMessage",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "TF2Error": "_tf2_error",
            "TFMessage": "_tf_message",
        },
    )

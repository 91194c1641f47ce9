"""Messages of rosbag2_interfaces."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.rosbag2_interfaces.msg._read_split_event import ReadSplitEvent
    from actors.interfaces.rosbag2_interfaces.msg._write_split_event import WriteSplitEvent

__all__ = [
    "ReadSplitEvent",
    "WriteSplitEvent",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "ReadSplitEvent": "_read_split_event",
            "WriteSplitEvent": "_write_split_event",
        },
    )

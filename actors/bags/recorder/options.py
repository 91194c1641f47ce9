"""The options of a recorder."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from actors.bags.errors import InvalidBagOptionError
from actors.bags.writer import check_file_limits

if TYPE_CHECKING:
    from collections.abc import Mapping

    from actors.qos.profile import QoSProfile

MAX_CACHE_SIZE: Final = 100 * 1024 * 1024
"""Default limit for waiting messages, in bytes, as in ROS 2: about what a disk writes in a second."""


@dataclass(frozen=True, kw_only=True)
class RecorderOptions:
    """Options of a recorder.

    Args:
        max_bag_size: Size in bytes at which a new file starts; 0 (default) for never.
        max_bag_duration_sec: Seconds after which a new file starts; 0 (default) for never.
        max_splits: Number of files to keep: when another one starts, the oldest is deleted; 0 (default) for
            all.
        compression: Compression of chunks: "none" (default), "zstd" or "lz4".
        fsync: Whether to sync each chunk to the disk, so that it survives a power loss; False by default,
            since it is slower.
        max_cache_size: Limit in bytes for messages that wait in memory for the disk; default: 100 MiB. Beyond
            it, messages are dropped and counted. 0: hand each message to the operating system at once. In
            snapshot mode, the limit for the messages that are kept.
        lossless: Let KEEP_ALL publishers wait for the disk rather than drop messages; False by default.
        snapshot_mode: Keep the newest messages in memory, and write them when `take_snapshot` is called.
        start_paused: Record nothing until `resume` is called.
        no_discovery: Record only topics that exist at the start.
        use_sim_time: Take log times from `/clock`, and record nothing before its first message.
        until_no_messages_sec: End when no message has arrived for this many seconds; 0 (default) for never.
        qos_overrides: QoS of the recorder's subscriptions, by topic.
        custom_data: Strings for the bag's metadata, by name.

    Raises:
        InvalidBagOptionError: An option is out of range, or two options exclude each other.
    """

    max_bag_size: int = 0
    max_bag_duration_sec: float = 0
    max_splits: int = 0
    compression: str = "none"
    fsync: bool = False
    max_cache_size: int = MAX_CACHE_SIZE
    lossless: bool = False
    snapshot_mode: bool = False
    start_paused: bool = False
    no_discovery: bool = False
    use_sim_time: bool = False
    until_no_messages_sec: float = 0
    qos_overrides: Mapping[str, QoSProfile] = field(default_factory=lambda: MappingProxyType({}))
    custom_data: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))

    def __post_init__(self) -> None:
        check_file_limits(self.max_bag_size, self.max_bag_duration_sec, self.max_splits)
        if self.max_cache_size < 0:
            raise InvalidBagOptionError("max_cache_size cannot be negative", "max_cache_size")
        if not self.until_no_messages_sec >= 0:
            raise InvalidBagOptionError("until_no_messages_sec cannot be negative", "until_no_messages_sec")
        if self.snapshot_mode and not self.max_cache_size:
            raise InvalidBagOptionError(
                "snapshot_mode needs memory, but max_cache_size is 0", "snapshot_mode", "max_cache_size"
            )
        if self.snapshot_mode and self.lossless:
            raise InvalidBagOptionError(
                "lossless and snapshot_mode, which drops messages, exclude each other",
                "lossless",
                "snapshot_mode",
            )
        if self.no_discovery and self.use_sim_time:
            raise InvalidBagOptionError(
                "use_sim_time and no_discovery exclude each other", "use_sim_time", "no_discovery"
            )

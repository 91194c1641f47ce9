"""The options of a recorder."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from actors.bags.recorder.errors import InvalidRecordingError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from actors.qos.profile import QoSProfile

MAX_CACHE_SIZE: Final = 100 * 1024 * 1024
"""What may wait in memory, in bytes: a second of a camera, and of what a disk writes; ROS 2's default."""


@dataclass(frozen=True, kw_only=True)
class RecorderOptions:
    """How a recorder records.

    Args:
        max_bag_size: Bytes after which the next file begins; 0 (default): never.
        max_bag_duration_sec: Seconds after which the next file begins; 0 (default): never.
        max_splits: The most files that are kept: for one more, the oldest is deleted; 0 (default): all.
        compression: Of the chunks of files: "none" (default), "zstd" or "lz4".
        fsync: Whether what is written survives a loss of power, too; False by default. It costs time.
        max_cache_size: Bytes of messages that may wait in memory for the disk, 100 MiB by default; beyond it
            further ones are dropped, and counted. 0: what arrives is handed to the operating system at once.
            In snapshot mode, what is kept.
        lossless: Let KEEP_ALL publishers wait for the disk, rather than drop messages; False by default.
        snapshot_mode: Keep the newest messages in memory, and write them when `take_snapshot` is called.
        start_paused: Record nothing before `resume`.
        no_discovery: Record only topics that exist at the start.
        use_sim_time: Log times are simulated time, and nothing is recorded before the first `/clock`.
        until_no_messages_sec: End when no message has arrived for this many seconds; 0 (default): never.
        qos_overrides: By topic, the QoS of the recorder's subscription.
        custom_data: Texts by name, for the bag's metadata.

    Raises:
        InvalidRecordingError: An option is out of range, or two exclude each other.
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
        for name in ("max_bag_size", "max_bag_duration_sec", "max_splits", "max_cache_size"):
            if getattr(self, name) < 0:
                raise InvalidRecordingError(f"{name} cannot be negative")
        if not self.until_no_messages_sec >= 0:
            raise InvalidRecordingError("until_no_messages_sec cannot be negative")
        if self.snapshot_mode and not self.max_cache_size:
            raise InvalidRecordingError("Snapshots need memory: max_cache_size is 0")
        if self.snapshot_mode and self.lossless:
            raise InvalidRecordingError("Snapshots forget old messages: they cannot be lossless")
        if self.no_discovery and self.use_sim_time:
            raise InvalidRecordingError("use_sim_time and no_discovery exclude each other")

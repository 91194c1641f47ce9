"""Writes a bag: a folder with MCAP files and metadata.yaml, as rosbag2 of ROS 2 Kilted does.

    with Writer("trip") as bag:
        number = bag.add_topic(BagTopic.of_class("/chatter", String, [QoSProfile(depth=10)]))
        bag.write(number, cdr.encode(String(data="hello")), time.time_ns(), time.time_ns())

A writer blocks while it writes, and must be used in one thread only.
"""

from __future__ import annotations

import json
from collections import defaultdict, deque
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from actors.bags.contents.metadata import (
    DROPPED_KEY,
    FILE_NAME,
    LOSSES_KEY,
    VERSION,
    metadata_fields,
    metadata_text,
)
from actors.bags.contents.records import BagMetadata, FileSummary, TopicCount
from actors.bags.errors import BagExistsError, InvalidBagOptionError, write_error
from actors.bags.extra import require_extra
from actors.interfaces.yaml_writer import block_text
from actors.qos.profile import DurabilityPolicy, HistoryPolicy
from actors.time.types import NANOSECONDS_PER_SECOND

if TYPE_CHECKING:
    from collections.abc import Hashable, Mapping
    from types import TracebackType
    from typing import Self

    from actors.bags.contents.records import BagTopic
    from actors.bags.storage.mcap_writer import McapFileWriter
    from actors.qos.profile import QoSProfile

    _Publisher: TypeAlias = tuple[int, Hashable]
    """The number of a topic, and what identifies a publisher of it."""
    _Message: TypeAlias = tuple[bytes, int, int]
    """The data, the publish time, and the publisher's number for it."""

MIN_BAG_SIZE: Final = 1024
"""Least value of max_bag_size, as in rosbag2."""
MAX_LATCHED: Final = 10_000
MAX_LATCHED_BYTES: Final = 64 * 1024 * 1024
"""Limits for the latched messages, and their bytes, that each file repeats at its start: the newest."""
MAX_KEEP_ALL: Final = 1000
"""Messages that each file repeats of a KEEP_ALL publisher, as many as that keeps for a broker's restart."""


class _Latched:
    """The newest messages of each publisher of a latched topic.

    At a limit, the oldest go, but the newest of a publisher only after all that are not: a flood of events
    must not cost the map.

    Args:
        max_bytes: Limit for the bytes of all messages, except where each publisher has only its newest left:
            then it is `MAX_LATCHED_BYTES`.
    """

    def __init__(self, max_bytes: int) -> None:
        self._max_bytes = max_bytes
        self._newest: dict[_Publisher, tuple[int, _Message]] = {}
        self._former: dict[int, tuple[_Publisher, _Message]] = {}
        """Older messages by order of arrival, in the order in which newer ones took their places."""
        self._orders: defaultdict[_Publisher, deque[int]] = defaultdict(deque)
        """The keys of a publisher's messages in `_former`, oldest first."""
        self._arrived = self._bytes = 0

    def keep(self, publisher: _Publisher, message: _Message, depth: int) -> None:
        """Add a message.

        Args:
            publisher: The number of its topic, and the publisher's key.
            message: The message.
            depth: Number of the publisher's messages to keep.
        """
        replaced = self._newest.pop(publisher, None)
        if replaced is not None:
            order, former = replaced
            self._former[order] = (publisher, former)
            orders = self._orders[publisher]
            orders.append(order)
            if len(orders) >= depth:
                self._drop(orders[0])
        self._arrived += 1
        self._newest[publisher] = (self._arrived, message)
        self._bytes += len(message[0])
        while len(self._newest) + len(self._former) > MAX_LATCHED or self._bytes > (
            self._max_bytes if self._former else MAX_LATCHED_BYTES
        ):
            if self._former:
                self._drop(next(iter(self._former)))
            else:
                oldest = next(iter(self._newest))
                self._bytes -= len(self._newest.pop(oldest)[1][0])

    def _drop(self, order: int) -> None:
        publisher, message = self._former.pop(order)
        self._bytes -= len(message[0])
        orders = self._orders[publisher]
        orders.popleft()
        if not orders:
            del self._orders[publisher]

    def items(self) -> list[tuple[int, _Message]]:
        """Return the messages with the numbers of their topics, in order of arrival."""
        found = [(order, key[0], message) for key, (order, message) in self._newest.items()]
        found += [(order, key[0], message) for order, (key, message) in self._former.items()]
        return [(number, message) for _, number, message in sorted(found, key=itemgetter(0))]


@dataclass
class _Topic:
    topic: BagTopic
    latched_depth: int
    """Messages of each publisher that a file repeats at its start; 0 if the topic is not latched."""
    channel: int
    """Its number in the file that is being written."""


@dataclass
class _ClosedFile:
    summary: FileSummary
    counts: dict[int, int]
    """Messages by topic number."""


class Writer:
    """Writes a new bag; a context manager.

    Args:
        path: The folder, which must not exist. Its files are named after it.
        max_bag_size: Size in bytes at which a new file starts; 0 for never.
        max_bag_duration_sec: Seconds of log time after which a new file starts; 0 for never.
        max_splits: Number of files to keep: when another one starts, the oldest is deleted; 0 for all.
        compression: Compression of chunks: "none", "zstd" or "lz4".
        chunk_size: Size in bytes at which a chunk is written; None for rosbag2's default.
        fsync: Whether to sync each chunk to the disk, so that it survives a power loss.
        custom_data: Strings for metadata.yaml, by name.

    Attributes:
        path: The folder.
        reordered: Number of messages whose log time was before that of the preceding message. They get the
            preceding time, since some readers fail if time goes back.
        files: Number of finished files, including those that `max_splits` has deleted.

    Raises:
        BagExistsError: `path` exists.
        BagWriteError: The folder cannot be created.
        MissingExtraError: The extra `bags` is not installed.
        InvalidBagOptionError: A limit or the compression is invalid.
    """

    def __init__(
        self,
        path: str | Path,
        *,
        max_bag_size: int = 0,
        max_bag_duration_sec: float = 0,
        max_splits: int = 0,
        compression: str = "none",
        chunk_size: int | None = None,
        fsync: bool = False,
        custom_data: Mapping[str, str] | None = None,
    ) -> None:
        require_extra()
        check_file_limits(max_bag_size, max_bag_duration_sec, max_splits)
        self.path = Path(path)
        self._max_bytes = max_bag_size
        self._max_ns = round(max_bag_duration_sec * NANOSECONDS_PER_SECOND)
        self._max_splits = max_splits
        self._options: dict[str, Any] = {"compression": compression, "fsync": fsync}
        if chunk_size is not None:
            self._options["chunk_size"] = chunk_size
        self._custom_data = dict(custom_data or {})
        self._losses: dict[str, int] = {}
        self._refused: defaultdict[str, int] = defaultdict(int)
        """Messages that could not be written because the next file could not be started, by topic."""
        self._details: dict[str, Any] = {}
        self._topics: list[_Topic] = []
        self._numbers: dict[tuple[str, str, str], int] = {}
        # Half of a file: if messages that are repeated filled it, each message would start another one.
        self._latched = _Latched(min(MAX_LATCHED_BYTES, max_bag_size // 2 or MAX_LATCHED_BYTES))
        self._closed: list[_ClosedFile] = []
        self.files = 0
        self.reordered = 0
        self._last_ns = 0
        self._file_start_ns: int | None = None
        self._is_closed = self._is_file_finished = False
        try:
            self.path.mkdir(parents=True)
        except FileExistsError:
            raise BagExistsError(f"{self.path} exists; choose another path, or remove it") from None
        except OSError as error:
            raise write_error(self.path, error) from error
        self._file = self._open_file()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    @property
    def topics(self) -> list[BagTopic]:
        """The topics in the order of their numbers; the first has the number 0."""
        return [each.topic for each in self._topics]

    @property
    def file(self) -> Path:
        """The path of the file that is being written."""
        return self._file.path

    def _open_file(self) -> McapFileWriter:
        from actors.bags.storage.mcap_writer import McapFileWriter  # noqa: PLC0415 - needs the extra

        return McapFileWriter(self.path / f"{self.path.name}_{self.files}.mcap", **self._options)

    def add_topic(self, topic: BagTopic) -> int:
        """Add a topic; return its number.

        Args:
            topic: The topic. Adding one with the same name, type and definition again returns its number.

        Raises:
            BagError: There are too many topics.
        """
        number = self._numbers.get(topic.key)
        if number is None:
            number = self._numbers[topic.key] = len(self._topics)
            depth = max(map(_latched_depth, topic.qos_profiles), default=0)
            self._topics.append(_Topic(topic, depth, self._file.add_topic(topic)))
        return number

    def write(
        self,
        number: int,
        data: bytes,
        log_time_ns: int,
        publish_time_ns: int,
        sequence: int = 0,
        *,
        latched_key: Hashable = None,
    ) -> None:
        """Write a message.

        Args:
            number: The topic's number.
            data: The message, CDR with its header. It must not change until its chunk is written.
            log_time_ns: Time of reception, in nanoseconds since 1970.
            publish_time_ns: Time of publication, in nanoseconds since 1970.
            sequence: The publisher's number for the message.
            latched_key: Identifies the publisher, such as by its gid. On a TRANSIENT_LOCAL topic, each file
                starts with the newest messages of each key: as many as the topic's greatest offered depth, or
                `MAX_KEEP_ALL`. None: do not repeat this message.

        Raises:
            BagWriteError: A file could not be written. Close the bag then.
        """
        if log_time_ns < self._last_ns:
            self.reordered += 1
            log_time_ns = self._last_ns
        self._last_ns = log_time_ns
        if self._file_start_ns is None:
            self._file_start_ns = log_time_ns
        elif (self._max_bytes and self._file.size >= self._max_bytes) or (
            self._max_ns and log_time_ns - self._file_start_ns >= self._max_ns
        ):
            try:
                self.split()
            except BaseException:
                self._refused[self._topics[number].topic.name] += 1
                raise
            self._file_start_ns = log_time_ns
        topic = self._topics[number]
        if latched_key is not None and topic.latched_depth:
            message = bytes(data), publish_time_ns, sequence
            self._latched.keep((number, latched_key), message, topic.latched_depth)
        self._file.write(topic.channel, data, log_time_ns, publish_time_ns, sequence)

    def flush(self) -> None:
        """Close the open chunk and hand it to the operating system.

        Raises:
            BagWriteError: It could not be written.
        """
        self._file.flush()

    def split(self) -> None:
        """Finish the file, and start the next one with the latched messages.

        Raises:
            BagWriteError: A file could not be written.
        """
        self._finish_file()
        self._write_metadata()
        if self._max_splits and len(self._closed) >= self._max_splits:
            oldest = self._closed.pop(0)
            (self.path / oldest.summary.path).unlink(missing_ok=True)
        self._file = self._open_file()
        self._is_file_finished = False
        self._file_start_ns = None
        for each in self._topics:
            each.channel = self._file.add_topic(each.topic)
        for number, (data, publish_time_ns, sequence) in self._latched.items():
            self._file.write(self._topics[number].channel, data, self._last_ns, publish_time_ns, sequence)
            self._file_start_ns = self._last_ns

    def set_losses(self, losses: Mapping[str, int], details: Mapping[str, Any] | None = None) -> None:
        """Set the counts of lost messages that the bag states; `callboard bag info` shows them.

        Args:
            losses: Number of messages that were not recorded, by topic.
            details: Further details by topic, for metadata.yaml: data that JSON can represent.
        """
        self._losses = dict(losses)
        self._details = dict(details or {})

    def lost(self) -> dict[str, int]:
        """Return the number of messages that `write` accepted and that could not be written, by topic."""
        numbers = {each.channel: each.topic.name for each in self._topics}
        found = defaultdict(int, self._refused)
        for channel, count in self._file.lost.items():
            found[numbers[channel]] += count
        return dict(found)

    def close(self) -> None:
        """Finish the bag; a second call does nothing.

        Raises:
            BagWriteError: A part could not be written. The rest is a complete bag nevertheless.
        """
        if self._is_closed:
            return
        self._is_closed = True
        try:
            self._finish_file()
        finally:
            self._write_metadata()

    def _finish_file(self) -> None:
        """Close the file, and keep its summary; do nothing if that has been tried, even if it failed."""
        if self._is_file_finished:
            return
        self._is_file_finished = True
        file = self._file
        try:
            file.flush()
            # For readers of a single file. Topics without messages appear in no other record of the file.
            text = block_text(metadata_fields(self._metadata([self._summary_of(file)])))
            file.add_metadata("rosbag2", {"serialized_metadata": text})
            if self._all_losses():
                file.add_metadata(
                    DROPPED_KEY, {name: str(count) for name, count in self._all_losses().items()}
                )
        finally:
            try:
                file.close()
            finally:
                self._closed.append(self._summary_of(file))
                self.files += 1

    def _summary_of(self, file: McapFileWriter) -> _ClosedFile:
        numbers = {each.channel: number for number, each in enumerate(self._topics)}
        counts = {numbers[channel]: count for channel, count in file.counts.items() if count}
        count = sum(counts.values())
        duration = file.end_ns - file.start_ns
        return _ClosedFile(FileSummary(file.path.name, file.start_ns, duration, count), counts)

    def _all_losses(self) -> dict[str, int]:
        losses = defaultdict(int, self._losses)
        for name, count in self.lost().items():
            losses[name] += count
        return {name: count for name, count in losses.items() if count}

    def _metadata(self, files: list[_ClosedFile]) -> BagMetadata:
        counts: defaultdict[int, int] = defaultdict(int)
        for each in files:
            for number, count in each.counts.items():
                counts[number] += count
        filled = [each.summary for each in files if each.summary.message_count]
        start = min((each.start_ns for each in filled), default=0)
        end = max((each.start_ns + each.duration_ns for each in filled), default=0)
        custom_data = dict(self._custom_data)
        if losses := self._all_losses():
            custom_data[DROPPED_KEY] = json.dumps(losses)
        if self._details:
            custom_data[LOSSES_KEY] = json.dumps(self._details)
        return BagMetadata(
            version=VERSION,
            storage_identifier="mcap",
            files=tuple(each.summary for each in files),
            topics=tuple(TopicCount(each.topic, counts[number]) for number, each in enumerate(self._topics)),
            start_ns=start,
            duration_ns=end - start,
            message_count=sum(counts.values()),
            custom_data=custom_data,
        )

    def _write_metadata(self) -> None:
        write_metadata(self.path, self._metadata(self._closed))


def _latched_depth(offered: QoSProfile) -> int:
    """Return how many messages a publisher keeps for late joiners."""
    if offered.durability is not DurabilityPolicy.TRANSIENT_LOCAL:
        return 0
    # Bags of ROS 2 state a depth of 0 where it was unknown.
    return MAX_KEEP_ALL if offered.history is HistoryPolicy.KEEP_ALL else max(1, offered.depth)


def check_file_limits(max_bag_size: int, max_bag_duration_sec: float, max_splits: int) -> None:
    """Raise InvalidBagOptionError if a limit for the files of a bag is out of range; see `Writer`."""
    if max_bag_size < 0 or 0 < max_bag_size < MIN_BAG_SIZE:
        raise InvalidBagOptionError(
            f"max_bag_size must be 0 or at least {MIN_BAG_SIZE} bytes, not {max_bag_size}", "max_bag_size"
        )
    if not (max_bag_duration_sec >= 0 and max_splits >= 0):
        raise InvalidBagOptionError(
            "max_bag_duration_sec and max_splits cannot be negative", "max_bag_duration_sec", "max_splits"
        )


def write_metadata(folder: Path, metadata: BagMetadata) -> None:
    """Write metadata.yaml into the folder of a bag, replacing an existing one.

    Args:
        folder: The folder.
        metadata: The values.

    Raises:
        BagWriteError: It could not be written; an existing one is unchanged.
    """
    path = folder / FILE_NAME
    part = path.with_name(f"{FILE_NAME}.part")
    try:
        part.write_text(metadata_text(metadata), encoding="utf-8")
        part.replace(path)
    except OSError as error:
        raise write_error(path, error) from error

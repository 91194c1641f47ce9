"""Reads a bag: a folder of rosbag2, or a single file.

    with Reader("trip") as bag:
        for message in bag.messages(topics=["/imu"]):
            print(message.log_time_ns, message.decoded())

    async for message in Reader("trip"):
        ...

A reader blocks while it reads; `async for` reads in a thread. What is damaged raises InvalidBagError with the
file and the place. Of a file whose end is missing, all whole chunks are read, and the summary says so.
"""

from __future__ import annotations

import asyncio
import heapq
import json
import re
from collections import Counter
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Final, cast

from actors.bags.errors import BagNotFoundError, InvalidBagError
from actors.bags.extra import require_extra
from actors.bags.files import MAX_MESSAGE_BYTES, Filter, Order, open_regular
from actors.bags.metadata import FILE_NAME, MAX_BYTES, parse_metadata
from actors.bags.records import FileSummary, TopicCount
from actors.bags.writer import DROPPED_KEY

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Collection, Iterator, Mapping
    from types import TracebackType
    from typing import Self

    from actors.bags.files import BagFile, FileContents
    from actors.bags.records import BagMessage, BagMetadata, BagTopic

MAX_FILES: Final = 100_000
"""Files of a bag."""
MAX_REORDERED: Final = 100_000
MAX_REORDERED_BYTES: Final = 64 * 1024 * 1024
"""Messages that are held so that they come by their publish times, and their bytes."""
_BATCH: Final = 100
"""Messages that `async for` reads at once in a thread."""
_SUFFIXES: Final = (".mcap", ".db3", ".mcap.zstd", ".db3.zstd")
_DIGITS: Final = re.compile(r"(\d+)")


@dataclass(frozen=True)
class BagSummary:
    """What a bag has.

    Attributes:
        path: The bag.
        files: Its files, with what each has.
        size: Bytes of its files.
        storage_identifier: "mcap" or "sqlite3".
        topics: Its topics, and the number of messages of each.
        start_ns: Log time of the first message; 0 if there is none.
        duration_ns: From the first to the last message.
        message_count: All messages.
        compression_format: Such as "zstd", if files or messages are compressed; "" otherwise.
        compression_mode: "file", "message" or "".
        custom_data: What the one who recorded it has added.
        ros_distro: The distribution of ROS 2, "callboard", or "".
        version: Of metadata.yaml; 0 if there is none.
        dropped: Messages that were lost while it was recorded, by topic, if callboard has recorded it.
        problems: What cannot be read of it, each in one sentence.
    """

    path: Path
    files: tuple[FileSummary, ...]
    size: int
    storage_identifier: str
    topics: tuple[TopicCount, ...]
    start_ns: int = 0
    duration_ns: int = 0
    message_count: int = 0
    compression_format: str = ""
    compression_mode: str = ""
    custom_data: Mapping[str, str] = field(default_factory=dict[str, str])
    ros_distro: str = ""
    version: int = 0
    dropped: Mapping[str, int] = field(default_factory=dict[str, int])
    problems: tuple[str, ...] = ()

    @property
    def end_ns(self) -> int:
        """Log time of the last message."""
        return self.start_ns + self.duration_ns


class Reader:
    """Reads a bag; a context manager, and an asynchronous iterator over its messages.

    Args:
        path: The folder of a bag, with or without metadata.yaml, or a file of one.
        max_chunk_bytes: The most bytes of a chunk after decompression, and of a message.
        believe_metadata: Whether metadata.yaml says which files there are, and from when to when; otherwise
            the folder's files do, and only what they cannot say is taken from it.
        salvage: Whether to give all that is whole of damaged MCAP files; each is read as a whole first.

    Attributes:
        path: As given.
        damages: What is damaged of the files that have been opened, with `salvage`.

    Raises:
        BagError: It cannot be read.
        BagNotFoundError: There is no bag.
        InvalidBagError: Its metadata.yaml is damaged.
        MissingExtraError: The extra `bags` is not installed.
    """

    def __init__(
        self,
        path: str | Path,
        *,
        max_chunk_bytes: int = MAX_MESSAGE_BYTES,
        salvage: bool = False,
        believe_metadata: bool = True,
    ) -> None:
        require_extra()
        self.path = Path(path)
        self._max_chunk_bytes = max_chunk_bytes
        self._salvage = salvage
        self._believes = believe_metadata
        self.damages: dict[Path, list[str]] = {}
        self._metadata: BagMetadata | None = None
        self._problems: list[str] = []
        self._paths = self._find_files()
        self._files: dict[Path, BagFile] = {}
        self._contents: dict[Path, FileContents] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close its files; iterators over its messages end."""
        while self._files:
            self._files.popitem()[1].close()

    @property
    def metadata(self) -> BagMetadata | None:
        """What metadata.yaml says; None if there is none."""
        return self._metadata

    @property
    def paths(self) -> list[Path]:
        """Its files, in order."""
        return list(self._paths)

    def _find_files(self) -> list[Path]:
        if not self.path.is_dir():
            return [self.path]
        file = self.path / FILE_NAME
        if file.exists():
            try:
                with open_regular(file) as opened:
                    self._metadata = parse_metadata(opened.read(MAX_BYTES + 1), str(file))
            except InvalidBagError:
                if self._believes:
                    raise
        if self._metadata is not None and self._believes:
            paths = [self.path / each.path for each in self._metadata.files]
        elif not self._believes:
            paths = self._found_files()
        else:
            self._problems.append(
                f"{file} is missing: its recorder was killed; callboard bag reindex {self.path} writes it"
            )
            paths = self._found_files()
        if len(paths) > MAX_FILES:
            raise InvalidBagError(file, "", f"it names {len(paths):,} files; at most {MAX_FILES:,} are read")
        return paths

    def _found_files(self) -> list[Path]:
        paths = sorted((each for each in self.path.iterdir() if _is_bag_file(each)), key=_natural)
        if not paths:
            raise BagNotFoundError(f"{self.path} is no bag: it has neither {FILE_NAME} nor files of a bag")
        return paths

    def open_file(self, path: Path) -> BagFile:
        """Return a file of the bag, open; `close` closes it.

        Args:
            path: One of `paths`.

        Raises:
            BagError: As for the class.
        """
        found = self._files.get(path)
        if found is None:
            from actors.bags.mcap_reader import McapFile  # noqa: PLC0415 - needs the extra

            mode = "" if self._metadata is None else self._metadata.compression_mode
            found = self._files[path] = _open(
                path, self._max_chunk_bytes, messages_compressed=mode == "message"
            )
            if self._salvage and isinstance(found, McapFile):
                self.damages[path] = found.salvage()
        return found

    def contents_of(self, path: Path) -> FileContents:
        """Return what a file of the bag has.

        Args:
            path: One of `paths`.

        Raises:
            BagError: As for the class.
        """
        if path not in self._contents:
            was_open = path in self._files
            self._contents[path] = self.open_file(path).contents()
            if not was_open and len(self._paths) > 1:
                # A bag may have more files than a process.
                self._files.pop(path).close()
        return self._contents[path]

    @property
    def topics(self) -> tuple[BagTopic, ...]:
        """Its topics, with their definitions."""
        return tuple(each.topic for each in self._counted())

    def _counted(self) -> tuple[TopicCount, ...]:
        """Return the topics of all files, and of metadata.yaml, each once."""
        counts: Counter[BagTopic] = Counter()
        for path in self._paths:
            for each in self.contents_of(path).topics:
                counts[each.topic] += each.message_count
        known = {(topic.name, topic.type_name) for topic in counts}
        for each in () if self._metadata is None or not self._believes else self._metadata.topics:
            if (each.topic.name, each.topic.type_name) not in known:  # without messages
                counts[each.topic] += 0
        return tuple(TopicCount(topic, count) for topic, count in counts.items())

    def summary(self, *, quick: bool = True) -> BagSummary:
        """Return what the bag has.

        Args:
            quick: Believe metadata.yaml, if there is one; otherwise what the files have counts.

        Raises:
            BagError: As for the class.
        """
        metadata = self._metadata
        if metadata is not None and quick and (metadata.version >= 5 or not metadata.files):
            return self._stated(metadata)
        files: list[FileSummary] = []
        problems = list(self._problems)
        custom_data: dict[str, str] = dict(metadata.custom_data) if metadata else {}
        dropped: Counter[str] = Counter()
        for path in self._paths:
            contents = self.contents_of(path)
            duration_ns = contents.end_ns - contents.start_ns
            files.append(FileSummary(path.name, contents.start_ns, duration_ns, contents.message_count))
            if contents.problem:
                problems.append(f"{path}: {contents.problem}")
            dropped.update(_counts(dict(contents.metadata.get(DROPPED_KEY, {}))))
        filled = [each for each in files if each.message_count]
        start_ns = min((each.start_ns for each in filled), default=0)
        end_ns = max((each.start_ns + each.duration_ns for each in filled), default=0)
        return BagSummary(
            path=self.path,
            files=tuple(files),
            size=sum(self.contents_of(path).size for path in self._paths),
            storage_identifier="sqlite3" if ".db3" in self._paths[0].suffixes else "mcap",
            topics=self._counted(),
            start_ns=start_ns,
            duration_ns=end_ns - start_ns,
            message_count=sum(each.message_count for each in files),
            compression_format=metadata.compression_format if metadata else "",
            compression_mode=metadata.compression_mode if metadata else "",
            custom_data=custom_data,
            ros_distro=metadata.ros_distro if metadata else "",
            version=metadata.version if metadata else 0,
            dropped=dict(dropped),
            problems=tuple(problems),
        )

    def _stated(self, metadata: BagMetadata) -> BagSummary:
        size, problems = 0, list(self._problems)
        for path in self._paths:
            try:
                size += path.stat().st_size
            except OSError as error:
                problems.append(f"{path}: {error.strerror}")
        return BagSummary(
            path=self.path,
            files=metadata.files,
            size=size,
            storage_identifier=metadata.storage_identifier,
            topics=metadata.topics,
            start_ns=metadata.start_ns,
            duration_ns=metadata.duration_ns,
            message_count=metadata.message_count,
            compression_format=metadata.compression_format,
            compression_mode=metadata.compression_mode,
            custom_data=metadata.custom_data,
            ros_distro=metadata.ros_distro,
            version=metadata.version,
            dropped=_stated_losses(metadata.custom_data),
            problems=tuple(problems),
        )

    def messages(
        self,
        topics: Collection[str] | None = None,
        start_ns: int | None = None,
        end_ns: int | None = None,
        order: Order | str = Order.LOG,
    ) -> Iterator[BagMessage]:
        """Yield messages.

        Args:
            topics: Names of topics; None: all.
            start_ns: The least log time; None: all.
            end_ns: The greatest log time; None: all.
            order: "log": by the time when they were received; "publish": by the time when they were
                published, as far as at most `MAX_REORDERED` messages are late; "file": as they are in the
                files.

        Raises:
            BagError: As for the class; what comes before the damage has been yielded then.
        """
        chosen = Filter(None if topics is None else frozenset(topics), start_ns, end_ns)
        order = Order(order)
        if order is Order.FILE:
            return self._one_by_one(chosen, order)
        merged = self._merged(chosen)
        return _by_publish_time(merged) if order is Order.PUBLISH else merged

    def _one_by_one(self, chosen: Filter, order: Order) -> Iterator[BagMessage]:
        for path in self._paths:
            yield from self._of_file(path, chosen, order)

    def _of_file(self, path: Path, chosen: Filter, order: Order) -> Iterator[BagMessage]:
        yield from self.open_file(path).messages(chosen, order)
        if len(self._paths) > 1 and path in self._files:
            self._files.pop(path).close()

    def _merged(self, chosen: Filter) -> Iterator[BagMessage]:
        """Yield the messages of all files by log time; a file is opened when its first message is due."""
        waiting: list[tuple[int, int, Path]] = []
        for number, path in enumerate(self._paths):
            start_ns, end_ns, count = self._span(path)
            if count and chosen.overlaps(start_ns, end_ns):
                waiting.append((start_ns, number, path))
        waiting.sort()
        heap: list[tuple[int, int, BagMessage, Iterator[BagMessage]]] = []
        while waiting or heap:
            while waiting and (not heap or waiting[0][0] <= heap[0][0]):
                _, number, path = waiting.pop(0)
                messages = self._of_file(path, chosen, Order.LOG)
                first = next(messages, None)
                if first is not None:
                    heapq.heappush(heap, (first.log_time_ns, number, first, messages))
            if not heap:
                return
            _, number, message, messages = heapq.heappop(heap)
            limits = [each[0] for each in heap[:1]] + [each[0] for each in waiting[:1]]
            yield message
            following = None
            if not limits:
                yield from messages
            for following in messages:
                if limits and following.log_time_ns > min(limits):
                    break
                yield following
            else:
                continue
            heapq.heappush(heap, (following.log_time_ns, number, following, messages))

    def _span(self, path: Path) -> tuple[int, int, int]:
        """Return the times of a file's first and last message, and how many it has."""
        for each in () if self._metadata is None or not self._believes else self._metadata.files:
            if each.path == path.name and each.message_count:
                return each.start_ns, each.start_ns + each.duration_ns, each.message_count
        contents = self.contents_of(path)
        return contents.start_ns, contents.end_ns, contents.message_count

    async def __aiter__(self) -> AsyncIterator[BagMessage]:
        messages = self.messages()
        while batch := await asyncio.to_thread(_take, messages):
            for message in batch:
                yield message


def _take(messages: Iterator[BagMessage]) -> list[BagMessage]:
    return list(islice(messages, _BATCH))


def _is_bag_file(path: Path) -> bool:
    return path.name.endswith(_SUFFIXES) and path.is_file()


def _natural(path: Path) -> list[tuple[bool, int, str]]:
    """Return a key by which bag_2 comes before bag_10."""
    parts = _DIGITS.split(path.name)
    return [(each.isdecimal(), int(each[:18]) if each.isdecimal() else 0, each) for each in parts]


def _open(path: Path, max_chunk_bytes: int, *, messages_compressed: bool) -> BagFile:
    """Open a file by its first bytes."""
    from actors.bags import mcap_frames, mcap_reader, sqlite  # noqa: PLC0415 - needs the extra
    from actors.bags.compressed import ZSTD_MAGIC, CompressedMessages, decompressed_file  # noqa: PLC0415

    with open_regular(path) as file:
        first = file.read(16)
    opened: BagFile
    if first.startswith(ZSTD_MAGIC):
        opened = decompressed_file(
            path, lambda inner: _open(inner, max_chunk_bytes, messages_compressed=False)
        )
    elif first.startswith(mcap_frames.MAGIC):
        opened = mcap_reader.McapFile(path, max_chunk_bytes=max_chunk_bytes)
    elif first.startswith(sqlite.MAGIC):
        opened = sqlite.SqliteFile(path)
    else:
        what = "it is empty" if not first else "it is neither an MCAP nor a SQLite file"
        raise InvalidBagError(
            path, "", f"{what}; callboard bag info takes the folder of a bag, or such a file"
        )
    return CompressedMessages(opened, max_chunk_bytes) if messages_compressed else opened


def _by_publish_time(messages: Iterator[BagMessage]) -> Iterator[BagMessage]:
    """Yield messages by publish time, holding back a limited number."""
    heap: list[tuple[int, int, BagMessage]] = []
    held = 0
    for number, message in enumerate(messages):
        heapq.heappush(heap, (message.publish_time_ns, number, message))
        held += len(message.data)
        while len(heap) > MAX_REORDERED or held > MAX_REORDERED_BYTES:
            first = heapq.heappop(heap)[2]
            held -= len(first.data)
            yield first
    while heap:
        yield heapq.heappop(heap)[2]


def _stated_losses(custom_data: Mapping[str, str]) -> dict[str, int]:
    try:
        losses: object = json.loads(custom_data.get(DROPPED_KEY, "{}"))
    except (ValueError, RecursionError):
        return {}
    return _counts(cast("dict[str, object]", losses)) if isinstance(losses, dict) else {}


def _counts(losses: Mapping[str, object]) -> dict[str, int]:
    """Return numbers of lost messages; the file may say anything."""
    texts = {name: str(count) for name, count in losses.items()}
    return {name: int(text) for name, text in texts.items() if text.isdecimal() and len(text) < 19}

"""Reads a bag: a folder of rosbag2, or a single file.

    with Reader("trip") as bag:
        for message in bag.messages(topics=["/imu"]):
            print(message.log_time_ns, message.decoded())

    async for message in Reader("trip"):
        ...

A reader blocks while it reads; `async for` reads in a thread. Damage raises InvalidBagError with the file and
the place. If the end of a file is missing, all whole chunks are read, and the summary names the problem.
"""

from __future__ import annotations

import asyncio
import heapq
import json
import re
from collections import Counter
from dataclasses import dataclass, field, replace
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Final, cast

from actors.bags.contents.metadata import DROPPED_KEY, FILE_NAME, MAX_BYTES, parse_metadata
from actors.bags.contents.records import BagMetadata, FileSummary, TopicCount
from actors.bags.errors import BagNotFoundError, InvalidBagError
from actors.bags.extra import require_extra
from actors.bags.storage.bag_file import MAX_MESSAGE_BYTES, Filter, Order, open_regular

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Collection, Iterator, Mapping
    from types import TracebackType
    from typing import Self

    from actors.bags.contents.records import BagMessage, BagTopic
    from actors.bags.storage.bag_file import BagFile, FileContents

MAX_FILES: Final = 100_000
"""Limit for the files of a bag."""
MAX_REORDERED: Final = 100_000
MAX_REORDERED_BYTES: Final = 64 * 1024 * 1024
"""Limits for the messages, and their bytes, that are held back to sort them by publish time."""
_BATCH: Final = 100
"""Messages that `async for` reads in a thread at once: for single ones, the thread would cost too much."""
_SUFFIXES: Final = (".mcap", ".db3", ".mcap.zstd", ".db3.zstd")
_DIGITS: Final = re.compile(r"(\d+)")


@dataclass(frozen=True, kw_only=True)
class BagSummary(BagMetadata):
    """A summary of a bag: the values of metadata.yaml, and what only its files tell.

    Without metadata.yaml, its version is 0, and the other values are taken from the files.

    Attributes:
        path: The bag.
        size: Size of all files in bytes.
        dropped: Number of messages that were lost while callboard recorded, by topic.
        problems: What cannot be read, each problem in one sentence.
    """

    path: Path
    size: int
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
        max_chunk_bytes: Limit for a chunk after decompression, and for a message.
        believe_metadata: Whether to take the names and times of files from metadata.yaml. If False, they are
            taken from the files in the folder, and metadata.yaml only adds what these do not contain.
        salvage: Whether to read all whole chunks of damaged MCAP files, which reads each file completely
            before its first message.

    Attributes:
        path: As given.
        damages: With `salvage`, the damages found so far, by file.
        current_path: The file of the newest message; None before the first one. If the times of files
            overlap, the file that was opened last.

    Raises:
        BagError: It cannot be read.
        BagNotFoundError: There is no bag at the path.
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
        self.current_path: Path | None = None
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
        """Close its files. Iterators over its messages cannot be used any more."""
        while self._files:
            self._files.popitem()[1].close()

    @property
    def metadata(self) -> BagMetadata | None:
        """The values of metadata.yaml; None if the file is missing."""
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
                f"{file} is missing, as after a kill; to write it: callboard bag reindex {self.path}"
            )
            paths = self._found_files()
        if len(paths) > MAX_FILES:
            raise InvalidBagError(file, "", f"it has {len(paths):,} files; the limit is {MAX_FILES:,}")
        return paths

    def _found_files(self) -> list[Path]:
        paths = sorted((each for each in self.path.iterdir() if _is_bag_file(each)), key=_natural)
        if not paths:
            raise BagNotFoundError(f"{self.path} is not a bag: it has no {FILE_NAME}, .mcap or .db3 file")
        return paths

    def open_file(self, path: Path) -> BagFile:
        """Open a file of the bag, if it is not open yet, and return it; `close` closes it.

        Args:
            path: One of `paths`.

        Raises:
            BagError: As for the class.
        """
        found = self._files.get(path)
        if found is None:
            from actors.bags.storage.mcap_reader import McapFile  # noqa: PLC0415 - needs the extra

            mode = "" if self._metadata is None else self._metadata.compression_mode
            found = self._files[path] = _open(
                path, self._max_chunk_bytes, messages_compressed=mode == "message"
            )
            if self._salvage and isinstance(found, McapFile):
                self.damages[path] = found.salvage()
        return found

    def contents_of(self, path: Path) -> FileContents:
        """Return a summary of a file of the bag.

        Args:
            path: One of `paths`.

        Raises:
            BagError: As for the class.
        """
        if path not in self._contents:
            was_open = path in self._files
            self._contents[path] = self.open_file(path).contents()
            if not was_open and len(self._paths) > 1:
                # A bag may have more files than a process may have open.
                self._files.pop(path).close()
        return self._contents[path]

    @property
    def topics(self) -> tuple[BagTopic, ...]:
        """Its topics, with their definitions."""
        return tuple(each.topic for each in self._counted())

    def _counted(self) -> tuple[TopicCount, ...]:
        """Return the topics of all files and of metadata.yaml, each once."""
        counts: Counter[BagTopic] = Counter()
        for path in self._paths:
            for each in self.contents_of(path).topics:
                counts[each.topic] += each.message_count
        known = {(topic.name, topic.type_name) for topic in counts}
        for each in () if self._metadata is None or not self._believes else self._metadata.topics:
            if (each.topic.name, each.topic.type_name) not in known:  # a topic without messages
                counts[each.topic] += 0
        return tuple(TopicCount(topic, count) for topic, count in counts.items())

    def summary(self, *, quick: bool = True) -> BagSummary:
        """Return a summary of the bag.

        Args:
            quick: Whether to take it from metadata.yaml, if there is one, rather than from the files.

        Raises:
            BagError: As for the class.
        """
        metadata = self._metadata
        if metadata is not None and quick and (metadata.version >= 5 or not metadata.files):
            return self._stated(metadata)
        files: list[FileSummary] = []
        problems = list(self._problems)
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
        found = replace(
            metadata or BagMetadata(version=0, storage_identifier=""),
            storage_identifier="sqlite3" if ".db3" in self._paths[0].suffixes else "mcap",
            files=tuple(files),
            topics=self._counted(),
            start_ns=start_ns,
            duration_ns=end_ns - start_ns,
            message_count=sum(each.message_count for each in files),
        )
        return BagSummary(
            **vars(found),
            path=self.path,
            size=sum(self.contents_of(path).size for path in self._paths),
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
            **vars(metadata),
            path=self.path,
            size=size,
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
            topics: Names of topics; None for all.
            start_ns: Least log time; None for no limit.
            end_ns: Greatest log time; None for no limit.
            order: "log": by log time (reception); "publish": by publish time, as far as sorting
                `MAX_REORDERED` messages at a time allows; "file": as they are stored in the files.

        Raises:
            BagError: As for the class. Messages before the damage have been yielded by then.
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
        file = self.open_file(path)
        self.current_path = path
        yield from file.messages(chosen, order)
        if len(self._paths) > 1 and path in self._files:
            self._files.pop(path).close()

    def _merged(self, chosen: Filter) -> Iterator[BagMessage]:
        """Yield the messages of all files by log time. A file is opened when its first message is next."""
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
        """Return the log times of a file's first and last message, and the number of its messages."""
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
    """Return a sort key that puts bag_2 before bag_10."""
    parts = _DIGITS.split(path.name)
    return [(each.isdecimal(), int(each[:18]) if each.isdecimal() else 0, each) for each in parts]


def _open(path: Path, max_chunk_bytes: int, *, messages_compressed: bool) -> BagFile:
    """Open a file in the format that its first bytes show."""
    from actors.bags.storage import mcap_frames, mcap_reader, sqlite  # noqa: PLC0415 - needs the extra
    from actors.bags.storage.compressed import ZSTD_MAGIC, CompressedMessages, decompressed_file  # noqa: PLC0415

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
        raise InvalidBagError(path, "", f"{what}; expected the folder of a bag, or such a file")
    return CompressedMessages(opened, max_chunk_bytes) if messages_compressed else opened


def _by_publish_time(messages: Iterator[BagMessage]) -> Iterator[BagMessage]:
    """Yield messages by publish time; hold back a limited number to sort them."""
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
    """Return the numbers of lost messages; skip what is not a number, as a file may contain anything."""
    texts = {name: str(count) for name, count in losses.items()}
    return {name: int(text) for name, text in texts.items() if text.isdecimal() and len(text) < 19}

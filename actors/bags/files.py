"""What readers of files of bags have in common: what a file has, and how its messages are asked for."""

from __future__ import annotations

import os
import stat
from dataclasses import dataclass, field
from enum import Enum
from typing import IO, TYPE_CHECKING, Final, Protocol

from actors.bags.errors import BagError, BagNotFoundError, InvalidBagError

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    from actors.bags.records import BagMessage, BagTopic, TopicCount

MAX_MESSAGE_BYTES: Final = 512 * 1024 * 1024
"""Bytes of a message, and of a chunk of messages after decompression: the memory that reading takes."""
_WITHOUT_WAITING: Final = getattr(os, "O_NONBLOCK", 0)


class Order(Enum):
    """The order of messages."""

    LOG = "log"
    """By the time when they were received."""
    PUBLISH = "publish"
    """By the time when they were published."""
    FILE = "file"
    """As they are in the files."""


@dataclass(frozen=True)
class Filter:
    """Which messages are asked for.

    Attributes:
        topics: Names of topics; None: all.
        start_ns: The least log time; None: all.
        end_ns: The greatest log time; None: all.
    """

    topics: frozenset[str] | None = None
    start_ns: int | None = None
    end_ns: int | None = None

    def has_topic(self, topic: BagTopic) -> bool:
        """Return whether messages of a topic are asked for."""
        return self.topics is None or topic.name in self.topics

    def overlaps(self, start_ns: int, end_ns: int) -> bool:
        """Return whether messages between two times, both included, may be asked for."""
        return (self.start_ns is None or end_ns >= self.start_ns) and (
            self.end_ns is None or start_ns <= self.end_ns
        )


ALL: Final = Filter()
"""All messages."""


@dataclass(frozen=True)
class FileContents:
    """What a file has.

    Attributes:
        topics: Its topics, and the number of messages of each.
        start_ns: The time of the first message; 0 if there is none.
        end_ns: The time of the last.
        size: Its bytes.
        problem: Why not all of it can be read, such as that its end is missing; "" if it is whole.
        metadata: Metadata records by name.
    """

    topics: tuple[TopicCount, ...]
    start_ns: int
    end_ns: int
    size: int
    problem: str = ""
    metadata: Mapping[str, Mapping[str, str]] = field(default_factory=dict[str, "Mapping[str, str]"])

    @property
    def message_count(self) -> int:
        """All messages."""
        return sum(each.message_count for each in self.topics)


class BagFile(Protocol):
    """A file of a bag that is open for reading."""

    @property
    def path(self) -> Path:
        """Where it is."""
        ...

    def contents(self) -> FileContents:
        """Return what it has.

        Raises:
            InvalidBagError: Nothing of it can be read.
        """
        ...

    def messages(self, chosen: Filter, order: Order) -> Iterator[BagMessage]:
        """Yield its messages, in the order of the file or of log times.

        Raises:
            InvalidBagError: A part of the file is damaged.
        """
        ...

    def close(self) -> None:
        """Close it."""
        ...


def open_regular(path: Path) -> IO[bytes]:
    """Open a file for reading.

    Raises:
        BagError: It cannot be read.
        BagNotFoundError: It does not exist.
        InvalidBagError: It is no regular file.
    """

    def opener(name: str, flags: int) -> int:
        return os.open(name, flags | _WITHOUT_WAITING)

    try:
        file = open(path, "rb", opener=opener)  # noqa: SIM115 - Path.open has no opener
    except FileNotFoundError:
        raise BagNotFoundError(f"There is no file {path}") from None
    except OSError as error:
        raise BagError(f"{path}: {error.strerror or error}") from None
    if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
        file.close()
        raise InvalidBagError(path, "", "it is no regular file")
    return file

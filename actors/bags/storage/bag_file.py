"""The protocol of readers of a single file of a bag, and the data that they take and return."""

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

    from actors.bags.contents.records import BagMessage, BagTopic, TopicCount

MAX_MESSAGE_BYTES: Final = 512 * 1024 * 1024
"""Limit for a message, and for a chunk of messages after decompression: reading holds these in memory."""
_WITHOUT_WAITING: Final = getattr(os, "O_NONBLOCK", 0)


class Order(Enum):
    """The order of messages."""

    LOG = "log"
    """By their log times, when they were received."""
    PUBLISH = "publish"
    """By their publish times."""
    FILE = "file"
    """As they are stored in the files."""


@dataclass(frozen=True)
class Filter:
    """Which messages to read.

    Attributes:
        topics: Names of topics; None for all.
        start_ns: Least log time; None for no limit.
        end_ns: Greatest log time; None for no limit.
    """

    topics: frozenset[str] | None = None
    start_ns: int | None = None
    end_ns: int | None = None

    def has_topic(self, topic: BagTopic) -> bool:
        """Return whether to read messages of a topic."""
        return self.topics is None or topic.name in self.topics

    def overlaps(self, start_ns: int, end_ns: int) -> bool:
        """Return whether some of the messages between two times, both included, may be read."""
        return (self.start_ns is None or end_ns >= self.start_ns) and (
            self.end_ns is None or start_ns <= self.end_ns
        )


ALL: Final = Filter()
"""All messages."""


@dataclass(frozen=True)
class FileContents:
    """A summary of a file.

    Attributes:
        topics: Its topics, with the number of messages of each.
        start_ns: Log time of the first message; 0 if there is none.
        end_ns: Log time of the last message.
        size: Its size in bytes.
        problem: Why a part of it cannot be read, such as a missing end; "" if all of it can be.
        metadata: The values of its Metadata records, by the names of the records.
    """

    topics: tuple[TopicCount, ...]
    start_ns: int
    end_ns: int
    size: int
    problem: str = ""
    metadata: Mapping[str, Mapping[str, str]] = field(default_factory=dict[str, "Mapping[str, str]"])

    @property
    def message_count(self) -> int:
        """Number of all messages."""
        return sum(each.message_count for each in self.topics)


class BagFile(Protocol):
    """A file of a bag that is open for reading."""

    @property
    def path(self) -> Path:
        """Its path."""
        ...

    def contents(self) -> FileContents:
        """Return a summary of it.

        Raises:
            InvalidBagError: No part of it can be read.
        """
        ...

    def messages(self, chosen: Filter, order: Order) -> Iterator[BagMessage]:
        """Yield its messages, in the order of the file or by log time.

        Raises:
            InvalidBagError: A part of the file is damaged.
        """
        ...

    def close(self) -> None:
        """Close it."""
        ...


def open_regular(path: Path) -> IO[bytes]:
    """Open a file for reading, without waiting if it is a pipe that nobody writes.

    Raises:
        BagError: It cannot be read.
        BagNotFoundError: It does not exist.
        InvalidBagError: It is not a regular file.
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
        raise InvalidBagError(path, "", "it is not a regular file")
    return file

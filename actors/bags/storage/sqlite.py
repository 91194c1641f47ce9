"""Reads one SQLite file of rosbag2 (`.db3`), in any version of its tables."""

from __future__ import annotations

import os
import sqlite3
import struct
from typing import TYPE_CHECKING, Any, Final

from actors.bags.contents.qos_lists import qos_profiles
from actors.bags.contents.records import BagMessage, BagTopic, TopicCount
from actors.bags.errors import InvalidBagError
from actors.bags.storage.bag_file import MAX_MESSAGE_BYTES, FileContents, Filter, Order, open_regular
from actors.interfaces.definition_texts import full_type_name
from actors.interfaces.yaml_reader import YamlError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path
    from typing import NoReturn

MAGIC: Final = b"SQLite format 3\0"
_HEAD_BYTES: Final = 100
_PAGE_BYTES: Final = struct.Struct(">H")
_PAGES: Final = struct.Struct(">I")
MAX_TOPICS: Final = 100_000
"""Limit for the topics, and for the definitions, of a file."""
_PLAIN_TABLE: Final = "create table"
_TIMES: Final = range(1 << 63)


class SqliteFile:
    """An open SQLite file: a `BagFile`.

    The file may come from anywhere: views and virtual tables, which could execute code, are refused, and its
    schema is not trusted.

    Args:
        path: The file.

    Attributes:
        path: The file.

    Raises:
        InvalidBagError: It is not a SQLite file of rosbag2.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        with open_regular(path) as file:
            head = file.read(_HEAD_BYTES)
            if not head.startswith(MAGIC):
                self._fail("this is not a SQLite file: it starts with other bytes")
            self._check_size(head, os.fstat(file.fileno()).st_size)
        # Immutable: SQLite then creates neither locks nor a log beside a file that belongs to somebody else.
        uri = f"{path.absolute().as_uri()}?mode=ro&immutable=1"
        try:
            self._connection = sqlite3.connect(uri, uri=True, check_same_thread=False)
        except sqlite3.Error as error:
            self._fail(str(error))
        try:
            self._connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, MAX_MESSAGE_BYTES)
            for pragma in ("trusted_schema=OFF", "cell_size_check=ON", "query_only=ON"):
                self._connection.execute(f"PRAGMA {pragma}")
            self._columns = self._read_columns()
            self._topics = self._read_topics()
        except BaseException:
            self._connection.close()
            raise
        self._contents: FileContents | None = None

    def _check_size(self, head: bytes, size: int) -> None:
        """Check that no page is missing: SQLite would read the missing part of a page as empty."""
        head = head.ljust(_HEAD_BYTES, b"\0")
        (page_bytes,), (pages,) = _PAGE_BYTES.unpack_from(head, 16), _PAGES.unpack_from(head, 28)
        # A page size of 1 means 65,536. The number of pages is valid only if both change counters are equal.
        stated = (65_536 if page_bytes == 1 else page_bytes) * pages
        if size < _HEAD_BYTES or (head[24:28] == head[92:96] and size < stated):
            self._fail(f"the database has {stated:,} bytes, but the file only {size:,}: its end is missing")

    def close(self) -> None:
        """Close the file."""
        self._connection.close()

    def _fail(self, reason: str) -> NoReturn:
        raise InvalidBagError(self.path, "", reason)

    def _rows(self, query: str, arguments: tuple[int, ...] = ()) -> Iterator[tuple[Any, ...]]:
        try:
            yield from self._connection.execute(query, arguments)
        except (sqlite3.Error, UnicodeDecodeError, OverflowError) as error:
            self._fail(f"the database cannot be read: {error}")

    def _read_columns(self) -> dict[str, set[str]]:
        """Return the columns of each table."""
        tables = "'messages', 'topics', 'message_definitions'"
        query = f"SELECT name, type, sql FROM sqlite_master WHERE name IN ({tables})"  # noqa: S608 - constant
        found: dict[str, set[str]] = {}
        for name, kind, sql in self._rows(query):
            if kind != "table" or not str(sql).lower().startswith(_PLAIN_TABLE):
                self._fail(f"'{name}' is not a plain table")
            found[name] = {str(row[0]) for row in self._rows(f"SELECT name FROM pragma_table_info('{name}')")}  # noqa: S608
        if not {"messages", "topics"} <= found.keys():
            self._fail("it lacks the tables 'messages' and 'topics'; is it a bag?")
        return found

    def _read_topics(self) -> dict[int, BagTopic]:
        definitions: dict[str, tuple[str, str]] = {}
        if "message_definitions" in self._columns:
            columns = "topic_type, encoding, encoded_message_definition"
            query = f"SELECT {columns} FROM message_definitions ORDER BY id LIMIT ?"  # noqa: S608 - constant
            for type_name, encoding, text in self._rows(query, (MAX_TOPICS,)):
                definitions.setdefault(full_type_name(str(type_name)), (str(text), str(encoding)))
        optional = ("offered_qos_profiles", "type_description_hash")
        extra = "".join(f", {each if each in self._columns['topics'] else repr('')}" for each in optional)
        query = f"SELECT id, name, type, serialization_format{extra} FROM topics LIMIT {MAX_TOPICS}"  # noqa: S608
        topics: dict[int, BagTopic] = {}
        for number, name, type_name, encoding, qos, type_hash in self._rows(query):
            if not isinstance(number, int):
                self._fail("the id of a topic is not a number")
            full_name = full_type_name(str(type_name))
            text, text_format = definitions.get(full_name, ("", ""))
            try:
                profiles = qos_profiles(str(qos))
            except YamlError:
                profiles = ()  # the messages can be read without them
            topics[number] = BagTopic(
                str(name), full_name, text, text_format, str(type_hash), profiles, str(encoding)
            )
        return topics

    def contents(self) -> FileContents:
        """Return a summary of the file; see `BagFile.contents`."""
        if self._contents is None:
            counts: dict[int, int] = {}
            times: list[int] = []
            query = (
                "SELECT topic_id, COUNT(*), MIN(timestamp), MAX(timestamp) FROM messages GROUP BY topic_id"
            )
            for number, count, start_ns, end_ns in self._rows(query):
                if number in self._topics:
                    counts[number] = count
                    times += (self._time(start_ns), self._time(end_ns))
            wal = self.path.with_name(f"{self.path.name}-wal")
            problem = ""
            if wal.is_file() and wal.stat().st_size:
                remedy = f"sqlite3 {self.path} .tables"  # closing the database merges its log
                problem = f"{wal.name} has messages that are not in it yet; to add them: {remedy}"
            topics = tuple(TopicCount(topic, counts.get(number, 0)) for number, topic in self._topics.items())
            size = self.path.stat().st_size
            self._contents = FileContents(topics, min(times, default=0), max(times, default=0), size, problem)
        return self._contents

    def _time(self, value: object) -> int:
        if not isinstance(value, int) or value not in _TIMES:
            self._fail(f"expected a time in nanoseconds, got {value!r:.40}")
        return value

    def messages(self, chosen: Filter, order: Order) -> Iterator[BagMessage]:
        """Yield messages; see `BagFile.messages`."""
        numbers = [number for number, topic in self._topics.items() if chosen.has_topic(topic)]
        if not numbers:
            return
        start_ns, end_ns = chosen.start_ns or 0, _TIMES[-1] if chosen.end_ns is None else chosen.end_ns
        by = "id" if order is Order.FILE else "timestamp, id"
        some = (
            "" if len(numbers) == len(self._topics) else f" AND topic_id IN ({','.join(map(str, numbers))})"
        )
        times = "timestamp BETWEEN ? AND ?"
        query = f"SELECT topic_id, timestamp, data FROM messages WHERE {times}{some} ORDER BY {by}"  # noqa: S608 - numbers
        limits = min(max(start_ns, 0), _TIMES[-1]), min(max(end_ns, 0), _TIMES[-1])
        for number, log_time_ns, data in self._rows(query, limits):
            topic = self._topics.get(number)
            if topic is None:
                continue
            if not isinstance(data, bytes):
                self._fail(f"a message of {topic.name[:80]} is not a sequence of bytes")
            # These files have no publish times.
            yield BagMessage(topic, data, log_time_ns, log_time_ns)

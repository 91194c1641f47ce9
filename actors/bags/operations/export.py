"""Writes the messages of a bag as tables: one CSV file per topic."""

from __future__ import annotations

import base64
import csv
import json
import re
from collections import Counter
from contextlib import ExitStack
from itertools import islice
from typing import TYPE_CHECKING, Any, Final, cast

from actors.bags.errors import BagError, write_error
from actors.interfaces.arrays import NumericArray
from actors.interfaces.fields import fields_of
from actors.interfaces.message import Message

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator
    from pathlib import Path

    from actors.bags.contents.records import BagTopic
    from actors.bags.reader import Reader

MAX_FILES: Final = 500
"""Limit for the topics that are exported at once: each needs an open file."""
MAX_COLUMNS: Final = 10_000
_TIMES: Final = ("log_time_ns", "publish_time_ns", "sequence")
_UNSAFE: Final = re.compile(r"[^A-Za-z0-9_.-]")


def export_csv(
    reader: Reader, folder: Path, topics: Collection[str] | None = None
) -> dict[str, tuple[Path, int]]:
    """Write one table per topic, with one line per message and one column per field.

    Each field of a nested message has its own column, such as pose.position.x. A sequence is one column:
    JSON, or base64 if it is a sequence of bytes.

    Args:
        reader: The bag.
        folder: The folder for the tables; created if it does not exist.
        topics: Names of topics; None for all.

    Returns:
        By topic, its file and the number of messages in it.

    Raises:
        BagError: The bag cannot be read, a message cannot be decoded, or there are too many topics.
        BagWriteError: A file exists, or cannot be written.
    """
    chosen = [topic for topic in reader.topics if topics is None or topic.name in topics]
    if len(chosen) > MAX_FILES:
        raise BagError(f"{reader.path} has {len(chosen):,} topics; name at most {MAX_FILES} with --topics")
    names: Counter[str] = Counter()
    with ExitStack() as stack:
        writers: dict[int, tuple[Any, Any]] = {}
        paths: dict[BagTopic, Path] = {}
        counts: Counter[str] = Counter()
        try:
            folder.mkdir(parents=True, exist_ok=True)
            for topic in chosen:
                name = file_name(topic.name)
                names[name] += 1
                # Another type of the same topic is another table.
                number = "" if names[name] == 1 else f".{names[name]}"
                paths[topic] = folder / f"{name}{number}.csv"
            for message in reader.messages([topic.name for topic in chosen]):
                found = writers.get(id(message.topic))
                if found is None:
                    cls = message.topic.message_class()
                    columns = list(islice(_columns(cls, ""), MAX_COLUMNS + 1))
                    if len(columns) > MAX_COLUMNS:
                        raise BagError(
                            f"{message.topic.name}: its type needs more than {MAX_COLUMNS:,} columns"
                        )
                    file = paths[message.topic].open("x", encoding="utf-8", newline="")
                    writer = csv.writer(stack.enter_context(file))
                    writer.writerow((*_TIMES, *columns))
                    found = writers[id(message.topic)] = writer, message.topic.decoder()
                writer, decode = found
                values = _values(decode(message.data))
                writer.writerow((message.log_time_ns, message.publish_time_ns, message.sequence, *values))
                counts[message.topic.name] += 1
        except OSError as error:
            raise write_error(error.filename or folder, error) from error
    return {topic.name: (path, counts[topic.name]) for topic, path in paths.items() if counts[topic.name]}


def file_name(topic: str) -> str:
    """Return the name of a topic's file without its suffix, such as "camera.image" for /camera/image."""
    name = topic.strip("/").replace("/", ".")
    return _UNSAFE.sub(lambda found: f"%{ord(found[0]):02X}", name).lstrip(".")[:200] or "topic"


def _columns(cls: Any, prefix: str) -> Iterator[str]:
    for field in fields_of(cls):
        if field.type.message is not None and not field.type.is_array:
            yield from _columns(field.type.message, f"{prefix}{field.name}.")
        else:
            yield prefix + field.name


def _values(message: Message) -> Iterator[object]:
    for field in fields_of(cast("Any", type(message))):
        value = getattr(message, field.name)
        if field.type.message is not None and not field.type.is_array:
            yield from _values(value)
        else:
            yield _cell(value)


def _cell(value: Any) -> object:
    if isinstance(value, bytes | bytearray | memoryview):
        data = bytes(cast("bytes", value))
        return data[0] if len(data) == 1 and isinstance(value, bytes) else base64.b64encode(data).decode()
    if isinstance(value, NumericArray | list):
        return json.dumps([_plain(each) for each in cast("Any", value)])
    return value


def _plain(value: Any) -> Any:
    if isinstance(value, Message):
        return {
            field.name: _plain(getattr(value, field.name)) for field in fields_of(cast("Any", type(value)))
        }
    if isinstance(value, list | NumericArray):
        return [_plain(each) for each in cast("Any", value)]
    if isinstance(value, bytes | bytearray | memoryview):
        return base64.b64encode(bytes(cast("bytes", value))).decode()
    return value

"""Attacks on a program that reads bags of others (`bag_reader.py`); their target is its folder."""

from __future__ import annotations

import random
import struct
import subprocess
import time
from functools import partial
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Final

import zstandard
from mcap.opcode import Opcode

from actors.bags import Writer
from actors.bags.storage.mcap_frames import HEAD, MAGIC, MESSAGE
from tests.actors.bags.bags import CHATTER, START_NS, text
from tests.hostile.victims import Attack, Processes, Started, Victim

if TYPE_CHECKING:
    from collections.abc import Callable

EXPANDED_BYTES: Final = 127 * 2**20
"""Of a chunk: what a reader takes of a few kilobytes."""
MAX_CHANNELS: Final = 65_535
DEFINITION: Final = "string data\n"
PAUSE_SEC: Final = 0.01
CHANGES: Final = (b"\xff" * 8, b"\xff\xff\xff\xff\0\0\0\0", b"\0" * 8, b"\xff", b"\0")


def _start_reader(processes: Processes, name: str) -> Started:
    _, url = processes.broker(name)
    folder = processes.folder / f"{name}-bags"
    folder.mkdir()
    reader = processes.start("tests.hostile.bag_reader", url, str(folder), stdout=subprocess.PIPE)
    reader.stdout.readline()
    return Started(reader.pid, (str(folder),), (url,))


READER: Final = Victim("bags", _start_reader)


def _text(value: str) -> bytes:
    data = value.encode()
    return struct.pack("<I", len(data)) + data


def _record(opcode: int, content: bytes) -> bytes:
    return HEAD.pack(opcode, len(content)) + content


def schema(number: int, name: str, definition: str) -> bytes:
    """Return the record of a type."""
    head = struct.pack("<H", number) + _text(name) + _text("ros2msg")
    return _record(Opcode.SCHEMA, head + _text(definition))


def channel(number: int, schema_number: int) -> bytes:
    """Return the record of a topic."""
    head = struct.pack("<HH", number, schema_number) + _text(f"/t{number}") + _text("cdr")
    return _record(Opcode.CHANNEL, head + struct.pack("<I", 0))


def message(number: int, log_time_ns: int, data: bytes = b"") -> bytes:
    """Return the record of a message."""
    length = MESSAGE.size - HEAD.size + len(data)
    return MESSAGE.pack(Opcode.MESSAGE, length, number, 0, log_time_ns, 0) + data


def file_of(records: bytes) -> bytes:
    """Return a file whose only chunk has these records, compressed."""
    compressed = zstandard.ZstdCompressor().compress(records)
    head = struct.pack("<QQQI", 0, 9, len(records), 0) + _text("zstd")
    parts = (
        MAGIC,
        _record(Opcode.HEADER, _text("ros2") + _text("")),
        _record(Opcode.CHUNK, head + struct.pack("<Q", len(compressed)) + compressed),
        _record(Opcode.DATA_END, bytes(4)),
        _record(Opcode.FOOTER, bytes(20)),
        MAGIC,
    )
    return b"".join(parts)


def place(path: Path, data: bytes | bytearray) -> None:
    """Write a file beside the folder, and move it there: nobody sees a part of it."""
    part = path.parent.with_name(f"{path.parent.name}-{path.name}")
    part.write_bytes(data)
    part.replace(path)


def large_message() -> bytes:
    """Return a message that is mostly empty."""
    data = b"\0\1\0\0" + struct.pack("<I", EXPANDED_BYTES) + bytes(EXPANDED_BYTES)
    return schema(1, "a_msgs/msg/A", DEFINITION) + channel(1, 1) + message(1, 0, data)


def many_messages() -> bytes:
    """Return a million messages whose times go up and down."""
    pair = message(1, 9) + message(1, 0)
    return schema(1, "a_msgs/msg/A", "") + channel(1, 1) + pair * (EXPANDED_BYTES // 4 // len(pair))


def many_types() -> bytes:
    """Return as many topics as a file can have, each of a type of its own, and a message of each."""
    numbers = range(1, MAX_CHANNELS + 1)
    types = (schema(each, f"a_msgs/msg/A{each}", f"int32 x{each}\n") for each in numbers)
    channels = (channel(each, each) for each in numbers)
    messages = (message(each, each, b"\0\1\0\0\0\0\0\0") for each in numbers)
    return b"".join((*types, *channels, *messages))


def growing_types() -> bytes:
    """Return types that contain each other, and themselves, and ever more of the next one."""
    line = "=" * 80
    rows = [f"{line}\nMSG: a_msgs/A{each}\nA{each + 1}[100] a\nA{each + 1}[] b\n" for each in range(1, 499)]
    grows = "A1 a\n" + "".join(rows) + f"{line}\nMSG: a_msgs/A499\nint32[100] a\n"
    circle = f"B b\n{line}\nMSG: a_msgs/B\nA[] a\n{line}\nMSG: a_msgs/A\nB b\n"
    long = "int32 a # " + "x" * 900_000 + "\n"
    wide = "".join(f"int32[<=100] a{each} [1, 2, 3]\n" for each in range(30_000))
    texts = (grows, circle, long, wide, "A a\n", "A[4000000000] a\n")
    topics = (
        schema(each, "a_msgs/msg/A", definition) + channel(each, each) + message(each, 0, bytes(64))
        for each, definition in enumerate(texts, 1)
    )
    return b"".join(topics)


def expand(folder: str, records: Callable[[], bytes]) -> None:
    """Case 93 and others: a small file, again and again."""
    data, path = file_of(records()), Path(folder) / "bag.mcap"
    while True:
        if not path.exists():
            place(path, data)
        time.sleep(PAUSE_SEC)


def damage(folder: str) -> None:
    """Case 94: bags that are cut, or have other bytes and lengths, ever new ones."""
    with Writer(f"{folder}-whole", chunk_size=300, compression="lz4") as bag:
        number = bag.add_topic(CHATTER)
        for index in range(100):
            bag.write(number, text(f"text {index}"), START_NS + index, START_NS)
    whole = bag.file.read_bytes()
    chance = random.Random(94)
    for index in count():
        data = bytearray(whole)
        for _ in range(chance.randrange(4)):
            change, start = chance.choice(CHANGES), chance.randrange(len(data))
            data[start : start + len(change)] = change
        end = chance.choice((len(data), chance.randrange(len(data))))
        place(Path(folder) / f"{index % 10}.mcap", data[:end])
        time.sleep(PAUSE_SEC)


ATTACKS: Final = {
    "bag-large-message": Attack(93, partial(expand, records=large_message), 700, READER),
    "bag-many-messages": Attack(93, partial(expand, records=many_messages), 300, READER),
    "bag-damage": Attack(94, damage, 64, READER),
    "bag-many-types": Attack(95, partial(expand, records=many_types), 200, READER),
    "bag-growing-types": Attack(95, partial(expand, records=growing_types), 100, READER),
}

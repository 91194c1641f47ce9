"""Small bags for tests."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.bags import BagTopic, Writer
from actors.interfaces import cdr
from actors.interfaces.std_msgs.msg import Int32, String
from actors.qos.profile import QoSProfile

if TYPE_CHECKING:
    from pathlib import Path

START_NS: Final = 1_700_000_000_000_000_000
CHATTER: Final = BagTopic.of_class("/chatter", String, [QoSProfile(depth=10)])
COUNT: Final = BagTopic.of_class("/count", Int32)


def text(value: str) -> bytes:
    return cdr.encode(String(data=value))


def number(value: int) -> bytes:
    return cdr.encode(Int32(data=value))


def write_bag(folder: Path, count: int = 20, *, chunk_size: int = 300, compression: str = "none") -> Path:
    """Write a bag with messages on two topics alternately, a nanosecond apart; return its only file."""
    with Writer(folder, chunk_size=chunk_size, compression=compression) as bag:
        chatter, counter = bag.add_topic(CHATTER), bag.add_topic(COUNT)
        for index in range(0, count, 2):
            bag.write(chatter, text(f"text {index}"), START_NS + index, START_NS + index - 5, index)
            bag.write(counter, number(index), START_NS + index + 1, START_NS + index + 1)
    return folder / f"{folder.name}_0.mcap"

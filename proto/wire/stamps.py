"""Times of messages that share a batch, in its attributes (docs/protocol.md §6.1.7).

The attribute has the number of the message to which its first time belongs, so that ends that do not know it
can cut a batch.
"""

from __future__ import annotations

import sys
from array import array
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Sequence

    from proto.wire.frames import Options

STAMPS: Final = "stamps"
MAX_STAMPS: Final = 400
"""Messages with times of their own in a batch that we send: within MAX_ATTRIBUTES_BYTES."""

_LITTLE_ENDIAN: Final = sys.byteorder == "little"
_BYTES: Final = 8


def stamps_attribute(first: int, stamps: Sequence[int]) -> Options | None:
    """Return the attributes of a batch; None if all its messages have the same time, which the batch has.

    Args:
        first: The number of its first message.
        stamps: The time of each, in ns since the epoch.
    """
    if stamps.count(stamps[0]) == len(stamps):
        return None
    return {STAMPS: _to_bytes(array("Q", (first, *stamps)))}


def cut_stamps(attributes: Options, first: int, count: int) -> Options:
    """Return the attributes of a part of a batch, which has only the times of its own messages.

    A batch that is sent message by message would otherwise have all its times in each frame.

    Args:
        attributes: Those of the whole batch.
        first: The number of the part's first message.
        count: How many messages the part has.
    """
    stamps = stamps_from(attributes, first, count)
    return {**attributes, STAMPS: _to_bytes(array("Q", stamps))} if stamps else attributes


def _to_bytes(numbers: array[int]) -> bytes:
    if not _LITTLE_ENDIAN:  # pragma: no cover
        numbers.byteswap()
    return numbers.tobytes()


def stamps_from(attributes: Options, first: int, count: int) -> Sequence[int]:
    """Return the number of a message and the times of those from it on; empty if the attributes have none.

    Only those of the batch: a batch may wait for long, and its sender may have written any number of them.

    Args:
        attributes: Those of a batch.
        first: The number of its first message.
        count: How many messages it has.
    """
    data = attributes.get(STAMPS)
    if not isinstance(data, bytes) or not data or len(data) % _BYTES:
        return ()
    numbers = array("Q", data)
    if not _LITTLE_ENDIAN:  # pragma: no cover
        numbers.byteswap()
    skipped = max(first - numbers[0], 0)
    kept = numbers[1 + skipped : 1 + max(first + count - numbers[0], 0)]
    return array("Q", (numbers[0] + skipped, *kept))


def stamp_of(stamps: Sequence[int], number: int, others: int) -> int:
    """Return the time of a message.

    Args:
        stamps: As `stamps_from` returns them; not empty.
        number: The message's.
        others: The time of messages that have none of their own.
    """
    index = number - stamps[0] + 1
    return stamps[index] if 0 < index < len(stamps) else others

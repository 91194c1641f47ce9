"""Large messages in shared memory, and what a link sends of them by reference (docs/protocol.md §6.10).

A publisher writes a message into a slot of its arena. Whoever holds a `Slot` may read it; when the last
holder lets go of it, the slot's owner may use it again. Holders are the batches in queues and, for slots that
a peer reads, the link's `References`. CPython frees an object with its last reference, so a slot that leaves
its last queue, by whatever way, is released at that moment.

A slot begins with a generation, which its owner changes before it writes the next message into it. A reader
that compares it after the message has been copied never takes a part of another message, even if its link
ended long before. The memory itself is opened in `proto/aio/arena.py`.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Final

from proto.codec import ARRAY_HEAD_BYTES, array_head, batch_head, encode
from proto.errors import ErrorCode, ProtocolError
from proto.frames import Arena, Batch, Reference, Release

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from proto.frames import Buffer, Options

GENERATION_BYTES: Final = 8
"""The little-endian generation at the start of a slot."""

SLOT_HEAD_BYTES: Final = 64
"""What precedes the message in a slot; the array head of a batch of one are the last bytes of it."""

AHEAD_BYTES: Final = 8 * 1024 * 1024
"""Messages that a broker refers to before the reader has released some. Like the buffer of a socket it must
be small: only messages that wait in the broker obey the depth of the subscription."""

MIN_MESSAGE_BYTES: Final = 4096
"""The smallest message that may be referred to: what a link holds is counted by the size of its messages, and
many tiny ones would cost more than is counted."""

NUMBERS_PER_FRAME: Final = 4000
"""The most references in one RELEASE."""

ONE_MESSAGE: Final = array_head(1)


class Slot:
    """A message in shared memory, for as long as anything holds this object.

    Args:
        arena: Where it is.
        offset: Where its slot begins there.
        generation: What its slot begins with.
        payload: The payload of a batch with this one message: its memory.
        release: Called when nothing holds the slot any more.
    """

    __slots__ = ("_release", "arena", "generation", "offset", "payload")

    def __init__(
        self, arena: Arena, offset: int, generation: int, payload: memoryview, release: Callable[[], None]
    ) -> None:
        self.arena = arena
        self.offset = offset
        self.generation = generation
        self.payload = payload
        self._release = release

    def __del__(self) -> None:
        """Release it."""
        self._release()

    @property
    def message(self) -> memoryview:
        """The message. Its sender may change it as long as it likes: do not interpret it before a copy."""
        return self.payload[ARRAY_HEAD_BYTES:]


class SharedBatch(Batch):
    """A batch of one message in a slot; `raw` is empty, and of `payload` only the size may be used."""

    slot: Slot


def shared_batch(
    slot: Slot, publisher: int, first_sequence: int, stamp_ns: int, attributes: Options | None = None
) -> SharedBatch:
    """Return a slot as a batch."""
    batch = SharedBatch(publisher, first_sequence, stamp_ns, 1, None, attributes, slot.payload, b"")
    batch.slot = slot
    return batch


def renamed(batch: SharedBatch, publisher: int) -> SharedBatch:
    """Return the batch with another publisher id."""
    return shared_batch(batch.slot, publisher, batch.first_sequence, batch.stamp_ns, batch.attributes)


def bytes_head(batch: SharedBatch) -> bytes:
    """Return the encoded BATCH up to its message, which must follow on the wire."""
    return batch_head(batch[:6], len(batch.payload)) + ONE_MESSAGE


def copy_payload(memory: memoryview, reference: Reference) -> bytes | None:
    """Copy the payload of a batch of one out of an arena.

    Args:
        memory: The arena.
        reference: What it refers to.

    Returns:
        None if the slot is used for another message by now, or is no slot.

    Raises:
        ProtocolError: It is not within the arena.
    """
    check_inside(reference, len(memory))
    offset = reference.offset
    start = offset + SLOT_HEAD_BYTES
    payload = bytes(memory[start - ARRAY_HEAD_BYTES : start + reference.size])
    generation = int.from_bytes(memory[offset : offset + GENERATION_BYTES], "little")  # after the copy
    valid = generation == reference.generation and payload.startswith(ONE_MESSAGE)
    return payload if valid else None


def check_inside(reference: Reference, arena_bytes: int) -> None:
    """Raise ProtocolError if a reference is to too small a message, or is not within its arena."""
    if (
        reference.size < MIN_MESSAGE_BYTES
        or reference.offset + SLOT_HEAD_BYTES + reference.size > arena_bytes
    ):
        text = (
            f"REFERENCE: {reference.size} bytes at {reference.offset} are not in an arena of {arena_bytes},"
            f" or fewer than {MIN_MESSAGE_BYTES}"
        )
        raise ProtocolError(ErrorCode.MALFORMED, text)


class References:
    """What one link sends by reference: the arenas that its peer has opened, and the slots that it may read.

    Args:
        announce: Called with an arena when the first message in it is to be sent; sends ARENA if the peer can
            still open it. Until it has, messages are sent as bytes.
        max_held_bytes: Refer to nothing more while the peer may read this much.

    Attributes:
        held_bytes: Size of the messages that the peer may read.
        sent: Messages sent by reference so far.
        copied: Messages in shared memory that were sent as bytes.
    """

    __slots__ = ("_announce", "_held", "_max_held_bytes", "_usable", "copied", "held_bytes", "sent")

    def __init__(self, announce: Callable[[Arena], None], max_held_bytes: int = sys.maxsize) -> None:
        self._announce = announce
        self._max_held_bytes = max_held_bytes
        self._usable: dict[int, bool] = {}
        """By arena, whether the peer has opened it; False also if it has not answered yet."""
        self._held: dict[int, Slot] = {}
        self.held_bytes = self.sent = self.copied = 0

    def allows(self, slot: Slot) -> bool:
        """Return whether the peer can read the slot's arena; announce the arena if it is new."""
        usable = self._usable.get(slot.arena.id)
        if usable is None:
            usable = self._usable[slot.arena.id] = False
            self._announce(slot.arena)
        return usable

    @property
    def full(self) -> bool:
        """Whether the peer has to release something first."""
        return self.held_bytes >= self._max_held_bytes

    def refer(self, batch: SharedBatch) -> bytes:
        """Return the encoded REFERENCE to a batch, and hold its slot until the peer releases it."""
        slot, message_bytes = batch.slot, len(batch.payload) - ARRAY_HEAD_BYTES
        self._held[self.sent] = slot
        self.sent += 1
        self.held_bytes += message_bytes
        return encode(
            Reference(
                batch.publisher,
                batch.first_sequence,
                batch.stamp_ns,
                batch.attributes,
                slot.arena.id,
                slot.offset,
                message_bytes,
                slot.generation,
            )
        )

    @property
    def arenas(self) -> Iterable[int]:
        """The arenas in which there has been a message for the peer."""
        return self._usable

    def opened(self, arena: int, *, usable: bool) -> bool:
        """Note that the peer has opened an arena, or could not; return whether the arena is still there."""
        known = arena in self._usable
        if known:
            self._usable[arena] = usable
        return known

    def closed(self, arena: int) -> bool:
        """Forget an arena in which no message is any more; return whether the peer knows it."""
        return self._usable.pop(arena, None) is not None

    def released(self, numbers: Iterable[int]) -> None:
        """Let go of the slots that the peer has released.

        Raises:
            ProtocolError: It was not sent these references, or has released them.
        """
        for number in numbers:
            slot = self._held.pop(number, None)
            if slot is None:
                raise ProtocolError(ErrorCode.UNEXPECTED, f"RELEASE of reference {number}, which is not held")
            self.held_bytes -= len(slot.payload) - ARRAY_HEAD_BYTES


def release_frames(numbers: Sequence[int]) -> Iterator[Release]:
    """Return the RELEASE frames for any number of references."""
    for start in range(0, len(numbers), NUMBERS_PER_FRAME):
        yield Release(tuple(numbers[start : start + NUMBERS_PER_FRAME]))


def write_head(memory: memoryview, generation: int) -> None:
    """Write what precedes the message in a slot. Write it first: readers of an earlier message notice it."""
    memory[:GENERATION_BYTES] = generation.to_bytes(GENERATION_BYTES, "little")
    memory[SLOT_HEAD_BYTES - ARRAY_HEAD_BYTES : SLOT_HEAD_BYTES] = ONE_MESSAGE


def write_message(memory: memoryview, generation: int, message: Buffer) -> None:
    """Write a message into a slot."""
    write_head(memory, generation)
    memory[SLOT_HEAD_BYTES : SLOT_HEAD_BYTES + len(message)] = message

"""Large messages in shared memory, and what a link sends of them by reference (docs/protocol.md §6.10).

A publisher writes the messages of a batch into a slot of its arena. The holder of a `Slot` may read them;
when the last holder lets go of it, the slot's owner may use it again. Holders are the batches in queues and,
for slots that a peer reads, the link's `References`. CPython frees an object with its last reference, so a
slot that leaves its last queue, by whatever way, is released at that moment.

A slot begins with a generation, which its owner changes before it writes the next message into it. A reader
that compares it after the message has been copied never takes a part of another message, even if its link
ended long before. The processor must not reorder these reads, nor the owner's writes: x86-64 never does,
others (ARM) could if a link ends at the very moment of the copy. While a link lasts, its slots are held, and
the generation is not needed. The memory itself is opened in `proto/aio/arena.py`.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Final, cast

from proto.errors import ErrorCode, ProtocolError
from proto.wire.codec import ARRAY_HEAD_BYTES, array_head, batch_head, encode
from proto.wire.frames import Arena, Batch, Reference, Release

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from proto.wire.frames import Options

GENERATION_BYTES: Final = 8
"""The little-endian generation at the start of a slot."""

SLOT_HEAD_BYTES: Final = 64
"""Bytes before the messages in a slot. The last of them are the array head of the batch."""

AHEAD_BYTES: Final = 8 * 1024 * 1024
"""Messages that a broker refers to before the reader has released some. Like the buffer of a socket it must
be small: only messages that wait in the broker obey the depth of the subscription."""

MIN_REFERENCE_BYTES: Final = 4096
"""The least that may be referred to: what a link holds is counted by the size of its messages, and many
references to little would cost more than is counted."""

NUMBERS_PER_FRAME: Final = 4000
"""The most references in one RELEASE."""


class Slot:
    """Messages in shared memory, for as long as anything holds this object.

    Args:
        arena: Where they are.
        memory: All of the arena.
        offset: Where the slot begins there.
        generation: The number that its owner has written at its start.
        release: Called with the slot when nothing else holds it any more.

    Attributes:
        size: Bytes of its messages, which follow its head; set by its owner, who may add some until it refers
            to the slot.
        length: How many messages these are.
        in_place: Whether a reader in its owner's process reads them without a copy.
    """

    __slots__ = (
        "__weakref__",
        "_release",
        "arena",
        "generation",
        "in_place",
        "length",
        "memory",
        "offset",
        "size",
    )

    def __init__(
        self,
        arena: Arena,
        memory: memoryview,
        offset: int,
        generation: int,
        release: Callable[[Slot], None],
    ) -> None:
        self.arena = arena
        self.memory = memory
        self.offset = offset
        self.generation = generation
        self.length = self.size = 0
        self.in_place = False
        self._release = release

    def __del__(self) -> None:
        """Tell the owner that the last holder is gone."""
        self._release(self)


class SharedBatch(Batch):
    """A batch of messages in a slot; `raw` is empty, and of `payload` only the size may be used.

    Attributes:
        slot: The slot.
        start: Where the first message begins, from the start of the slot.
    """

    slot: Slot
    start: int

    @property
    def messages(self) -> memoryview:
        """The messages. Their sender may change them at any time: do not interpret them before a copy."""
        return cast("memoryview", self.payload)[ARRAY_HEAD_BYTES:]


def shared_batch(
    slot: Slot,
    head: tuple[int, int, int, int, bytes | None, Options | None],
    start: int,
    size: int,
) -> SharedBatch:
    """Return messages in a slot as a batch.

    Args:
        slot: The slot.
        head: The first six fields of the batch.
        start: Where the first message begins, from the start of the slot.
        size: Bytes of all messages.
    """
    begin = slot.offset + start
    batch = SharedBatch(*head, slot.memory[begin - ARRAY_HEAD_BYTES : begin + size], b"")
    batch.slot = slot
    batch.start = start
    return batch


def bytes_head(batch: SharedBatch) -> bytes:
    """Return the encoded BATCH up to its messages, which must follow on the wire."""
    return batch_head(batch[:6], len(batch.payload)) + array_head(batch.length)


def copy_payload(memory: memoryview, reference: Reference) -> bytes | None:
    """Copy the payload of a batch out of an arena.

    Args:
        memory: The arena.
        reference: Where the batch is in the arena.

    Returns:
        None if the slot is used for other messages by now.

    Raises:
        ProtocolError: It is not within the arena.
    """
    check_inside(reference, len(memory))
    offset = reference.offset
    begin = offset + reference.start
    payload = b"".join((array_head(reference.length), memory[begin : begin + reference.size]))
    generation = int.from_bytes(memory[offset : offset + GENERATION_BYTES], "little")  # after the copy
    return payload if generation == reference.generation else None


def check_inside(reference: Reference, arena_bytes: int) -> None:
    """Raise ProtocolError if a reference is to too little, or is not within its arena."""
    offset, start, size = reference.offset, reference.start, reference.size
    if size < MIN_REFERENCE_BYTES or start < SLOT_HEAD_BYTES or offset + start + size > arena_bytes:
        text = (
            f"REFERENCE: {size} bytes at {offset} + {start} are not in a slot of an arena of {arena_bytes},"
            f" or fewer than {MIN_REFERENCE_BYTES}"
        )
        raise ProtocolError(ErrorCode.MALFORMED, text)


class References:
    """Messages that one link sends by reference: arenas that its peer has opened, and slots that it may read.

    Args:
        announce: Called with an arena when the first message in it is to be sent; sends ARENA if the peer can
            still open it. Until it has, messages are sent as bytes.
        max_held_bytes: Limit of `held_bytes`: beyond it, `full` is true until the peer releases some.

    Attributes:
        held_bytes: Size of the messages that the peer may read.
        sent, sent_bytes: Messages sent by reference so far, and their size.
        copied: Messages in shared memory that were sent as bytes.
    """

    __slots__ = (
        "_announce",
        "_count",
        "_held",
        "_max_held_bytes",
        "_usable",
        "copied",
        "held_bytes",
        "sent",
        "sent_bytes",
    )

    def __init__(self, announce: Callable[[Arena], None], max_held_bytes: int = sys.maxsize) -> None:
        self._announce = announce
        self._max_held_bytes = max_held_bytes
        self._usable: dict[int, bool] = {}
        """By arena, whether the peer has opened it; False also if it has not answered yet."""
        self._held: dict[int, SharedBatch] = {}
        """By the number of their REFERENCE."""
        self._count = 0
        """REFERENCE frames so far."""
        self.held_bytes = self.sent = self.sent_bytes = self.copied = 0

    def allows(self, slot: Slot) -> bool:
        """Return whether the peer can read the slot's arena; announce the arena if it is new."""
        usable = self._usable.get(slot.arena.id)
        if usable is None:
            # False until the peer has answered: until then it gets bytes, so that nothing waits for the
            # answer.
            usable = self._usable[slot.arena.id] = False
            self._announce(slot.arena)
        return usable

    @property
    def full(self) -> bool:
        """Whether the peer has to release something first."""
        return self.held_bytes >= self._max_held_bytes

    def refer(self, batch: SharedBatch) -> bytes:
        """Return the encoded REFERENCE to a batch, and hold its slot until the peer releases it."""
        slot, size = batch.slot, len(batch.payload) - ARRAY_HEAD_BYTES
        self._held[self._count] = batch
        self._count += 1
        self.sent += batch.length
        self.held_bytes += size
        self.sent_bytes += size
        return encode(Reference(*batch[:6], slot.arena.id, slot.offset, batch.start, size, slot.generation))

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
            batch = self._held.pop(number, None)
            if batch is None:
                raise ProtocolError(ErrorCode.UNEXPECTED, f"RELEASE of reference {number}, which is not held")
            self.held_bytes -= len(batch.payload) - ARRAY_HEAD_BYTES


def release_frames(numbers: Sequence[int]) -> Iterator[Release]:
    """Return the RELEASE frames for any number of references."""
    for start in range(0, len(numbers), NUMBERS_PER_FRAME):
        yield Release(tuple(numbers[start : start + NUMBERS_PER_FRAME]))


def begin_slot(memory: memoryview, generation: int) -> None:
    """Write a generation at the start of a slot, before its messages: readers of earlier ones notice it."""
    memory[:GENERATION_BYTES] = generation.to_bytes(GENERATION_BYTES, "little")

"""Messages in shared memory: a queue sends them by reference or as bytes; slots live as long as needed."""

from __future__ import annotations

import itertools
from array import array

import pytest

from proto import limits
from proto.errors import ErrorCode, ProtocolError
from proto.queues.batches import message_bytes, slice_batch, with_publisher
from proto.queues.outbox import Outbox
from proto.queues.publisher_queue import PublisherQueue
from proto.wire import frames
from proto.wire.codec import ARRAY_HEAD_BYTES, decode, encode
from proto.wire.ends import ends_to_bytes
from proto.wire.frames import Arena, Batch, Fragment, Reference
from proto.wire.references import (
    MIN_REFERENCE_BYTES,
    SLOT_HEAD_BYTES,
    References,
    SharedBatch,
    Slot,
    begin_slot,
    copy_payload,
    release_frames,
    shared_batch,
)

ARENA = Arena(7, 1, 3, 2**20, bytes(16))
SMALL, LARGE = bytes(range(256)) * 300, b"large" * 100_000


class Memory:
    """Slots of messages, each at the offset 0 of a memory of its own.

    Attributes:
        released: The first sequence numbers of those that nothing holds any more.
    """

    def __init__(self) -> None:
        self.released: list[int] = []

    def batch(self, number: int, message: bytes = SMALL, *, arena: Arena = ARENA) -> SharedBatch:
        """Return a message in a slot as a batch."""
        return self.several(number, [message], arena=arena)

    def several(self, number: int, messages: list[bytes], *, arena: Arena = ARENA) -> SharedBatch:
        """Return messages in one slot as a batch."""
        content = b"".join(messages)
        memory = memoryview(bytearray(SLOT_HEAD_BYTES) + content)
        begin_slot(memory, number + 100)
        slot = Slot(arena, memory.toreadonly(), 0, number + 100, lambda _: self.released.append(number))
        ends = array("I", itertools.accumulate(map(len, messages)))
        head = 5, number, 1, len(messages), ends_to_bytes(ends) if len(messages) > 1 else None, {"a": 1}
        return shared_batch(slot, head, SLOT_HEAD_BYTES, len(content))


class Peer:
    """An outbox whose peer can read shared memory, with one queue."""

    def __init__(self, max_held_bytes: int = 2**40, depth: int | None = None) -> None:
        self.announced: list[Arena] = []
        self.references = References(self.announced.append, max_held_bytes)
        self.outbox = Outbox()
        self.outbox.transfers.references = self.references
        self.queue = PublisherQueue(5, depth)

    def sent(self) -> list[frames.Frame]:
        """Return what may be sent now."""
        raw = b"".join(map(bytes, self.outbox.pop_frames(2**40)[0]))
        self.outbox.trim()
        found: list[frames.Frame] = []
        while raw:
            size = limits.PREFIX_BYTES + int.from_bytes(raw[1:5], "big")
            found.append(decode(raw[:size]))
            raw = raw[size:]
        return found

    def open(self) -> None:
        """Let the peer open the arena."""
        self.references.allows(Memory().batch(0).slot)
        self.references.opened(ARENA.id, usable=True)


def joined(parts: list[frames.Frame]) -> Batch:
    """Return the batch that fragments carry."""
    raw = b"".join(bytes(part.payload) for part in parts if isinstance(part, Fragment))
    batch = decode(raw)
    assert isinstance(batch, Batch)
    return batch


@pytest.mark.parametrize("message", [SMALL, LARGE])
def test_a_peer_without_the_arena_gets_bytes(message: bytes) -> None:
    """The frame is what a batch without shared memory has, in one piece or in fragments."""
    memory, peer = Memory(), Peer()
    plain = encode(Batch(5, 3, 1, 1, None, {"a": 1}, b"\xdd\0\0\0\1" + message, b""))
    peer.outbox.enqueue(peer.queue, memory.batch(3, message))
    sent = peer.sent()
    batch = sent[0] if message is SMALL else joined(sent)
    assert isinstance(batch, Batch)
    assert bytes(batch.raw) == plain
    assert bytes(batch.payload) == b"\xdd\0\0\0\1" + message
    assert peer.announced == [ARENA]
    assert (peer.references.sent, peer.references.copied) == (0, 1)
    assert memory.released == [3]
    assert (peer.queue.sent, peer.queue.sent_bytes) == (1, len(message))


def test_a_peer_that_has_opened_the_arena_gets_references() -> None:
    """One follows the other; the slots are held until the peer releases them."""
    memory, peer = Memory(), Peer()
    peer.open()
    for number in range(3):
        peer.outbox.enqueue(peer.queue, memory.batch(number))
    assert peer.sent() == [
        Reference(5, number, 1, 1, None, {"a": 1}, ARENA.id, 0, SLOT_HEAD_BYTES, len(SMALL), number + 100)
        for number in range(3)
    ]
    assert (peer.queue.sent, peer.references.held_bytes, memory.released) == (3, 3 * len(SMALL), [])
    peer.references.released((1,))
    assert memory.released == [1]
    peer.references.released((2, 0))
    assert (memory.released, peer.references.held_bytes) == ([1, 2, 0], 0)


def test_an_arena_that_the_peer_cannot_open_is_announced_once() -> None:
    """What follows goes as bytes, on this link only."""
    memory, peer = Memory(), Peer()
    for number in range(2):
        peer.outbox.enqueue(peer.queue, memory.batch(number))
        peer.references.opened(ARENA.id, usable=False)
    assert [type(frame) for frame in peer.sent()] == [Batch, Batch]
    assert peer.announced == [ARENA]
    other = Memory().batch(2, arena=ARENA._replace(id=8))
    peer.outbox.enqueue(peer.queue, other)
    assert [type(frame) for frame in peer.sent()] == [Batch]
    assert [arena.id for arena in peer.announced] == [7, 8]


def test_depth_holds_for_what_a_reader_has_not_released_in_time() -> None:
    """Beyond the limit messages wait in the queue, which keeps the newest; one larger message may be read."""
    memory, peer = Memory(), Peer(max_held_bytes=len(SMALL), depth=2)
    peer.open()
    for number in range(6):
        peer.outbox.enqueue(peer.queue, memory.batch(number))
        peer.sent()
    assert (peer.queue.pending, peer.queue.dropped, memory.released) == (2, 3, [1, 2, 3])
    assert peer.outbox.blocked
    assert not peer.outbox.has_more  # nothing to do before the release
    peer.references.released((0,))
    assert not peer.references.full


def test_messages_with_credit_are_kept_while_the_peer_releases_nothing() -> None:
    """§6.5.8: a KEEP_LAST publisher to a KEEP_ALL subscription loses none of them, whatever its depth."""
    memory, peer = Memory(), Peer(max_held_bytes=len(SMALL), depth=2)
    peer.open()
    peer.queue.keeps_credit = True
    peer.queue.restart(5, 0)
    peer.queue.sequence_limit = 10
    for number in range(15):
        peer.outbox.enqueue(peer.queue, memory.batch(number))
        peer.sent()
    assert peer.queue.blocked
    assert (peer.queue.pending, peer.queue.dropped) == (11, 3)  # 9 with credit, 2 without
    assert memory.released == [1, 2, 3]


def test_a_discarded_queue_waits_for_nothing() -> None:
    """The outbox forgets it; what is put into it later waits again."""
    memory, peer = Memory(), Peer(max_held_bytes=1)
    peer.open()
    for _ in range(3):
        for number in range(2):
            peer.outbox.enqueue(peer.queue, memory.batch(number))
            peer.sent()
        assert list(peer.outbox.blocked) == [peer.queue]
        peer.outbox.discard_queue(peer.queue)
        assert not peer.outbox.blocked
        assert not peer.queue.blocked


def test_credit_holds_for_shared_memory() -> None:
    """A message without credit waits, with or without a frame before it that has been sent."""
    memory, peer = Memory(), Peer()
    peer.queue.restart(5, 0)
    peer.queue.sequence_limit = 1
    for number in range(2):
        peer.outbox.enqueue(peer.queue, memory.batch(number))
    assert [type(frame) for frame in peer.sent()] == [Batch]
    peer.outbox.enqueue(peer.queue, encode(frames.Ping(1)), first=True)
    assert peer.sent() == [frames.Ping(1)]
    peer.queue.sequence_limit = 2
    peer.outbox.schedule(peer.queue)
    assert [type(frame) for frame in peer.sent()] == [Batch]


def test_a_link_with_many_waiting_queues_drops_their_oldest_messages() -> None:
    """Queues that wait for a release count for its limit, and lose messages when others need space."""
    memory, peer = Memory(), Peer(max_held_bytes=1)
    peer.open()
    peer.outbox.max_held_bytes = 22 * len(SMALL)
    first = [PublisherQueue(6, 10), PublisherQueue(7, 10)]
    for number in range(11):
        for queue in first:
            peer.outbox.enqueue(queue, memory.batch(number))
            peer.sent()
    assert [queue.pending for queue in first] == [10, 10]
    for publisher in range(8, 15):
        peer.outbox.enqueue(PublisherQueue(publisher, 10), memory.batch(0))
        peer.sent()
        assert peer.outbox.held_bytes <= peer.outbox.max_held_bytes
    assert all(1 < queue.pending < 10 for queue in first)


@pytest.mark.parametrize("how", ["drop", "discard", "lose", "restart"])
def test_a_slot_is_released_however_its_message_leaves_the_queue(how: str) -> None:
    """Dropped, discarded, lost with the link, or sent as bytes on the next one."""
    memory, peer = Memory(), Peer(depth=1)
    peer.queue.sequence_limit = 0
    peer.queue.restart(5, 0)
    peer.queue.sequence_limit = 0
    peer.outbox.enqueue(peer.queue, memory.batch(0, LARGE))
    if how == "drop":
        peer.outbox.enqueue(peer.queue, Batch(5, 1, 0, 1, None, None, b"\xdd\0\0\0\1\x80", b"raw"))
        peer.outbox.trim()
    elif how == "discard":
        peer.outbox.discard_queue(peer.queue)
    elif how == "lose":
        peer.queue.mark_lost()
    else:
        peer.queue.restart(6)
        other = Peer()
        other.outbox.schedule(peer.queue)
        batch = joined(other.sent())
        assert (batch.publisher, bytes(batch.payload[5:])) == (6, LARGE)
    assert memory.released == [0]


def test_another_publisher_id_keeps_the_slot() -> None:
    """A queue that a publisher resumes sends what was published under an earlier id."""
    memory = Memory()
    batch = with_publisher(memory.batch(0), 9)
    assert isinstance(batch, SharedBatch)
    assert (batch.publisher, batch.attributes, message_bytes(batch)) == (9, {"a": 1}, len(SMALL))
    assert memory.released == []


def test_only_what_was_sent_can_be_released_and_once() -> None:
    """Anything else is an error of the peer."""
    memory, peer = Memory(), Peer()
    peer.open()
    peer.outbox.enqueue(peer.queue, memory.batch(0))
    peer.sent()
    peer.references.released((0,))
    for numbers in ((0,), (1,)):
        with pytest.raises(ProtocolError) as caught:
            peer.references.released(numbers)
        assert caught.value.code is ErrorCode.UNEXPECTED


def test_a_reference_is_checked_before_its_memory_is_read() -> None:
    """Outside of the arena, in a slot's head, or to too little: an error; to a later message: nothing."""
    message = b"part" * (MIN_REFERENCE_BYTES // 4)
    memory = memoryview(bytearray(SLOT_HEAD_BYTES) + message)
    begin_slot(memory, 4)
    reference = Reference(1, 0, 0, 1, None, None, 7, 0, SLOT_HEAD_BYTES, len(message), 4)
    assert copy_payload(memory, reference) == b"\xdd\0\0\0\x01" + message
    assert copy_payload(memory, reference._replace(generation=3)) is None
    for size, offset, start in (
        *((1, 0, 64), (0, 1, 64), (0, 0, 65), (-1, 0, 64), (-len(message), 0, 64)),
        *((0, 2**64 - 1, 64), (0, 0, 2**64 - 1), (0, 0, 63)),
    ):
        with pytest.raises(ProtocolError) as caught:
            copy_payload(memory, reference._replace(size=len(message) + size, offset=offset, start=start))
        assert caught.value.code is ErrorCode.MALFORMED


@pytest.mark.parametrize(("length", "ends"), [(2, (1, 5000)), (2, (5000, 4096)), (1, (4096,)), (2, (4096,))])
def test_the_ends_of_references_are_checked(length: int, ends: tuple[int, ...]) -> None:
    """They rise to the end of the messages, one for each of several."""
    reference = Reference(
        1, 0, 0, length, ends_to_bytes(array("I", ends)), None, 7, 0, SLOT_HEAD_BYTES, 4096, 4
    )
    with pytest.raises(ProtocolError, match="REFERENCE"):
        decode(encode(reference))


PARTS = [b"a" * 5000, b"b" * 6000, b"c" * 7000]


def test_a_small_part_of_a_batch_goes_as_bytes() -> None:
    """The peer would take a reference to so little for an error."""
    memory, peer = Memory(), Peer(depth=1)
    peer.open()
    peer.outbox.enqueue(peer.queue, memory.several(0, [SMALL, b"s" * (MIN_REFERENCE_BYTES - 1)]))
    peer.queue.trim()
    (sent,) = peer.sent()
    assert isinstance(sent, Batch)
    assert (sent.first_sequence, bytes(sent.payload)[-1:]) == (1, b"s")
    assert (peer.references.sent, peer.references.copied) == (0, 1)
    assert memory.released == [0]


def test_a_batch_in_one_slot_is_cut_like_any_other() -> None:
    """Depth and credit count its messages; each part refers to them where they are."""
    memory, peer = Memory(), Peer(depth=2)
    peer.open()
    peer.queue.restart(5, 0)
    peer.queue.sequence_limit = 0
    peer.outbox.enqueue(peer.queue, memory.several(0, PARTS))
    assert peer.sent() == []
    assert (peer.queue.pending, peer.queue.dropped) == (2, 1)
    for number in (1, 2):
        peer.queue.sequence_limit = number + 1
        peer.outbox.schedule(peer.queue)
        (sent,) = peer.sent()
        assert isinstance(sent, Reference)
        start = SLOT_HEAD_BYTES + sum(map(len, PARTS[:number]))
        assert (sent.first_sequence, sent.length, sent.ends) == (number, 1, None)
        assert (sent.offset, sent.start, sent.size) == (0, start, len(PARTS[number]))
    assert (peer.references.held_bytes, peer.references.sent) == (13_000, 2)
    peer.references.released((0,))
    assert memory.released == []
    peer.references.released((1,))
    assert memory.released == [0]


def test_a_batch_in_one_slot_is_one_reference() -> None:
    """It is decoded with the ends of its messages, and counts as so many."""
    memory, peer = Memory(), Peer()
    peer.open()
    peer.outbox.enqueue(peer.queue, memory.several(4, PARTS))
    (sent,) = peer.sent()
    assert isinstance(sent, Reference)
    assert (sent.first_sequence, sent.length, sent.size) == (4, 3, 18_000)
    assert sent.ends == ends_to_bytes(array("I", (5000, 11_000, 18_000)))
    assert (peer.references.sent, peer.queue.sent) == (3, 3)


def test_a_batch_in_one_slot_leaves_as_bytes_message_by_message() -> None:
    """So that no frame, and no transfer, has more than one of them."""
    memory, peer = Memory(), Peer()
    peer.outbox.enqueue(peer.queue, memory.several(0, PARTS))
    sent = peer.sent()
    assert [type(frame) for frame in sent] == [Batch] * 3
    for number, (batch, part) in enumerate(zip(sent, PARTS, strict=True)):
        assert isinstance(batch, Batch)
        assert bytes(batch.raw) == encode(Batch(5, number, 1, 1, None, {"a": 1}, b"\xdd\0\0\0\1" + part, b""))
    assert (peer.references.copied, peer.queue.sent, peer.queue.pending_bytes) == (3, 3, 0)
    assert memory.released == [0]


def test_only_the_messages_that_are_too_large_are_dropped() -> None:
    """A broker with a lower limit gets the others of their batch."""
    memory, queue = Memory(), PublisherQueue(5, None)
    queue.put(memory.several(0, PARTS))
    assert queue.drop_larger(6000) == 1
    assert (queue.pending, queue.pending_bytes, queue.first_sequence) == (2, 11_000, 0)
    peer = Peer()
    peer.outbox.schedule(queue)
    assert [batch.first_sequence for batch in peer.sent() if isinstance(batch, Batch)] == [0, 1]
    assert (queue.held_bytes, queue.sent) == (0, 2)


def test_many_releases_fit_into_frames() -> None:
    """No frame has more elements than a receiver takes."""
    parts = list(release_frames(range(10_000)))
    assert [number for part in parts for number in part.numbers] == list(range(10_000))
    assert all(decode(encode(part)) == part for part in parts)


def test_a_part_of_a_shared_batch_is_in_the_same_slot() -> None:
    """Also a part of a part: it begins behind the messages that were cut off."""
    whole = Memory().several(1, [b"one", b"two", b"three", b"four"])
    part = slice_batch(slice_batch(whole, 1, 4), 1, 3)
    assert isinstance(part, SharedBatch)
    assert (part.first_sequence, part.length) == (whole.first_sequence + 2, 2)
    assert bytes(memoryview(part.payload)[ARRAY_HEAD_BYTES:]) == b"threefour"

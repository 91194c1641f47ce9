"""The outbox: order, depth, credit, fragments, restarts and its ceiling."""

from __future__ import annotations

import tracemalloc
from collections import deque
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto import limits
from proto.queues.outbox import REPLAY_AHEAD_BYTES, Outbox
from proto.queues.publisher_queue import PublisherQueue
from proto.wire.codec import decode, encode
from proto.wire.fragments import Reassembler, Transfers, WholeFrames
from proto.wire.frames import (
    Abort,
    Batch,
    Cancel,
    Detached,
    Fragment,
    Frame,
    Ping,
    Replay,
    Reply,
    ReplyEntry,
    Undeclare,
)
from tests.proto.outboxes import Replays, drain, make_batch, request, take_one
from tests.seams.protocol import replace_items

if TYPE_CHECKING:
    from collections.abc import Iterable


def test_control_precedes_calls_and_calls_precede_batches() -> None:
    """§6: on one link control frames go first, then requests and replies, then publishers."""
    outbox, queue = Outbox(), PublisherQueue(1, None)
    batch = make_batch(0, [b"a"])
    outbox.enqueue(queue, batch)
    outbox.put_calls(request(1, 1))
    outbox.put_control(encode(Ping(1)))
    assert drain(outbox) == [encode(Ping(1)), request(1, 1), batch.raw]


def test_queues_take_turns_and_large_frames_block_none() -> None:
    """§6: batches of other publishers are sent between the fragments of a large message."""
    outbox, big, small = Outbox(), PublisherQueue(1, None), PublisherQueue(2, None)
    outbox.enqueue(big, make_batch(0, [bytes(4 * limits.FRAGMENT_BYTES)], 1))
    for sequence in range(3):
        outbox.enqueue(small, make_batch(sequence, [b"x"], 2))
    kinds = [type(decode(raw)) for raw in drain(outbox)]
    assert kinds == [Fragment, Batch, Fragment, Batch, Fragment, Batch, Fragment, Fragment]


def test_a_transport_without_a_limit_gets_large_frames_whole() -> None:
    """Batches without a copy, latched messages with their head apart, and each is sent completely at once."""
    outbox, queue = Outbox(transfers=WholeFrames()), PublisherQueue(1, None)
    size = 2 * limits.MAX_FRAME_BYTES
    batch, replay = make_batch(1, [bytes(size)]), Replay(1, *make_batch(0, [bytes(size)])[:-1])
    outbox.put_calls(request(1, size), (1, 1))
    outbox.enqueue(queue, replay)
    outbox.enqueue(queue, batch)
    taken = [outbox.pop_frames(1)[0] for _ in range(3)]
    assert taken[0][1] == request(1, size)
    assert b"".join(taken[1]) == encode(replay)
    assert taken[2][1] is batch.raw
    assert queue.empty
    assert outbox.pop_frames(1) == ([], 0)
    assert (outbox.undroppable_bytes, outbox.bulk_bytes, outbox.replay_bytes) == (0, 0, 0)


def test_the_newest_message_stays_while_an_old_one_is_partly_sent() -> None:
    """§6: a partly sent message does not count for the depth: the newest is kept."""
    outbox, queue = Outbox(), PublisherQueue(1, 1)
    outbox.enqueue(queue, make_batch(0, [bytes(limits.MAX_FRAME_BYTES)]))
    assert take_one(outbox) is not None
    for sequence in (1, 2, 3):
        outbox.enqueue(queue, make_batch(sequence, [b"x"]))
        outbox.trim()
    assert (queue.pending, queue.dropped, queue.first_sequence) == (1, 2, 0)
    last = decode(drain(outbox)[-1])
    assert isinstance(last, Batch)
    assert last.first_sequence == 3


def test_a_batch_is_forwarded_without_a_copy() -> None:
    """§6: a whole batch under its own id is sent as the bytes that were received."""
    outbox, queue = Outbox(), PublisherQueue(1, 10)
    batch = make_batch(0, [b"a", b"b"])
    outbox.enqueue(queue, batch)
    parts, _ = outbox.pop_frames(1)
    assert parts[0] is batch.raw


def test_a_long_batch_is_trimmed_to_its_last_messages() -> None:
    """§6: of a batch longer than the depth, the last `depth` messages stay."""
    outbox, queue = Outbox(), PublisherQueue(1, 2)
    outbox.enqueue(queue, make_batch(0, [b"a", b"b", b"c"]))
    outbox.trim()
    frame = decode(drain(outbox)[0])
    assert isinstance(frame, Batch)
    assert (frame.first_sequence, frame.length, queue.dropped) == (1, 2, 1)


def test_a_keep_last_queue_without_credit_is_trimmed() -> None:
    """§6: the depth also limits messages that wait for credit."""
    outbox, queue = Outbox(), PublisherQueue(1, 2)
    queue.sequence_limit = 0
    for sequence in range(5):
        outbox.enqueue(queue, make_batch(sequence, [b"x"]))
    assert take_one(outbox) is None
    outbox.trim()
    assert (queue.pending, queue.dropped) == (2, 3)


def test_a_frame_behind_dropped_messages_is_sent() -> None:
    """A control frame that becomes the first one because messages are dropped is sent."""
    outbox, queue = Outbox(), PublisherQueue(1, 1)
    queue.sequence_limit = 0
    detached = encode(Detached(1, (1,), 0))
    outbox.enqueue(queue, make_batch(0, [b"x"]))
    outbox.enqueue(queue, detached)
    outbox.enqueue(queue, make_batch(1, [b"y"]))
    assert take_one(outbox) is None
    outbox.trim()
    assert outbox.has_more
    assert take_one(outbox) == detached


def test_credit_beyond_a_gap_lets_one_message_through() -> None:
    """§6: messages dropped for lack of credit do not put the next one beyond every limit."""
    outbox, queue = Outbox(), PublisherQueue(1, 1)
    outbox.enqueue(queue, make_batch(0, [b"a"]))
    assert take_one(outbox) is not None
    queue.sequence_limit = 1
    for sequence in range(1, 100):
        outbox.enqueue(queue, make_batch(sequence, [b"x"]))
        outbox.trim()
    assert take_one(outbox) is None
    queue.sequence_limit = 2
    outbox.schedule(queue)
    frame = decode(drain(outbox)[0])
    assert isinstance(frame, Batch)
    assert (frame.first_sequence, frame.length) == (99, 1)


def test_byte_credit_is_overrun_by_less_than_one_message() -> None:
    """§6: of a waiting batch, only the messages that begin below the byte limit are sent."""
    outbox, queue = Outbox(), PublisherQueue(1, None)
    queue.byte_limit = 25
    outbox.enqueue(queue, make_batch(0, [bytes(10)] * 9))
    frames = [decode(raw) for raw in drain(outbox)]
    assert [frame.length for frame in frames if isinstance(frame, Batch)] == [3]
    assert (queue.sent_bytes, queue.pending, queue.pending_bytes) == (30, 6, 60)


def test_open_transfers_are_limited() -> None:
    """§6: at most MAX_TRANSFERS frames are being sent in fragments; the others wait."""
    outbox = Outbox()
    for call in range(limits.MAX_TRANSFERS + 3):
        outbox.put_calls(request(call, 2 * limits.MAX_FRAME_BYTES), (1, call))
    reassembler = Reassembler()
    whole = [reassembler.add(frame) for frame in map(decode, drain(outbox)) if isinstance(frame, Fragment)]
    assert sum(raw is not None for raw in whole) == limits.MAX_TRANSFERS + 3
    assert outbox.urgent_bytes == 0


def test_large_calls_under_one_key_are_counted_each() -> None:
    """Two large frames without a key of their own do not leave bytes behind in the count."""
    outbox = Outbox()
    for _ in range(2):
        outbox.put_calls(request(1, limits.MAX_FRAME_BYTES))
        outbox.put_calls(request(1, limits.MAX_FRAME_BYTES), (1, 1))
    drain(outbox)
    assert outbox.urgent_bytes == 0
    assert not outbox.drop_call((1, 1))


def test_cancelling_calls_takes_back_the_large_and_names_the_others() -> None:
    """Queued large calls are removed; the others are cancelled in frames of limited length."""
    outbox = Outbox()
    outbox.put_calls(request(1, limits.MAX_FRAME_BYTES), (1, 1))
    outbox.cancel_calls(1, range(1, 2 * limits.MAX_CALLS_PER_FRAME + 2))
    parts, _ = outbox.pop_frames(2**20)
    cancels = [decode(bytes(part)) for part in parts]
    assert [frame.calls for frame in cancels if isinstance(frame, Cancel)] == [
        tuple(range(2, limits.MAX_CALLS_PER_FRAME + 2)),
        tuple(range(limits.MAX_CALLS_PER_FRAME + 2, 2 * limits.MAX_CALLS_PER_FRAME + 2)),
    ]
    assert len(cancels) == 2


def test_a_large_call_is_forgotten_with_its_last_fragment() -> None:
    """Its bytes stop counting then, not when the link becomes idle."""
    outbox, queue = Outbox(), PublisherQueue(1, None)
    outbox.put_calls(request(1, limits.MAX_FRAME_BYTES), (1, 1))
    for sequence in range(20):
        outbox.enqueue(queue, make_batch(sequence, [b"x"]))
    for _ in range(10):
        take_one(outbox)
    assert queue.pending
    assert outbox.urgent_bytes == 0


def reply(call: int, size: int) -> bytes:
    """Encode a reply of endpoint 1 whose body has this size."""
    return encode(Reply(1, (ReplyEntry(call, 0, more=False, attributes=None, body=bytes(size)),)))


def arrived(raws: list[bytes]) -> list[Frame]:
    """Return the frames in the order in which they are complete."""
    reassembler, found = Reassembler(), list[Frame]()
    for frame in map(decode, raws):
        if isinstance(frame, Abort):
            reassembler.abort(frame)
        elif not isinstance(frame, Fragment):
            found.append(frame)
        elif (whole := reassembler.add(frame)) is not None:
            found.append(decode(whole))
    return found


def test_the_last_frame_of_an_endpoint_follows_its_large_calls() -> None:
    """§7.5: after its UNDECLARE the broker would ignore its replies."""
    outbox = Outbox()
    sizes = (9 * limits.MAX_FRAME_BYTES, limits.MAX_FRAME_BYTES, 1, 5 * limits.MAX_FRAME_BYTES)
    for call, size in enumerate(sizes):  # of different sizes: the last that comes is not the last put
        outbox.put_calls(reply(call, size), (1, call))
    assert not outbox.put_after_calls(1, encode(Undeclare(1)))
    assert outbox.put_after_calls(2, encode(Undeclare(2)))  # it has no calls, and waits for nobody's
    found = arrived(drain(outbox))
    ends = [frame for frame in found if isinstance(frame, Undeclare)]
    assert ends == [Undeclare(2), Undeclare(1)]
    assert found[-1] == Undeclare(1)
    assert sum(isinstance(frame, Reply) for frame in found) == len(sizes)
    assert (outbox.urgent_bytes, outbox.bulk_bytes) == (0, 0)


@pytest.mark.parametrize("begun", [False, True])
def test_the_last_frame_is_sent_when_its_large_calls_are_removed(*, begun: bool) -> None:
    """It waits for them only while they are queued; meanwhile its bytes count."""
    outbox = Outbox()
    outbox.put_calls(request(1, limits.MAX_FRAME_BYTES), (1, 1))
    outbox.put_calls(request(2, limits.MAX_FRAME_BYTES), (1, 2))
    farewell = encode(Undeclare(1))
    assert not outbox.put_after_calls(1, farewell)
    if begun:
        take_one(outbox)
    assert outbox.drop_call((1, 1))
    assert outbox.undroppable_bytes >= len(farewell)
    assert outbox.drop_call((1, 2))
    assert arrived(drain(outbox)) == [Undeclare(1)]
    assert outbox.urgent_bytes == 0


def test_transfer_ids_wrap_around_those_in_use(monkeypatch: pytest.MonkeyPatch) -> None:
    """A transfer's id is never that of another under way, also after 2**32 of them."""
    transfers = Transfers()
    first = transfers.start(b"x")
    assert first is not None
    monkeypatch.setattr(transfers, "_next_id", limits.MAX_U32 - 1)
    ids: list[int] = []
    for _ in range(3):
        transfer = transfers.start(b"x")
        assert transfer is not None
        ids.append(transfer.id)
    assert ids == [limits.MAX_U32, 0, 2]


def test_latched_messages_go_before_what_waits() -> None:
    """A batch put to the front of a trimmed queue is sent first, and the trim keeps its effect."""
    outbox, queue = Outbox(), PublisherQueue(1, 2)
    queue.put(make_batch(5, [b"f", b"g", b"h"]))
    queue.trim()
    queue.put_front(make_batch(1, [b"b"]))
    outbox.schedule(queue)
    batches = [frame for frame in map(decode, drain(outbox)) if isinstance(frame, Batch)]
    assert [(batch.first_sequence, batch.length) for batch in batches] == [(1, 1), (6, 2)]


def test_a_restart_resends_the_half_sent_and_not_the_dropped() -> None:
    """§6: a partly sent batch is sent whole on the next link, and dropped messages stay dropped."""
    outbox, queue = Outbox(), PublisherQueue(1, 2)
    outbox.enqueue(queue, make_batch(0, [bytes(limits.MAX_FRAME_BYTES), b"b"]))
    take_one(outbox)
    outbox.enqueue(queue, make_batch(2, [b"c", b"d", b"e"]))
    outbox.trim()
    queue.restart(9)
    assert (queue.first_sequence, queue.pending, queue.dropped) == (0, 4, 1)
    after = Outbox()
    after.schedule(queue)
    reassembler = Reassembler()
    frames = [decode(raw) for raw in drain(after)]
    whole = [reassembler.add(frame) for frame in frames if isinstance(frame, Fragment)][-1]
    assert whole is not None
    batches = [frame for frame in (decode(whole), *frames) if isinstance(frame, Batch)]
    assert [(batch.publisher, batch.first_sequence, batch.length) for batch in batches] == [
        (9, 0, 2),
        (9, 3, 2),
    ]


def test_frames_between_dropped_runs_stay_in_order() -> None:
    """§6: trimming drops messages only; what stood between them leaves in its order."""
    outbox, queue = Outbox(), PublisherQueue(1, 1)
    raws = [encode(Detached(1, (index,), 0)) for index in range(3)]
    for index, raw in enumerate(raws):
        outbox.enqueue(queue, raw)
        outbox.enqueue(queue, make_batch(index, [b"x"]))
    outbox.trim()
    assert drain(outbox) == [*raws, make_batch(2, [b"x"]).raw]


def test_the_fullest_publisher_queues_give_way() -> None:
    """§6.4.3: above the limit only the fullest KEEP_LAST queues lose their oldest batches."""
    outbox, queues = Outbox(), [PublisherQueue(number, 1000) for number in range(3)]
    keep_all = PublisherQueue(9, None)
    outbox.max_held_bytes = 100_000
    for count, queue in zip((10, 40, 60), queues, strict=True):
        for sequence in range(count):
            outbox.enqueue(queue, make_batch(sequence, [bytes(500)] * 2, queue.publisher))
    outbox.enqueue(keep_all, make_batch(0, [bytes(20_000)], 9))
    outbox.trim()
    few, many, most = queues
    assert outbox.held_bytes <= outbox.max_held_bytes
    assert (few.dropped, keep_all.dropped) == (0, 0)
    assert 0 < many.dropped < most.dropped
    assert abs(many.pending - most.pending) <= 2
    assert most.dropped_for_bytes == most.dropped
    assert most.first_sequence == most.dropped // 2
    drain(outbox)
    assert outbox.held_bytes == 0


@given(
    queues=st.lists(
        st.tuples(st.sampled_from([1, 5, 1000, None]), st.lists(st.integers(1, 20), max_size=20)), max_size=8
    ),
    ceiling=st.integers(0, 60_000),
    size=st.sampled_from([1, 100, 1000]),
)
def test_no_ceiling_takes_a_last_message(
    queues: list[tuple[int | None, list[int]]], ceiling: int, size: int
) -> None:
    """§6.4.3: the rest is below the limit, or KEEP_ALL messages and the last one of each queue."""
    outbox = Outbox()
    outbox.max_held_bytes = ceiling
    made = []
    for number, (depth, lengths) in enumerate(queues, 1):
        queue, first = PublisherQueue(number, depth), 0
        for length in lengths:
            outbox.enqueue(queue, make_batch(first, [bytes(size)] * length, number))
            first += length
        made.append((queue, first))
    outbox.trim()
    assert outbox.held_bytes == sum(queue.held_bytes for queue, _ in made)
    droppable = [queue for queue, _ in made if queue.depth is not None and queue.pending > 1]
    assert outbox.held_bytes <= ceiling or not droppable
    for queue, total in made:
        assert queue.pending + queue.dropped == total
        assert queue.pending >= min(total, 1)
        assert queue.depth is not None or not queue.dropped
    left = dict.fromkeys(range(len(queues) + 1), 0)
    for raw in drain(outbox):
        batch = decode(raw)
        assert isinstance(batch, Batch)
        left[batch.publisher] = batch.first_sequence + batch.length
    assert all(left[queue.publisher] == total for queue, total in made)
    assert outbox.held_bytes == 0


def test_a_restarted_publisher_queue_counts_on_its_new_link_only() -> None:
    """What waits on a link counts there, also if it had waited on another before."""
    queue = PublisherQueue(1, 100)
    for link in (1, 2):
        outbox = Outbox()
        queue.restart(link)
        outbox.schedule(queue)
        outbox.enqueue(queue, make_batch(link * 10, [b"x"] * 3))
        outbox.trim()
        assert outbox.held_bytes == queue.held_bytes > 0
    drain(outbox)
    assert outbox.held_bytes == 0


def test_many_small_runs_reach_the_ceiling_by_what_holds_them() -> None:
    """§6.4.3: the overhead of each waiting batch counts, not only its one byte."""
    outbox, queue = Outbox(), PublisherQueue(1, 10_000)
    outbox.max_held_bytes = 100 * 512
    for sequence in range(1000):
        outbox.enqueue(queue, make_batch(sequence, [b"x"]))
    outbox.trim()
    assert 0 < queue.pending <= 100
    assert queue.dropped_for_bytes == 1000 - queue.pending


def test_the_estimated_overhead_of_a_batch_is_realistic() -> None:
    """The measured memory is between a third of the estimate and twice as much."""
    raws = [make_batch(sequence, [b"x"]).raw for sequence in range(2000)]
    queue = PublisherQueue(1, 10_000)
    tracemalloc.start()
    try:
        for raw in raws:
            batch = decode(bytes(bytearray(raw)))
            assert isinstance(batch, Batch)
            queue.put(batch)
        taken = tracemalloc.get_traced_memory()[0] / len(raws)
    finally:
        tracemalloc.stop()
    assert limits.BATCH_OVERHEAD_BYTES / 3 < taken < 2 * limits.BATCH_OVERHEAD_BYTES


def test_only_batches_count_for_the_limit_of_a_link() -> None:
    """§6.4.3: frames between batches count elsewhere."""
    outbox, queue = Outbox(), PublisherQueue(1, None)
    outbox.enqueue(queue, make_batch(0, [b"x"]))
    outbox.trim()
    judged = outbox.held_bytes
    overhead = limits.BATCH_OVERHEAD_BYTES + limits.MESSAGE_OVERHEAD_BYTES
    assert judged == overhead + queue.pending_bytes
    for index in range(100):
        outbox.enqueue(queue, encode(Detached(1, (index,), 0)))
        outbox.enqueue(queue, encode(Detached(2, (index,), 0)), first=True)
    assert take_one(outbox) is not None
    assert outbox.held_bytes == judged
    drain(outbox)
    assert outbox.held_bytes == queue.held_bytes == 0


def test_latched_messages_and_large_calls_count_separately() -> None:
    """A few of the largest would exceed the limit for small frames with any reader."""
    outbox, queue = Outbox(), PublisherQueue(1, 1)
    outbox.put_control(encode(Ping(1)))
    small = outbox.undroppable_bytes
    size = 2 * limits.MAX_FRAME_BYTES
    outbox.put_calls(request(1, size), (1, 1))
    outbox.put_calls(request(2, size), (1, 2))
    outbox.enqueue(queue, Replay(1, *make_batch(0, [bytes(size)])[:-1]))
    assert outbox.undroppable_bytes == small
    assert 2 * size <= outbox.bulk_bytes < 3 * size
    assert size <= outbox.replay_bytes < 2 * size
    outbox.drop_call((1, 2))
    assert size <= outbox.bulk_bytes < 2 * size
    found = [decode(raw) for raw in drain(outbox)]
    assert sum(not piece.more for piece in found if isinstance(piece, Fragment)) == 2
    assert (outbox.undroppable_bytes, outbox.bulk_bytes, outbox.replay_bytes) == (0, 0, 0)


def test_latched_messages_are_taken_when_they_can_be_sent() -> None:
    """At most a page waits in the outbox; all arrive in order, before the messages behind them."""
    outbox, queue = Outbox(), PublisherQueue(1, 100)
    size = REPLAY_AHEAD_BYTES // 8
    source = Replays(Replay(1, *make_batch(first, [bytes(size)])[:-1]) for first in range(20))
    outbox.enqueue_source(queue, source)
    outbox.enqueue(queue, make_batch(20, [b"live"]))
    most = outbox.replay_bytes
    assert most <= REPLAY_AHEAD_BYTES
    got = []
    while (raw := take_one(outbox)) is not None:
        got.append(decode(raw))
        most = max(most, outbox.replay_bytes)
    assert most <= REPLAY_AHEAD_BYTES
    numbers = [frame.first_sequence for frame in got if isinstance(frame, Replay | Batch)]
    assert numbers == [*range(20), 20]
    assert (outbox.ordered_bytes, outbox.replay_bytes, queue.control_bytes, queue.empty) == (0, 0, 0, True)


def test_a_large_latched_message_is_sent_without_a_copy() -> None:
    """It is taken when its turn comes, and its fragments refer to the latched bytes."""
    outbox, queue = Outbox(), PublisherQueue(1, 100)
    latched = make_batch(0, [bytes(REPLAY_AHEAD_BYTES)])
    source = Replays([Replay(1, *latched[:-1])])
    outbox.enqueue_source(queue, source)
    assert source.left
    parts, _ = outbox.pop_frames(2 * limits.FRAGMENT_BYTES)
    assert isinstance(parts[3], memoryview)
    assert parts[3].obj is memoryview(latched.payload).obj
    received = Reassembler()
    for raw in (b"".join(parts[:2]), b"".join(parts[2:]), *drain(outbox)):
        piece = decode(raw)
        assert isinstance(piece, Fragment)
        whole = received.add(piece)
    assert whole is not None
    replay = decode(whole)
    assert isinstance(replay, Replay)
    assert bytes(replay.payload) == bytes(latched.payload)
    assert (outbox.ordered_bytes, outbox.replay_bytes) == (0, 0)


def test_a_discarded_queue_forgets_its_source() -> None:
    """Nothing of a source is counted or sent any more, also if a large message of it is partly sent."""
    outbox, queue = Outbox(), PublisherQueue(1, 100)
    source = Replays(Replay(1, *make_batch(first, [bytes(REPLAY_AHEAD_BYTES)])[:-1]) for first in range(3))
    outbox.enqueue_source(queue, source)
    outbox.pop_frames(1)
    outbox.discard_queue(queue)
    assert (outbox.ordered_bytes, outbox.replay_bytes, queue.empty) == (0, 0, True)
    assert [type(decode(raw)) for raw in drain(outbox)] == [Abort]


def test_latched_messages_wait_for_a_free_transfer() -> None:
    """The ninth large one is neither started nor encoded before one of eight is sent."""
    outbox = Outbox()
    replay = Replay(1, *make_batch(0, [bytes(limits.MAX_FRAME_BYTES)])[:-1])
    for number in range(limits.MAX_TRANSFERS + 3):
        outbox.enqueue(PublisherQueue(number, 1), replay)
    reassembler, whole = Reassembler(), 0
    for raw in drain(outbox):
        piece = decode(raw)
        assert isinstance(piece, Fragment)
        whole += reassembler.add(piece) is not None
    assert whole == limits.MAX_TRANSFERS + 3


def test_a_drop_does_not_move_the_frames_before_it_again() -> None:
    """However many frames precede the batches of a queue, each drop moves one batch only."""
    outbox, queue = Outbox(), PublisherQueue(1, 1)
    ahead = [encode(Detached(1, (number,), 0)) for number in range(50)]
    for raw in ahead:
        outbox.enqueue(queue, raw)
    outbox.enqueue(queue, make_batch(0, [b"x"] * 2))
    outbox.trim()
    moved = replace_items(queue, _CountingDeque)
    behind = encode(Detached(1, (99,), 0))
    for first in range(2, 20):
        outbox.enqueue(queue, make_batch(first, [b"x"]))
        outbox.trim()
    assert moved.moves <= 18
    outbox.enqueue(queue, behind)
    *heads, last, end = drain(outbox)
    assert (heads, end) == (ahead, behind)
    frame = decode(last)
    assert isinstance(frame, Batch)
    assert (frame.first_sequence, frame.length, queue.dropped) == (19, 1, 19)


class _CountingDeque(deque[Any]):
    """Counts the items taken from the left and put there."""

    moves = 0

    def popleft(self) -> Any:
        self.moves += 1
        return super().popleft()

    def extendleft(self, iterable: Iterable[Any], /) -> None:
        items = list(iterable)
        self.moves += len(items)
        super().extendleft(items)

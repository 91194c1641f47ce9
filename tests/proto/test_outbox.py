"""The outbox: order, depth, credit, fragments, restarts and its ceiling."""

from __future__ import annotations

import tracemalloc
from collections import deque
from typing import TYPE_CHECKING

import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto import limits
from proto.codec import decode, encode
from proto.fragments import Reassembler
from proto.frames import (
    Abort,
    Cancel,
    Detached,
    Fragment,
    Frame,
    Ping,
    Replay,
    Reply,
    ReplyEntry,
    Run,
    Undeclare,
)
from proto.lane import Lane, Transfers
from proto.outbox import Outbox
from tests.proto.outboxes import drain, make_run, request, take_one

if TYPE_CHECKING:
    from collections.abc import Iterable


def test_control_goes_before_calls_and_calls_before_runs() -> None:
    """§6: on one link control frames go first, then requests and replies, then publishers."""
    outbox, lane = Outbox(), Lane(1, None)
    run = make_run(0, [b"a"])
    outbox.put_lane(lane, run)
    outbox.put_calls(request(1, 1))
    outbox.put_control(encode(Ping(1)))
    assert drain(outbox) == [encode(Ping(1)), request(1, 1), run.raw]


def test_lanes_take_turns_and_large_frames_hold_up_nobody() -> None:
    """§6: while a large message leaves in pieces, other publishers' runs go between them."""
    outbox, big, small = Outbox(), Lane(1, None), Lane(2, None)
    outbox.put_lane(big, make_run(0, [bytes(4 * limits.FRAGMENT_BYTES)], 1))
    for sequence in range(3):
        outbox.put_lane(small, make_run(sequence, [b"x"], 2))
    kinds = [type(decode(raw)) for raw in drain(outbox)]
    assert kinds == [Fragment, Run, Fragment, Run, Fragment, Run, Fragment, Fragment]


def test_the_newest_message_stays_while_an_old_one_leaves() -> None:
    """§6: a message that has begun to leave does not count against the depth: the newest is kept."""
    outbox, lane = Outbox(), Lane(1, 1)
    outbox.put_lane(lane, make_run(0, [bytes(limits.MAX_FRAME_BYTES)]))
    assert take_one(outbox) is not None
    for sequence in (1, 2, 3):
        outbox.put_lane(lane, make_run(sequence, [b"x"]))
        outbox.trim()
    assert (lane.pending, lane.dropped, lane.first_sequence) == (1, 2, 0)
    last = decode(drain(outbox)[-1])
    assert isinstance(last, Run)
    assert last.first_sequence == 3


def test_a_run_is_forwarded_without_a_copy() -> None:
    """§6: an uncut run under its own id leaves as the very bytes that came."""
    outbox, lane = Outbox(), Lane(1, 10)
    run = make_run(0, [b"a", b"b"])
    outbox.put_lane(lane, run)
    parts, _ = outbox.take(1)
    assert parts[0] is run.raw


def test_a_long_run_is_trimmed_to_its_last_messages() -> None:
    """§6: a run longer than the depth keeps its last `depth` messages; with room, all go."""
    outbox, lane = Outbox(), Lane(1, 2)
    outbox.put_lane(lane, make_run(0, [b"a", b"b", b"c"]))
    outbox.trim()
    frame = decode(drain(outbox)[0])
    assert isinstance(frame, Run)
    assert (frame.first_sequence, frame.length, lane.dropped) == (1, 2, 1)


def test_a_keep_last_lane_out_of_credit_is_trimmed() -> None:
    """§6: what credit holds back is bounded by the depth, too."""
    outbox, lane = Outbox(), Lane(1, 2)
    lane.sequence_limit = 0
    for sequence in range(5):
        outbox.put_lane(lane, make_run(sequence, [b"x"]))
    assert take_one(outbox) is None
    outbox.trim()
    assert (lane.pending, lane.dropped) == (2, 3)


def test_what_stood_behind_dropped_messages_leaves() -> None:
    """A control frame that comes to the front as messages without credit are dropped may go."""
    outbox, lane = Outbox(), Lane(1, 1)
    lane.sequence_limit = 0
    detached = encode(Detached(1, (1,), 0))
    outbox.put_lane(lane, make_run(0, [b"x"]))
    outbox.put_lane(lane, detached)
    outbox.put_lane(lane, make_run(1, [b"y"]))
    assert take_one(outbox) is None
    outbox.trim()
    assert outbox.has_more
    assert take_one(outbox) == detached


def test_credit_beyond_a_gap_lets_one_message_through() -> None:
    """§6: messages dropped for want of credit cannot leave the next one out of every limit's reach."""
    outbox, lane = Outbox(), Lane(1, 1)
    outbox.put_lane(lane, make_run(0, [b"a"]))
    assert take_one(outbox) is not None
    lane.sequence_limit = 1
    for sequence in range(1, 100):
        outbox.put_lane(lane, make_run(sequence, [b"x"]))
        outbox.trim()
    assert take_one(outbox) is None
    lane.sequence_limit = 2
    outbox.wake(lane)
    frame = decode(drain(outbox)[0])
    assert isinstance(frame, Run)
    assert (frame.first_sequence, frame.length) == (99, 1)


def test_byte_credit_is_overrun_by_less_than_one_message() -> None:
    """§6: of a waiting run only the messages leave that begin below the byte limit."""
    outbox, lane = Outbox(), Lane(1, None)
    lane.byte_limit = 25
    outbox.put_lane(lane, make_run(0, [bytes(10)] * 9))
    frames = [decode(raw) for raw in drain(outbox)]
    assert [frame.length for frame in frames if isinstance(frame, Run)] == [3]
    assert (lane.sent_bytes, lane.pending, lane.pending_bytes) == (30, 6, 60)


def test_transfers_at_a_time_are_limited() -> None:
    """§6: at most MAX_TRANSFERS fragmented frames are under way; the others wait whole."""
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
    """What has not left whole is dropped; the rest is cancelled in frames that are not too long."""
    outbox = Outbox()
    outbox.put_calls(request(1, limits.MAX_FRAME_BYTES), (1, 1))
    outbox.cancel_calls(1, range(1, 2 * limits.MAX_CALLS_PER_FRAME + 2))
    parts, _ = outbox.take(2**20)
    cancels = [decode(bytes(part)) for part in parts]
    assert [frame.calls for frame in cancels if isinstance(frame, Cancel)] == [
        tuple(range(2, limits.MAX_CALLS_PER_FRAME + 2)),
        tuple(range(limits.MAX_CALLS_PER_FRAME + 2, 2 * limits.MAX_CALLS_PER_FRAME + 2)),
    ]
    assert len(cancels) == 2


def test_a_large_call_is_forgotten_as_soon_as_it_has_left() -> None:
    """Its bytes stop counting with its last piece, not when the link falls idle."""
    outbox, lane = Outbox(), Lane(1, None)
    outbox.put_calls(request(1, limits.MAX_FRAME_BYTES), (1, 1))
    for sequence in range(20):
        outbox.put_lane(lane, make_run(sequence, [b"x"]))
    for _ in range(10):
        take_one(outbox)
    assert lane.pending
    assert outbox.urgent_bytes == 0


def reply(call: int, size: int) -> bytes:
    """Encode a reply of endpoint 1 whose body has this size."""
    return encode(Reply(1, (ReplyEntry(call, 0, more=False, attributes=None, body=bytes(size)),)))


def arrived(raws: list[bytes]) -> list[Frame]:
    """Return frames in the order in which they have come whole."""
    reassembler, found = Reassembler(), list[Frame]()
    for frame in map(decode, raws):
        if isinstance(frame, Abort):
            reassembler.abort(frame)
        elif not isinstance(frame, Fragment):
            found.append(frame)
        elif (whole := reassembler.add(frame)) is not None:
            found.append(decode(whole))
    return found


def test_the_last_word_of_an_endpoint_comes_behind_its_large_calls() -> None:
    """§7.5: with its UNDECLARE before them, replies that have been made would count for nothing."""
    outbox = Outbox()
    sizes = (9 * limits.MAX_FRAME_BYTES, limits.MAX_FRAME_BYTES, 1, 5 * limits.MAX_FRAME_BYTES)
    for call, size in enumerate(sizes):  # of different sizes: the last that comes is not the last put
        outbox.put_calls(reply(call, size), (1, call))
    assert not outbox.put_behind_calls(1, encode(Undeclare(1)))
    assert outbox.put_behind_calls(2, encode(Undeclare(2)))  # it has no calls, and waits for nobody's
    found = arrived(drain(outbox))
    ends = [frame for frame in found if isinstance(frame, Undeclare)]
    assert ends == [Undeclare(2), Undeclare(1)]
    assert found[-1] == Undeclare(1)
    assert sum(isinstance(frame, Reply) for frame in found) == len(sizes)
    assert (outbox.urgent_bytes, outbox.bulk_bytes) == (0, 0)


@pytest.mark.parametrize("begun", [False, True])
def test_the_last_word_goes_when_its_large_calls_are_taken_back(*, begun: bool) -> None:
    """It waits for what is to come, and that will not come any more; meanwhile it counts as waiting."""
    outbox = Outbox()
    outbox.put_calls(request(1, limits.MAX_FRAME_BYTES), (1, 1))
    outbox.put_calls(request(2, limits.MAX_FRAME_BYTES), (1, 2))
    farewell = encode(Undeclare(1))
    assert not outbox.put_behind_calls(1, farewell)
    if begun:
        take_one(outbox)
    assert outbox.drop_call((1, 1))
    assert outbox.firm_bytes >= len(farewell)
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
    """A run put to the front of a trimmed lane leaves first, and the trim keeps its effect."""
    outbox, lane = Outbox(), Lane(1, 2)
    lane.put(make_run(5, [b"f", b"g", b"h"]))
    lane.trim()
    lane.put_front(make_run(1, [b"b"]))
    outbox.wake(lane)
    runs = [frame for frame in map(decode, drain(outbox)) if isinstance(frame, Run)]
    assert [(run.first_sequence, run.length) for run in runs] == [(1, 1), (6, 2)]


def test_a_restart_resends_the_half_sent_and_not_the_dropped() -> None:
    """§6: a run half of which had left goes whole on the next link, and what was dropped stays dropped."""
    outbox, lane = Outbox(), Lane(1, 2)
    outbox.put_lane(lane, make_run(0, [bytes(limits.MAX_FRAME_BYTES), b"b"]))
    take_one(outbox)
    outbox.put_lane(lane, make_run(2, [b"c", b"d", b"e"]))
    outbox.trim()
    lane.restart(9)
    assert (lane.first_sequence, lane.pending, lane.dropped) == (0, 4, 1)
    after = Outbox()
    after.wake(lane)
    reassembler = Reassembler()
    frames = [decode(raw) for raw in drain(after)]
    whole = [reassembler.add(frame) for frame in frames if isinstance(frame, Fragment)][-1]
    assert whole is not None
    runs = [frame for frame in (decode(whole), *frames) if isinstance(frame, Run)]
    assert [(run.publisher, run.first_sequence, run.length) for run in runs] == [(9, 0, 2), (9, 3, 2)]


def test_frames_between_dropped_runs_stay_in_order() -> None:
    """§6: trimming drops messages only; what stood between them leaves in its order."""
    outbox, lane = Outbox(), Lane(1, 1)
    raws = [encode(Detached(1, (index,), 0)) for index in range(3)]
    for index, raw in enumerate(raws):
        outbox.put_lane(lane, raw)
        outbox.put_lane(lane, make_run(index, [b"x"]))
    outbox.trim()
    assert drain(outbox) == [*raws, make_run(2, [b"x"]).raw]


def test_the_fullest_lanes_give_way() -> None:
    """§6.4.3: above the ceiling the fullest KEEP_LAST lanes lose their oldest runs, the others nothing."""
    outbox, lanes = Outbox(), [Lane(number, 1000) for number in range(3)]
    keep_all = Lane(9, None)
    outbox.max_held_bytes = 100_000
    for count, lane in zip((10, 40, 60), lanes, strict=True):
        for sequence in range(count):
            outbox.put_lane(lane, make_run(sequence, [bytes(500)] * 2, lane.publisher))
    outbox.put_lane(keep_all, make_run(0, [bytes(20_000)], 9))
    outbox.trim()
    few, many, most = lanes
    assert outbox.held_bytes <= outbox.max_held_bytes
    assert (few.dropped, keep_all.dropped) == (0, 0)
    assert 0 < many.dropped < most.dropped
    assert abs(many.pending - most.pending) <= 2
    assert most.dropped_for_bytes == most.dropped
    assert most.first_sequence == most.dropped // 2
    drain(outbox)
    assert outbox.held_bytes == 0


@given(
    lanes=st.lists(
        st.tuples(st.sampled_from([1, 5, 1000, None]), st.lists(st.integers(1, 20), max_size=20)), max_size=8
    ),
    ceiling=st.integers(0, 60_000),
    size=st.sampled_from([1, 100, 1000]),
)
def test_no_ceiling_takes_a_last_message(
    lanes: list[tuple[int | None, list[int]]], ceiling: int, size: int
) -> None:
    """§6.4.3: what is left is below the ceiling, or is KEEP_ALL's and the last message of each other lane."""
    outbox = Outbox()
    outbox.max_held_bytes = ceiling
    made = []
    for number, (depth, lengths) in enumerate(lanes, 1):
        lane, first = Lane(number, depth), 0
        for length in lengths:
            outbox.put_lane(lane, make_run(first, [bytes(size)] * length, number))
            first += length
        made.append((lane, first))
    outbox.trim()
    assert outbox.held_bytes == sum(lane.held_bytes for lane, _ in made)
    droppable = [lane for lane, _ in made if lane.depth is not None and lane.pending > 1]
    assert outbox.held_bytes <= ceiling or not droppable
    for lane, total in made:
        assert lane.pending + lane.dropped == total
        assert lane.pending >= min(total, 1)
        assert lane.depth is not None or not lane.dropped
    left = dict.fromkeys(range(len(lanes) + 1), 0)
    for raw in drain(outbox):
        run = decode(raw)
        assert isinstance(run, Run)
        left[run.publisher] = run.first_sequence + run.length
    assert all(left[lane.publisher] == total for lane, total in made)
    assert outbox.held_bytes == 0


def test_a_restarted_lane_counts_on_its_new_link_only() -> None:
    """What waits on a link counts there, also if it had waited on another before."""
    lane = Lane(1, 100)
    for link in (1, 2):
        outbox = Outbox()
        lane.restart(link)
        outbox.wake(lane)
        outbox.put_lane(lane, make_run(link * 10, [b"x"] * 3))
        outbox.trim()
        assert outbox.held_bytes == lane.held_bytes > 0
    drain(outbox)
    assert outbox.held_bytes == 0


def test_many_small_runs_reach_the_ceiling_by_what_holds_them() -> None:
    """§6.4.3: a message of one byte takes hundreds while it waits: fifty KiB are no room for a thousand."""
    outbox, lane = Outbox(), Lane(1, 10_000)
    outbox.max_held_bytes = 100 * 512
    for sequence in range(1000):
        outbox.put_lane(lane, make_run(sequence, [b"x"]))
    outbox.trim()
    assert 0 < lane.pending <= 100
    assert lane.dropped_for_bytes == 1000 - lane.pending


def test_what_a_waiting_run_takes_is_about_what_is_counted() -> None:
    """Measured: neither half as much nor thrice."""
    raws = [make_run(sequence, [b"x"]).raw for sequence in range(2000)]
    lane = Lane(1, 10_000)
    tracemalloc.start()
    try:
        for raw in raws:
            run = decode(bytes(bytearray(raw)))
            assert isinstance(run, Run)
            lane.put(run)
        taken = tracemalloc.get_traced_memory()[0] / len(raws)
    finally:
        tracemalloc.stop()
    assert limits.RUN_HELD_BYTES / 3 < taken < 2 * limits.RUN_HELD_BYTES


def test_only_runs_count_for_the_ceiling() -> None:
    """§6.4.3: what waits between runs counts elsewhere: a link with room never holds more than before."""
    outbox, lane = Outbox(), Lane(1, None)
    outbox.put_lane(lane, make_run(0, [b"x"]))
    outbox.trim()
    judged = outbox.held_bytes
    assert judged == limits.RUN_HELD_BYTES + lane.pending_bytes
    for index in range(100):
        outbox.put_lane(lane, encode(Detached(1, (index,), 0)))
        outbox.put_lane(lane, encode(Detached(2, (index,), 0)), first=True)
    assert take_one(outbox) is not None
    assert outbox.held_bytes == judged
    drain(outbox)
    assert outbox.held_bytes == lane.held_bytes == 0


def test_latched_messages_and_large_calls_count_apart() -> None:
    """They may be a few of the largest that there are: a limit for small frames would cut off any reader."""
    outbox, lane = Outbox(), Lane(1, 1)
    outbox.put_control(encode(Ping(1)))
    small = outbox.firm_bytes
    size = 2 * limits.MAX_FRAME_BYTES
    outbox.put_calls(request(1, size), (1, 1))
    outbox.put_calls(request(2, size), (1, 2))
    outbox.put_lane(lane, Replay(1, *make_run(0, [bytes(size)])[:-1]))
    assert outbox.firm_bytes == small
    assert 3 * size <= outbox.bulk_bytes < 4 * size
    outbox.drop_call((1, 2))
    assert 2 * size <= outbox.bulk_bytes < 3 * size
    found = [decode(raw) for raw in drain(outbox)]
    assert sum(not piece.more for piece in found if isinstance(piece, Fragment)) == 2
    assert (outbox.firm_bytes, outbox.bulk_bytes, outbox.held_bytes) == (0, 0, 0)


def test_latched_messages_wait_for_a_free_transfer() -> None:
    """A ninth large one is not begun, nor encoded, before one of eight has left."""
    outbox = Outbox()
    replay = Replay(1, *make_run(0, [bytes(limits.MAX_FRAME_BYTES)])[:-1])
    for number in range(limits.MAX_TRANSFERS + 3):
        outbox.put_lane(Lane(number, 1), replay)
    reassembler, whole = Reassembler(), 0
    for raw in drain(outbox):
        piece = decode(raw)
        assert isinstance(piece, Fragment)
        whole += reassembler.add(piece) is not None
    assert whole == limits.MAX_TRANSFERS + 3


def test_a_drop_does_not_pass_the_frames_before_it_again() -> None:
    """However many frames stand before a lane's runs, each drop looks at its run only."""
    outbox, lane = Outbox(), Lane(1, 1)
    ahead = [encode(Detached(1, (number,), 0)) for number in range(50)]
    for raw in ahead:
        outbox.put_lane(lane, raw)
    outbox.put_lane(lane, make_run(0, [b"x"] * 2))
    outbox.trim()
    moved = _CountingDeque(lane._queue)
    lane._queue = moved
    behind = encode(Detached(1, (99,), 0))
    for first in range(2, 20):
        outbox.put_lane(lane, make_run(first, [b"x"]))
        outbox.trim()
    assert moved.moves <= 18
    outbox.put_lane(lane, behind)
    *heads, last, end = drain(outbox)
    assert (heads, end) == (ahead, behind)
    frame = decode(last)
    assert isinstance(frame, Run)
    assert (frame.first_sequence, frame.length, lane.dropped) == (19, 1, 19)


class _CountingDeque(deque[Run | Replay | bytes]):
    """Counts what is taken from its left and put there."""

    moves = 0

    def popleft(self) -> Run | Replay | bytes:
        self.moves += 1
        return super().popleft()

    def extendleft(self, iterable: Iterable[Run | Replay | bytes], /) -> None:
        items = list(iterable)
        self.moves += len(items)
        super().extendleft(items)

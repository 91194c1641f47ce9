"""The read budget: what one connection, and all together, may have handled in one loop turn."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

from hypothesis import given
from hypothesis import strategies as st

from proto.aio.budgeted_channel import BudgetedChannel
from proto.aio.read_budget import BUDGET_SEC, SHARE_FRAMES, SHARE_SEC, ReadBudget
from proto.errors import ErrorCode, ProtocolError
from proto.wire import frames
from proto.wire.codec import encode
from proto.wire.frames import Batch, Frame
from tests.broker import frame_makers as make
from tests.proto.aio.bench import Bench, FakeLoop

if TYPE_CHECKING:
    import asyncio
    from collections.abc import Callable

PONG = encode(frames.Pong(1))


def budgeted(bench: Bench) -> BudgetedChannel:
    """Return the bench's channel, which has a budget."""
    assert isinstance(bench.channel, BudgetedChannel)
    return bench.channel


class Room:
    """Channels of one broker, on a loop whose turns the test counts and a clock that it sets.

    Args:
        frame_sec: What handling one frame takes.
    """

    def __init__(self, channels: int = 1, frame_sec: float = 0.0) -> None:
        self.loop = FakeLoop()
        self.now = 0.0
        self.order: list[int] = []
        """The channels whose frames were handled, in this order."""
        self.budget = ReadBudget(cast("asyncio.AbstractEventLoop", self.loop), lambda: self.now)
        self.benches = [Bench(loop=self.loop, budget=self.budget) for _ in range(channels)]
        for number, bench in enumerate(self.benches):
            bench.handler.react = self._reaction(number, frame_sec)

    def _reaction(self, number: int, frame_sec: float) -> Callable[[Frame], None]:
        def react(_: Frame) -> None:
            self.now += frame_sec
            self.order.append(number)

        return react

    def handled_by_turn(self) -> list[int]:
        """Run the loop until nothing waits; return the frames that each turn has handled."""
        counts: list[int] = []
        while any(budgeted(bench).waiting for bench in self.benches):
            before = len(self.order)
            self.loop.turn()
            counts.append(len(self.order) - before)
            assert len(counts) < 1000
        return counts


def test_a_read_of_many_frames_is_handled_in_shares() -> None:
    """Case 54: a turn handles at most 500 frames of a connection, which is not read until all are handled."""
    room = Room()
    (bench,) = room.benches
    bench.feed(PONG * (3 * SHARE_FRAMES + 7))
    assert len(room.order) == SHARE_FRAMES
    assert not bench.transport.reading
    assert budgeted(bench).kept_bytes == len(PONG) * (2 * SHARE_FRAMES + 7)
    assert room.handled_by_turn() == [SHARE_FRAMES, SHARE_FRAMES, 7]
    room.loop.turn()
    assert bench.transport.reading
    assert budgeted(bench).kept_bytes == 0


def test_the_answers_keep_their_order() -> None:
    """§4.3.2: each PING is answered, in order, however many turns that takes."""
    room = Room()
    (bench,) = room.benches
    bench.handler.react = lambda frame: bench.channel.send(frames.Pong(cast("frames.Ping", frame).token))
    bench.feed(b"".join(encode(frames.Ping(token)) for token in range(2000)))
    room.handled_by_turn()
    while room.loop.soon:
        room.loop.turn()
    assert [frame.token for frame in bench.transport.sent() if isinstance(frame, frames.Pong)] == list(
        range(2000)
    )


def test_slow_frames_end_a_share_earlier() -> None:
    """Case 43: frames that take long to handle are counted by time; one that takes very long comes alone."""
    room = Room(frame_sec=SHARE_SEC / 3.5)
    room.benches[0].feed(PONG * 10)
    assert [len(room.order), *room.handled_by_turn()] == [4, 4, 2]
    room = Room(frame_sec=10 * SHARE_SEC)
    room.benches[0].feed(PONG * 3)
    assert [len(room.order), *room.handled_by_turn()] == [1, 1, 1]


def test_all_connections_share_one_budget_in_turn() -> None:
    """When the budget of a turn is used, further reads are kept whole; their shares come in later turns."""
    room = Room(channels=8, frame_sec=SHARE_SEC / 2)
    per_turn = round(BUDGET_SEC / SHARE_SEC)
    for bench in room.benches:
        bench.feed(PONG * 4)
    assert room.order == [number for number in range(per_turn) for _ in range(2)]
    room.order.clear()
    room.loop.turn()
    assert room.order == [0, 0, 1, 1, 2, 2, 3, 3, 4, 4]
    room.loop.turn()
    assert room.order[10:] == [5, 5, 6, 6, 7, 7]
    room.handled_by_turn()
    assert all(len(bench.handler.frames) == 4 for bench in room.benches)


def test_a_single_small_read_needs_no_loop_turn() -> None:
    """A broker with little to do schedules nothing for its budget."""
    room = Room(frame_sec=SHARE_SEC / 10)
    room.benches[0].feed(PONG)
    assert len(room.order) == 1
    assert room.loop.soon == []


def test_a_connection_gets_one_share_a_turn() -> None:
    """It reads on in the turn after its last share, not in the same."""
    room = Room()
    (bench,) = room.benches
    bench.feed(PONG * (SHARE_FRAMES + 1))
    room.loop.turn()
    assert len(room.order) == SHARE_FRAMES + 1
    assert not bench.transport.reading
    room.loop.turn()
    assert bench.transport.reading


def test_fragments_count_as_frames() -> None:
    """Tens of thousands of fragments of one byte do not pass for one frame."""
    room = Room()
    (bench,) = room.benches
    piece = encode(frames.Fragment(1, None, True, b"x"))
    bench.feed(encode(frames.Fragment(1, 10**6, True, b"x")) + piece * 2 * SHARE_FRAMES)
    assert budgeted(bench).waiting
    assert len(room.handled_by_turn()) == 2


def test_kept_bytes_survive_the_reads_of_others() -> None:
    """Bytes of other connections do not touch kept ones: they share the buffer for reading only."""
    room = Room(channels=2)
    one, two = room.benches
    one.feed(b"".join(encode(frames.Pong(token)) for token in range(SHARE_FRAMES + 100)))
    two.feed(encode(frames.Pong(7)) * 100)
    room.handled_by_turn()
    assert [frame.token for frame in one.handler.frames if isinstance(frame, frames.Pong)] == list(
        range(SHARE_FRAMES + 100)
    )
    assert len(two.handler.frames) == 100


def test_an_end_discards_what_waits() -> None:
    """Closed, aborted, failed or lost: no further frame is handled, and its bytes are freed."""
    ends: list[Callable[[Bench], None]] = [
        lambda bench: bench.channel.close(),
        lambda bench: bench.channel.abort(),
        lambda bench: bench.channel.fail(ProtocolError(ErrorCode.LIMIT, "enough")),
        lambda bench: bench.channel.connection_lost(None),
    ]
    for end in ends:
        room = Room()
        (bench,) = room.benches
        bench.feed(PONG * (SHARE_FRAMES + 1))
        end(bench)
        while room.loop.soon:
            room.loop.turn()
        assert (budgeted(bench).waiting, budgeted(bench).kept_bytes) == (False, 0)
        assert len(room.order) == SHARE_FRAMES
        assert not bench.transport.reading


def test_an_error_among_kept_frames_is_the_last_thing_handled() -> None:
    """A bad frame in a later share is answered like one in the first."""
    room = Room()
    (bench,) = room.benches
    bench.feed(PONG * (SHARE_FRAMES + 1) + encode(frames.Node(1, "/n"))[:-1] + b"\xff" * 20 + PONG * 3)
    room.handled_by_turn()
    assert bench.farewell().code == ErrorCode.MALFORMED
    assert len(room.order) == SHARE_FRAMES + 1


def test_a_bug_in_a_handler_ends_its_connection_only() -> None:
    """An unexpected exception in a later share aborts the connection; the others that wait get their turn."""
    room = Room(channels=2)
    for bench in room.benches:
        bench.feed(PONG * (SHARE_FRAMES + 1))

    def fail(_: Frame) -> None:
        raise ZeroDivisionError

    room.benches[0].handler.react = fail
    for _ in range(4):
        try:
            room.loop.turn()
        except ZeroDivisionError:
            assert room.benches[0].transport.aborted
    assert len(room.benches[1].handler.frames) == SHARE_FRAMES + 1
    assert not room.benches[1].transport.aborted


@given(st.lists(st.integers(min_value=1, max_value=400_000), max_size=20), st.integers(1, 20))
def test_any_split_and_any_share_give_the_same_frames(sizes: list[int], share: int) -> None:
    """Small frames, large ones and fragments come out once and in order, wherever reads and shares end."""
    room = Room(frame_sec=SHARE_SEC / share)
    (bench,) = room.benches
    small = b"".join(encode(frames.Pong(token)) for token in range(40))
    large = [bytes(make.batch(1, first, size=size).raw) for first, size in ((0, 100_000), (1, 200_000))]
    data = small + large[0] + small + large[1] + small + large[0][:-1] + large[0][-1:]
    expected = data
    for size in (*sizes, len(data)):
        piece, data = data[:size], data[size:]
        while piece:
            while not bench.transport.reading:
                room.loop.turn()
            buffer = bench.channel.get_buffer(-1)
            count = min(len(buffer), len(piece))
            buffer[:count] = piece[:count]
            bench.channel.buffer_updated(count)
            piece = piece[count:]
    room.handled_by_turn()
    found = b"".join(
        bytes(frame.raw) if isinstance(frame, Batch) else encode(frame) for frame in bench.handler.frames
    )
    assert found == expected

"""Fragments: interleaved transfers are reassembled, and memory follows the received bytes."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto import limits
from proto.errors import ErrorCode, ProtocolError
from proto.wire.codec import decode
from proto.wire.codes import Op
from proto.wire.fragments import Reassembler, ReassemblyTotal, Transfer, is_large
from proto.wire.frames import Abort, Fragment
from tests.allocations import peak_bytes


def pieces(transfer_id: int, raw: bytes) -> list[Fragment]:
    """Cut a frame and decode its pieces."""
    transfer = Transfer(transfer_id, raw)
    found: list[Fragment] = []
    last = False
    while not last:
        head, payload, last = transfer.next()
        encoded = head + payload
        assert not is_large(encoded)
        fragment = decode(encoded)
        assert isinstance(fragment, Fragment)
        found.append(fragment)
    return found


def refused(reassembler: Reassembler, fragment: Fragment) -> ErrorCode:
    """Add a piece that must not be there."""
    with pytest.raises(ProtocolError) as caught:
        reassembler.add(fragment)
    return caught.value.code


@given(st.lists(st.integers(1, 3 * limits.FRAGMENT_BYTES + 1), min_size=1, max_size=5), st.randoms())
def test_interleaved_transfers_come_back_whole(sizes: list[int], random: object) -> None:
    """§6: pieces of several transfers may mix; each frame comes back as it was, with its last piece."""
    frames = {index: bytes([index]) * size for index, size in enumerate(sizes)}
    queues = [pieces(index, raw) for index, raw in frames.items()]
    reassembler = Reassembler()
    done: dict[int, bytes] = {}
    while queues:
        queue = random.choice(queues)  # type: ignore[attr-defined]
        fragment = queue.pop(0)
        whole = reassembler.add(fragment)
        assert (whole is not None) == (not fragment.more)
        if whole is not None:
            done[fragment.transfer] = bytes(whole)
            queues.remove(queue)
    assert done == frames


def test_only_the_first_fragment_has_the_total() -> None:
    """§6: exactly the first fragment has the total, and all but the last have `more`."""
    found = pieces(1, bytes(2 * limits.FRAGMENT_BYTES + 1))
    assert [(piece.total, piece.more) for piece in found] == [
        (2 * limits.FRAGMENT_BYTES + 1, True),
        (None, True),
        (None, False),
    ]


@pytest.mark.parametrize(
    "second",
    [
        Fragment(1, 10, True, b"x"),
        Fragment(2, None, True, b"x"),
        Fragment(1, None, True, b""),
        Fragment(1, None, False, b"x"),
        Fragment(1, None, True, b"123456789"),
        Fragment(1, None, False, b"1234567890"),
    ],
    ids=["total twice", "unknown transfer", "empty", "too early an end", "no end", "too much"],
)
def test_inconsistent_fragments(second: Fragment) -> None:
    """§6: fragments that do not add up to the total are MALFORMED."""
    reassembler = Reassembler()
    assert reassembler.add(Fragment(1, 10, True, b"x")) is None
    assert refused(reassembler, second) is ErrorCode.MALFORMED


def test_the_limit_exactly_and_one_byte_more() -> None:
    """Hostile case 31: a total at the limit is taken, one byte more is TOO_LARGE."""
    assert Reassembler(100).add(Fragment(1, 100, False, bytes(100))) == bytearray(100)
    assert refused(Reassembler(100), Fragment(1, 101, True, b"x")) is ErrorCode.TOO_LARGE


def test_open_transfers_are_limited() -> None:
    """§6: one more than MAX_TRANSFERS at a time is LIMIT; after an ABORT another may start."""
    reassembler = Reassembler()
    for index in range(limits.MAX_TRANSFERS):
        reassembler.add(Fragment(index, 10, True, b"x"))
    more = Fragment(99, 10, True, b"x")
    assert refused(reassembler, more) is ErrorCode.LIMIT
    reassembler.abort(Abort(0))
    reassembler.abort(Abort(12345))
    assert reassembler.add(more) is None


def test_an_aborted_transfer_is_forgotten() -> None:
    """§6: a piece after the ABORT belongs to nothing."""
    reassembler = Reassembler()
    reassembler.add(Fragment(1, 10, True, b"x"))
    reassembler.abort(Abort(1))
    assert refused(reassembler, Fragment(1, None, True, b"x")) is ErrorCode.MALFORMED


def test_an_announced_total_costs_no_memory() -> None:
    """Eight transfers announced at the limit, one byte each, hold a few bytes and not 512 MiB."""

    def announce() -> None:
        reassembler = Reassembler()
        for index in range(limits.MAX_TRANSFERS):
            reassembler.add(Fragment(index, limits.MAX_MESSAGE_BYTES, True, b"x"))

    assert peak_bytes(announce) < 64 * 1024


def test_large_is_more_than_a_frame_may_hold() -> None:
    """§3: a frame of exactly the limit travels whole."""
    most = limits.PREFIX_BYTES + limits.MAX_FRAME_BYTES
    assert not is_large(bytes(most))
    assert is_large(bytes(most + 1))


@pytest.mark.parametrize("size", [1, 6, 7, 100])
def test_a_large_batch_is_discarded_however_little_its_first_fragment_has(size: int) -> None:
    """Above the broker's limit: a fragment that ends before the opcode counts as one of a BATCH."""
    total = ReassemblyTotal()
    total.refusing = True
    reassembler = Reassembler(total=total)
    raw = bytes([*bytes(6), Op.BATCH, *bytes(200)])
    assert reassembler.add(Fragment(1, len(raw), True, raw[:size])) is None
    assert reassembler.add(Fragment(1, None, False, raw[size:])) is None
    assert (total.refused, total.bytes) == (1, 0)

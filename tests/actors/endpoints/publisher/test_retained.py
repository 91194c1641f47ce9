"""Tests of what a latched publisher keeps: its last messages, bounded in number and in bytes."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from actors.endpoints.publisher.retained import Retained
from proto.queues.batches import message_bytes, split_messages
from tests.broker.frame_makers import batch


def numbers(kept: Retained) -> list[int]:
    """Return the sequence numbers of what is kept, oldest first."""
    return [
        number
        for part in reversed(list(kept.newest_first()))
        for number in range(part.first_sequence, part.first_sequence + part.length)
    ]


@given(st.lists(st.integers(1, 9)), st.integers(1, 20))
def test_the_last_messages_are_kept(lengths: list[int], keep: int) -> None:
    """Whatever the runs, exactly the newest `keep` messages stay, whole, and the sums are right."""
    kept, published = Retained(keep), 0
    for length in lengths:
        kept.add(batch(1, published, length))
        published += length
        expected = list(range(max(0, published - keep), published))
        assert numbers(kept) == expected
        assert kept.first_sequence == expected[0]
        assert kept.messages == len(expected)
        assert kept.size == sum(message_bytes(part) for part in kept.newest_first())
        assert all(len(list(split_messages(part))) == part.length for part in kept.newest_first())


@given(st.lists(st.integers(1, 9), min_size=1), st.integers(0, 60))
def test_what_is_before_a_number_can_be_had_alone(lengths: list[int], before: int) -> None:
    """The run that it falls into is cut; runs beyond are left out."""
    kept, published = Retained(1000), 0
    for length in lengths:
        kept.add(batch(1, published, length))
        published += length
    parts = list(kept.newest_first(before=before))
    found = [part.first_sequence + index for part in reversed(parts) for index in range(part.length)]
    assert found == list(range(min(before, published)))
    assert all(len(list(split_messages(part))) == part.length for part in parts)


def test_bytes_are_bounded_too() -> None:
    """Beyond the ceiling the oldest go, message by message; the last message stays, however large."""
    kept = Retained(1000, max_bytes=5 * message_bytes(batch(1, 0, 1, 100)))
    kept.add(batch(1, 0, 3, 100))
    kept.add(batch(1, 3, 4, 100))
    assert numbers(kept) == [2, 3, 4, 5, 6]
    kept.add(batch(1, 7, 1, 10_000))
    assert numbers(kept) == [7]


def test_larger_ones_are_forgotten() -> None:
    """What a broker would not take is dropped; nothing kept has no first number."""
    kept = Retained(10)
    kept.add(batch(1, 0, 1, 100))
    kept.add(batch(1, 1, 1, 1000))
    kept.drop_larger(500)
    assert numbers(kept) == [0]
    assert kept.messages == 1
    kept.drop_larger(1)
    assert kept.first_sequence is None
    assert (kept.messages, kept.size) == (0, 0)

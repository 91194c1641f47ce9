"""Times of messages that share a batch."""

from __future__ import annotations

import msgpack
import pytest

from proto import limits
from proto.wire.stamps import MAX_STAMPS, STAMPS, stamp_of, stamps_attribute, stamps_from


def test_each_message_has_its_own() -> None:
    """By its number; those before and behind have the batch's."""
    attributes = stamps_attribute(10, [5, 0, 2**63 - 1])
    assert attributes is not None
    stamps = stamps_from(attributes, 8, 7)
    assert [stamp_of(stamps, number, 99) for number in range(8, 15)] == [99, 99, 5, 0, 2**63 - 1, 99, 99]


def test_those_of_other_messages_are_not_kept() -> None:
    """A batch that was cut keeps the attribute; a reader needs a part of it."""
    attributes = stamps_attribute(10, range(100))
    assert attributes is not None
    for first, count, expected in (
        (10, 2, 2),
        (50, 10, 10),
        (105, 10, 5),
        (0, 15, 5),
        (0, 10, 0),
        (200, 5, 0),
    ):
        stamps = stamps_from(attributes, first, count)
        assert len(stamps) == 1 + expected
        for number in range(first, first + count):
            assert stamp_of(stamps, number, 999) == (number - 10 if 10 <= number < 110 else 999)


def test_equal_times_need_no_attribute() -> None:
    """The batch has the time."""
    assert stamps_attribute(3, [7, 7, 7]) is None
    assert stamps_attribute(3, [7]) is None


def test_the_largest_attribute_is_within_the_limit() -> None:
    """Whatever the numbers are."""
    attributes = stamps_attribute(limits.MAX_U64 - MAX_STAMPS, range(MAX_STAMPS))
    assert len(msgpack.packb(attributes)) <= limits.MAX_ATTRIBUTES_BYTES


@pytest.mark.parametrize("value", [b"", b"1234567", 8, "12345678", None])
def test_other_values_are_no_times(value: bytes | int | str | None) -> None:
    """A sender may write anything: the batch's time counts then."""
    assert not stamps_from({STAMPS: value}, 0, 1)
    assert not stamps_from({}, 0, 1)


def test_a_number_without_times_has_none() -> None:
    """Eight bytes are a number alone."""
    stamps = stamps_from({STAMPS: bytes(8)}, 0, 1)
    assert stamp_of(stamps, 0, 99) == 99

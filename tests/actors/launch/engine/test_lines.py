"""Lines, however what they are made of comes."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors.launch.engine.lines import MAX_LINE_BYTES, LineSplitter


@given(st.text("ab\n\r", max_size=200), st.lists(st.integers(0, 200), max_size=5))
def test_every_line_comes_once_however_it_is_cut(text: str, cuts: list[int]) -> None:
    """What was written, without the ends of its lines."""
    data = text.encode()
    lines = LineSplitter()
    places = [0, *sorted(cuts), len(data)]
    got = [line for begin, end in itertools.pairwise(places) for line in lines.feed(data[begin:end])]
    got += lines.end()
    *whole, last = data.split(b"\n")
    assert got == [line.removesuffix(b"\r") for line in whole] + ([last] if last else [])
    assert lines.end() == []


@pytest.mark.parametrize("chunk", [1 << 30, 50_000, 65_537])
def test_a_very_long_line_is_cut_into_pieces(chunk: int) -> None:
    """Between characters; nothing is lost and no more is kept than one piece."""
    text = "x" + "é" * MAX_LINE_BYTES
    data = text.encode() + b"\r\n"
    lines = LineSplitter()
    pieces = [each for at in range(0, len(data), chunk) for each in lines.feed(data[at : at + chunk])]
    assert [len(each) for each in pieces] == [MAX_LINE_BYTES - 1, MAX_LINE_BYTES, 2]
    assert "".join(each.decode() for each in pieces) == text
    assert lines.end() == []


def test_bytes_that_are_no_text_are_cut_all_the_same() -> None:
    """Wherever that is."""
    lines = LineSplitter()
    assert lines.feed(b"\x80" * (MAX_LINE_BYTES + 10)) == [b"\x80" * MAX_LINE_BYTES]
    assert lines.end() == [b"\x80" * 10]


@pytest.mark.parametrize("chunk", [1 << 30, MAX_LINE_BYTES, MAX_LINE_BYTES + 1, 1000])
@pytest.mark.parametrize("end", [b"\n", b"\r\n"])
def test_a_line_of_the_greatest_length_is_one(chunk: int, end: bytes) -> None:
    """Its end does not count, also if that comes later."""
    data = b"x" * MAX_LINE_BYTES + end
    lines = LineSplitter()
    got = [each for at in range(0, len(data), chunk) for each in lines.feed(data[at : at + chunk])]
    assert got == [b"x" * MAX_LINE_BYTES]
    assert lines.end() == []

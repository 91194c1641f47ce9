"""Labels before lines, however these come."""

from __future__ import annotations

import itertools

from hypothesis import given
from hypothesis import strategies as st

from actors.launch.lines import MAX_LINE_BYTES, LabelledLines


@given(st.binary(max_size=200), st.lists(st.integers(0, 200), max_size=5))
def test_every_line_comes_once_however_it_is_cut(data: bytes, cuts: list[int]) -> None:
    """What was written, with a label before each line and an end after the last one."""
    lines = LabelledLines("a-1")
    places = [0, *sorted(cuts), len(data)]
    written = b"".join(lines.feed(data[begin:end]) for begin, end in itertools.pairwise(places))
    written += lines.end()
    expected = data.split(b"\n")
    if not expected[-1]:
        expected.pop()
    assert written == b"".join(b"[a-1] " + line + b"\n" for line in expected)
    assert lines.end() == b""


def test_a_very_long_line_is_cut_into_pieces() -> None:
    """Between characters; nothing is lost and no more is kept than one piece."""
    text = "é" * MAX_LINE_BYTES
    lines = LabelledLines("a")
    first = lines.feed(b"x" + text.encode())
    assert first.count(b"\n") == 2
    pieces = (first + lines.feed(b"\n")).decode().splitlines()
    assert all(piece.startswith("[a] ") for piece in pieces)
    assert "".join(piece.removeprefix("[a] ") for piece in pieces) == "x" + text
    assert all(len(piece.encode()) <= MAX_LINE_BYTES + 4 for piece in pieces)


def test_bytes_that_are_no_text_are_cut_all_the_same() -> None:
    """Wherever that is."""
    lines = LabelledLines("a")
    written = lines.feed(b"\x80" * (MAX_LINE_BYTES + 10)) + lines.end()
    assert written.count(b"\x80") == MAX_LINE_BYTES + 10

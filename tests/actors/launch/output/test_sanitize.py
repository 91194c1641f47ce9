"""What a program's line may do to a terminal."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors.launch.output.sanitize import plain_line, sanitize_line

LINES = [
    (b"plain \ttext", b"plain \ttext"),
    (b"\x1b[2Jgone", b"gone"),
    (b"\x1b[1;31mred\x1b[0m\x1b[K", b"\x1b[1;31mred\x1b[0m"),
    (b"\x1b[38:2:1:2:3mrgb", b"\x1b[38:2:1:2:3mrgb"),
    (b"\x1b[?25l\x1b[>4;2mhidden", b"hidden"),
    (b"\x1b]0;title\x07text", b"text"),
    (b"\x1b]8;;http://a\x1b\\link\x1b]8;;\x1b\\", b"link"),
    (b"\x1bP1$r\x1b\\text\x1bc\x1b(B", b"text"),
    (b"\xc2\x9b2Jtext\xc2\x85", b"text"),
    (b"a\x08b\x07c\x00", b"abc"),
    (b"\x1b", b""),
    (b"text\x1b[", b"text"),
    (b"\x1b\x07[2J", b"[2J"),
    (b"10 %\r20 %\r100 %\r\r", b"100 %"),
    ("20 °C, naïve".encode(), "20 °C, naïve".encode()),
    (b"\xff\xc2", b"\xff\xc2"),
]


@pytest.mark.parametrize(("line", "expected"), LINES)
def test_colors_stay_and_nothing_else(line: bytes, expected: bytes) -> None:
    """Text is as it was; of what is written over, the last state is left."""
    assert sanitize_line(line) == expected


def test_a_plain_line_has_no_colors_either() -> None:
    """As for files."""
    assert plain_line(b"\x1b[1;31mred\x1b[0m\x1b[K \x1b]0;title\x07text") == b"red text"


@given(st.text(alphabet="\x1b[]2;JmP\\\x07\r\x9b\x85é c", max_size=20))
def test_nothing_is_left_that_steers(text: str) -> None:
    """However sequences are mixed and cut: after one pass another finds nothing to take out."""
    shown, plain = sanitize_line(text.encode()), plain_line(text.encode())
    assert sanitize_line(shown) == shown
    assert not any(each in plain.decode() for each in "\x1b\x07\r\x9b\x85")

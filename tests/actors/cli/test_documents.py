"""Streams of text, cut into documents."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors.cli import documents
from actors.cli.documents import Documents

if TYPE_CHECKING:
    from collections.abc import Iterable


def cut(pieces: Iterable[str]) -> list[str]:
    """Return all documents of a stream."""
    reader = Documents()
    found = [document for piece in pieces for document in reader.feed(piece)]
    return found + reader.end()


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("", []),
        ("data: a", ["data: a"]),
        ("data: a\n---\ndata: b\n---\n", ["data: a\n", "data: b\n"]),
        ("---\ndata: a\n...\n---\n\n---\n", ["data: a\n"]),
        ("data: a\r\n--- \r\ndata: b", ["data: a\r\n", "data: b"]),
        (
            '{"data": "a"}\n{"data": "b"}\n{"data": "c"}',
            ['{"data": "a"}\n', '{"data": "b"}\n', '{"data": "c"}'],
        ),
        ('{"data":\n"a"}\n', ['{"data":\n"a"}\n']),
        ("{data: a}\n---\n{data: b}\n", ["{data: a}\n", "{data: b}\n"]),
        ('data: a\n{"data": "b"}\n', ['data: a\n{"data": "b"}\n']),
        ("data: |\n  ---\n  x\u2028y\n", ["data: |\n  ---\n  x\u2028y\n"]),
    ],
)
def test_a_stream_is_cut(text: str, found: list[str]) -> None:
    """At `---`, and after each line that is a JSON object of its own."""
    assert cut([text]) == found


@given(
    st.lists(st.sampled_from(["---\n", "a: 1\n", '{"a": 1}\n', "\n", "b", "\r\n", " {", "}\n"])), st.data()
)
def test_pieces_make_no_difference(parts: list[str], data: st.DataObject) -> None:
    """However the text comes, the documents are the same."""
    text = "".join(parts)
    places = sorted(data.draw(st.lists(st.integers(0, len(text)), max_size=5)))
    pieces = [text[start:stop] for start, stop in zip([0, *places], [*places, len(text)], strict=True)]
    assert cut(pieces) == cut([text])


@pytest.mark.parametrize("text", ["x" * 101, "x: y\n" * 21])
def test_a_document_has_an_end(monkeypatch: pytest.MonkeyPatch, text: str) -> None:
    """In one line or in many; what is done with does not count."""
    monkeypatch.setattr(documents, "MAX_DOCUMENT_CHARS", 100)
    reader = Documents()
    for _ in range(50):
        reader.feed("data: a\n---\n")
        reader.feed('{"data": "b"}\n')
    with pytest.raises(ValueError, match="longer than 100 characters"):
        reader.feed(text)

"""Lines without terminal controls, and valid JSON."""

from __future__ import annotations

import json

import pytest

from actors.cli.output import print_json, print_out
from proto.untrusted_text import sanitize


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("plain", "plain"),
        ("two\nlines\tand a tab", "two\nlines\tand a tab"),
        ("日本語 é", "日本語 é"),
        ("\x1b[2Jgone", "\\x1b[2Jgone"),
        ("\u202eevil", "\\u202eevil"),
        ("\x07\x9b", "\\x07\\x9b"),
    ],
)
def test_text_is_sanitized(text: str, shown: str) -> None:
    """Unprintable characters are escaped; line ends, tabs and other scripts stay."""
    assert sanitize(text) == shown


def test_print_out_sanitizes(capsys: pytest.CaptureFixture[str]) -> None:
    """`print_out` sanitizes its lines."""
    print_out("\x1b]0;title\x07")
    assert capsys.readouterr().out == "\\x1b]0;title\\x07\n"


def test_json_has_no_nan(capsys: pytest.CaptureFixture[str]) -> None:
    """NaN and infinity become texts, at every depth, which verbs read as numbers again."""
    print_json({"a": [1.5, float("nan")], "b": {"c": float("-inf")}})
    assert json.loads(capsys.readouterr().out) == {"a": [1.5, "nan"], "b": {"c": "-inf"}}


def test_json_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    """So that a stream of documents is NDJSON."""
    print_json({"text": "two\nlines \x9b"})
    assert capsys.readouterr().out == '{"text": "two\\nlines \\u009b"}\n'

"""Tables are aligned, harmless, and coloured where that is wanted."""

from __future__ import annotations

import io
import sys

import pytest

from actors.cli.tables import Style, Styled, colored, painted, print_table, table_lines, width


class _Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.fixture(autouse=True)
def _no_wish(monkeypatch: pytest.MonkeyPatch) -> None:
    """The environment says nothing about colours."""
    for variable in ("NO_COLOR", "FORCE_COLOR", "TERM"):
        monkeypatch.delenv(variable, raising=False)


def test_columns_are_aligned() -> None:
    """Texts to the left, counts to the right, and no spaces at the end of a line."""
    lines = table_lines(
        [("/chatter", 2, "a"), ("/r", 10, "bcd")], header=("TOPIC", "N", "TYPE"), style=("name", "count")
    )
    assert lines == ["TOPIC      N  TYPE", "/chatter   2  a", "/r        10  bcd"]


def test_rows_may_be_shorter_than_others() -> None:
    """What is missing stays empty; empty cells leave no spaces at the end."""
    assert table_lines([("a",), ("bb", "c", "d"), ("e", "", "")]) == ["a", "bb  c  d", "e"]


def test_wide_and_combining_characters_count_as_they_look() -> None:
    """Alignment holds for other scripts, too."""
    assert (width("日本"), width("e\u0301"), width("abc")) == (4, 1, 3)
    assert table_lines([("日本", "x"), ("ab", "x")]) == ["日本  x", "ab    x"]


def test_cells_cannot_break_out() -> None:
    """Escape sequences, line ends and tabs are shown as text, and alignment counts what is shown."""
    assert table_lines([("\x1b[2J", "x"), ("\n\t", "y")]) == ["\\x1b[2J  x", "\\n\\t     y"]


def test_colour_is_by_column_and_by_cell() -> None:
    """A header is bold; a cell may say its own; colours do not count for the width."""
    lines = table_lines(
        [("/a", Styled("3", "warn")), ("/bb", "4")], header=("N", "M"), style=("name",), color=True
    )
    assert lines == [
        "\x1b[1mN\x1b[0m    \x1b[1mM\x1b[0m",
        "\x1b[36m/a\x1b[0m   \x1b[33m3\x1b[0m",
        "\x1b[36m/bb\x1b[0m  4",
    ]


def test_painted_text_is_sanitized() -> None:
    """The only escape sequences are ours."""
    assert painted("\x1b[0m", "bad", color=True) == "\x1b[31m\\x1b[0m\x1b[0m"
    assert painted("x", "bad", color=False) == "x"


@pytest.mark.parametrize(
    ("variable", "terminal", "wanted"),
    [
        (None, True, True),
        (None, False, False),
        ("NO_COLOR", True, False),
        ("FORCE_COLOR", False, True),
    ],
)
def test_the_environment_goes_before_the_terminal(
    monkeypatch: pytest.MonkeyPatch, variable: str | None, terminal: bool, wanted: bool
) -> None:
    """NO_COLOR and FORCE_COLOR are honoured; otherwise only a terminal gets colours."""
    if variable is not None:
        monkeypatch.setenv(variable, "1")
    assert colored(_Terminal() if terminal else io.StringIO()) is wanted


def test_the_widest_texts_give_way_to_a_narrow_terminal() -> None:
    """Counts stay whole; what is cut shows it, and takes no more columns than there are."""
    rows = [
        ("/a/quite/long/topic", 12345678901, "example_interfaces/srv/AddTwoInts"),
        ("/日本語日本語日本語", 2, "x"),
    ]
    style: list[Style] = ["name", "count"]
    assert table_lines(rows, style=style, max_width=80) == table_lines(rows, style=style)
    for max_width in range(31, 70):
        lines = table_lines(rows, style=style, max_width=max_width)
        assert max(map(width, lines)) <= max_width
        assert "12345678901" in lines[0]
    assert table_lines(rows, style=style, max_width=40) == [
        "/a/quite/lon…  12345678901  example_int…",
        "/日本語日本…             2  x",
    ]
    assert table_lines([("a" * 20, "b" * 20)], max_width=3) == ["aaaaaaa…  bbbbbbb…"]


def test_print_table_fits_a_terminal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """And cuts nothing short in a pipe."""
    monkeypatch.setenv("COLUMNS", "20")
    print_table([("x" * 50,)])
    terminal = _Terminal()
    monkeypatch.setattr(sys, "stdout", terminal)
    print_table([("x" * 50,)])
    assert terminal.getvalue() == f"{'x' * 19}…\n"
    assert capsys.readouterr().out == f"{'x' * 50}\n"


def test_print_table_prints_plain_text_into_a_pipe(capsys: pytest.CaptureFixture[str]) -> None:
    """And nothing at all without rows."""
    print_table([], header=("A", "B"))
    print_table([("x", 1)], header=("A", "B"), style=("name", "count"))
    assert capsys.readouterr().out == "A  B\nx  1\n"

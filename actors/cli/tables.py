"""Aligned tables, and colours: on a terminal, unless NO_COLOR or FORCE_COLOR decides otherwise.

    print_table([("/chatter", 2), ("/rosout", 10)], header=("TOPIC", "PUBLISHERS"), style=("name", "count"))

    TOPIC     PUBLISHERS
    /chatter           2
    /rosout           10

On a terminal that is too narrow the widest texts are cut and end with an ellipsis; pipes and files get the
full texts. Cells are separated by two spaces, for `awk`; control characters in cells are escaped.
"""

from __future__ import annotations

import sys
import unicodedata
from typing import TYPE_CHECKING, Final, Literal, NamedTuple

from actors.cli.terminal import terminal_width
from actors.config.environment import color_wish
from proto.untrusted_text import sanitize

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from typing import TextIO

Style = Literal["", "heading", "name", "type", "count", "dim", "good", "warn", "bad"]
"""The role of a string, which selects its colour. A column of "count" is aligned to the right."""

GAP: Final = "  "
ELLIPSIS: Final = "…"
NARROWEST: Final = 8
"""The columns to which a string is cut at most."""
_CODES: Final[dict[Style, str]] = {
    "heading": "1",
    "name": "36",
    "type": "32",
    "dim": "2",
    "good": "32",
    "warn": "33",
    "bad": "31",
}


class Styled(NamedTuple):
    """A text with a style, which may differ from its column's."""

    text: str
    style: Style


Cell = str | int | float | Styled


def print_styled(*parts: str | Styled) -> None:
    """Print one line of several parts."""
    color = colored(sys.stdout)
    shown = [Styled(part, "") if isinstance(part, str) else part for part in parts]
    print("".join(painted(part.text, part.style, color=color) for part in shown))


def colored(stream: TextIO) -> bool:
    """Return whether output to a stream has colours."""
    wish = color_wish()
    return stream.isatty() if wish is None else wish


def painted(text: str, style: Style, *, color: bool) -> str:
    """Return a string in one line without control characters, in the colour of its style if `color`."""
    plain = _one_line(text)
    code = _CODES.get(style)
    return f"\x1b[{code}m{plain}\x1b[0m" if color and code and plain else plain


def width(text: str) -> int:
    """Return the terminal columns of a string without control characters."""
    if text.isascii():
        return len(text)
    return sum(map(_columns, text))


def table_lines(
    rows: Iterable[Sequence[Cell]],
    *,
    header: Sequence[str] | None = None,
    style: Sequence[Style] = (),
    color: bool = False,
    max_width: int | None = None,
) -> list[str]:
    """Return the lines of a table.

    Args:
        rows: Rows, of any length each. Round floats first.
        header: The titles of the columns.
        style: The styles of the columns; further columns are plain.
        color: Whether to use colours.
        max_width: The columns of the terminal; None for no limit. The widest columns that are not counts are
            cut to fit, each to 8 at least.
    """
    body = [[_styled(cell, _at(style, at)) for at, cell in enumerate(row)] for row in rows]
    if header is not None:
        body.insert(0, [Styled(_one_line(title), "heading") for title in header])
    widths = [max(width(row[at].text) for row in body if at < len(row)) for at in range(_longest(body))]
    right = [_at(style, at) == "count" for at in range(len(widths))]
    if max_width is not None:
        widths = _squeezed(widths, right, max_width)
        body = [[_cut(cell, most) for cell, most in zip(row, widths, strict=False)] for row in body]
    return [_line(row, widths, right, color=color) for row in body]


def print_table(
    rows: Iterable[Sequence[Cell]],
    *,
    header: Sequence[str] | None = None,
    style: Sequence[Style] = (),
) -> None:
    """Print a table; see `table_lines`. Without rows nothing is printed, not even the header."""
    every = list(rows)
    if every:
        color, max_width = colored(sys.stdout), terminal_width()
        print("\n".join(table_lines(every, header=header, style=style, color=color, max_width=max_width)))


def _squeezed(widths: list[int], fixed: list[bool], max_width: int) -> list[int]:
    """Return widths that fit, if possible: the widest ones are reduced first."""
    squeezed = list(widths)
    excess = sum(widths) + len(GAP) * (len(widths) - 1) - max_width
    while excess > 0:
        loose = [(width, at) for at, width in enumerate(squeezed) if not fixed[at] and width > NARROWEST]
        if not loose:
            break
        loose.sort(reverse=True)
        widest, at = loose[0]
        next_one = max(loose[1][0] if len(loose) > 1 else 0, NARROWEST)
        less = min(excess, max(1, widest - next_one))
        squeezed[at] -= less
        excess -= less
    return squeezed


def _cut(cell: Styled, most: int) -> Styled:
    """Return a cell, cut to at most so many columns."""
    if width(cell.text) <= most:
        return cell
    kept, taken = "", 0
    for char in cell.text:
        taken += width(char)
        if taken > most - len(ELLIPSIS):
            break
        kept += char
    return cell._replace(text=kept + ELLIPSIS)


def _styled(cell: Cell, style: Style) -> Styled:
    if isinstance(cell, Styled):
        return Styled(_one_line(cell.text), cell.style)
    return Styled(_one_line(str(cell)), style)


def _one_line(text: str) -> str:
    return sanitize(text).replace("\n", "\\n").replace("\t", "\\t")


def _at(style: Sequence[Style], at: int) -> Style:
    return style[at] if at < len(style) else ""


def _longest(body: list[list[Styled]]) -> int:
    return max(map(len, body), default=0)


def _line(row: list[Styled], widths: list[int], right: list[bool], *, color: bool) -> str:
    parts: list[str] = []
    for at, cell in enumerate(row):
        padding = " " * (widths[at] - width(cell.text))
        text = painted(cell.text, cell.style, color=color)
        last = at == len(row) - 1
        parts.append(padding + text if right[at] else text if last else text + padding)
    return GAP.join(parts).rstrip()


def _columns(char: str) -> int:
    if unicodedata.combining(char) or unicodedata.category(char) in {"Mn", "Me", "Cf"}:
        return 0
    return 2 if unicodedata.east_asian_width(char) in {"W", "F"} else 1

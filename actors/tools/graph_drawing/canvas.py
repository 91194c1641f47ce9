"""A grid of characters: texts, boxes, and lines that join where they meet.

Where lines of two hubs cross, the vertical one is drawn. Lines of one hub join.
"""

from __future__ import annotations

from enum import Enum
from typing import Final, NamedTuple

_UP, _RIGHT, _DOWN, _LEFT = 1, 2, 4, 8
_LINES: Final = " │─╰││╭├─╯─┴╮┤┬┼"
"""The line character for each set of directions."""
_DASHED: Final = str.maketrans("─│", "╌╎")
_ASCII: Final = str.maketrans("─│╌╎╭╮╰╯├┤┬┴┼▶◀✗", "-|.:+++++++++><x")
_PALETTE: Final = (36, 33, 35, 32, 34, 31, 96, 93, 95, 92, 94, 91)


class Paint(Enum):
    """The appearance of a string that belongs to no hub: its SGR parameter."""

    PLAIN = 0
    NODE = 1
    BAD = 31


class _Cell(NamedTuple):
    char: str
    code: int
    """The SGR parameter of its colour; 0 for plain."""


class Canvas:
    """Rows of characters, which grow to the right and down as needed.

    A hub's index selects its colour, so that crossing lines can be told apart.

    Attributes:
        line_cells: By row and column, the directions of each hub's lines there, as bits.
    """

    def __init__(self) -> None:
        self._texts: dict[tuple[int, int], _Cell] = {}
        self.line_cells: dict[tuple[int, int], dict[int, int]] = {}
        self._dashed: set[int] = set()

    def dash(self, hub: int) -> None:
        """Draw a hub's lines dashed.

        Args:
            hub: Its index.
        """
        self._dashed.add(hub)

    def write(self, row: int, column: int, text: str, paint: Paint = Paint.PLAIN) -> None:
        """Write a string.

        Args:
            row: Its row.
            column: Its first column.
            text: Characters that take one column each.
            paint: Its appearance.
        """
        self._put(row, column, text, paint.value)

    def write_of(self, hub: int, row: int, column: int, text: str) -> None:
        """Write a string in a hub's colour.

        Args:
            hub: The hub's index.
            row: The text's row.
            column: Its first column.
            text: Characters that take one column each.
        """
        self._put(row, column, text, _PALETTE[hub % len(_PALETTE)])

    def box(self, top: int, left: int, width: int, height: int) -> None:
        """Draw the frame of a box.

        Args:
            top: Its first row.
            left: Its first column.
            width: Its columns, the frame included.
            height: Its rows, the frame included.
        """
        self.write(top, left, f"╭{'─' * (width - 2)}╮")
        for row in range(top + 1, top + height - 1):
            self.write(row, left, "│")
            self.write(row, left + width - 1, "│")
        self.write(top + height - 1, left, f"╰{'─' * (width - 2)}╯")

    def across(self, hub: int, row: int, begin: int, end: int) -> None:
        """Draw a horizontal line of a hub.

        Args:
            hub: The hub's index.
            row: The line's row.
            begin: Its first column.
            end: Its last column.
        """
        for column in range(begin, end + 1):
            self._go(hub, row, column, (column > begin) * _LEFT | (column < end) * _RIGHT)

    def down(self, hub: int, column: int, top: int, bottom: int) -> None:
        """Draw a vertical line of a hub.

        Args:
            hub: The hub's index.
            column: The line's column.
            top: Its first row.
            bottom: Its last row.
        """
        for row in range(top, bottom + 1):
            self._go(hub, row, column, (row > top) * _UP | (row < bottom) * _DOWN)

    def lines(self, *, color: bool = False, ascii_only: bool = False) -> list[str]:
        """Return the rows, without trailing spaces.

        Args:
            color: Use colours, by escape sequences.
            ascii_only: Use no box characters.
        """
        rows = 1 + max((row for row, _ in [*self._texts, *self.line_cells]), default=-1)
        cells: list[dict[int, _Cell]] = [{} for _ in range(rows)]
        for (row, column), hubs in self.line_cells.items():
            cells[row][column] = self._line_cell(hubs)
        for (row, column), cell in self._texts.items():
            cells[row][column] = cell
        return [_row(row, color=color, ascii_only=ascii_only) for row in cells]

    def _put(self, row: int, column: int, text: str, code: int) -> None:
        for at, char in enumerate(text):
            self._texts[row, column + at] = _Cell(char, code)

    def _go(self, hub: int, row: int, column: int, bits: int) -> None:
        hubs = self.line_cells.setdefault((row, column), {})
        hubs[hub] = hubs.get(hub, 0) | bits

    def _line_cell(self, hubs: dict[int, int]) -> _Cell:
        hub = max(hubs, key=lambda each: hubs[each] & (_UP | _DOWN))
        char = _LINES[hubs[hub]]
        if hub in self._dashed:
            char = char.translate(_DASHED)
        return _Cell(char, _PALETTE[hub % len(_PALETTE)])


def _row(cells: dict[int, _Cell], *, color: bool, ascii_only: bool) -> str:
    parts: list[str] = []
    code = 0
    blank = _Cell(" ", 0)
    for column in range(1 + max(cells, default=-1)):
        cell = cells.get(column, blank)
        if color and cell.code != code and cell.char != " ":
            parts.append(
                f"\x1b[{cell.code}m" if not code else f"\x1b[0;{cell.code}m" if cell.code else "\x1b[0m"
            )
            code = cell.code
        parts.append(cell.char.translate(_ASCII) if ascii_only else cell.char)
    if not code:
        return "".join(parts).rstrip()
    return "".join(parts).rstrip() + "\x1b[0m"

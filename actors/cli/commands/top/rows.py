"""A table whose rows change with every sample, sorted and filtered by the user."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Final, Generic

from rich.text import Text
from textual import on
from textual.binding import Binding
from textual.coordinate import Coordinate
from textual.widgets import DataTable

from actors.cli.commands.top.columns import Column, RowT, chosen
from proto.untrusted_text import sanitize

if TYPE_CHECKING:
    from collections.abc import Sequence

    from textual.binding import BindingType

    from actors.cli.tables import Style, Styled

SHOWN_ROWS: Final = 200
"""Rows shown at most; the filter finds the others."""
_STYLES: Final[dict[Style, str]] = {
    "name": "cyan",
    "type": "green",
    "dim": "dim",
    "good": "green",
    "warn": "yellow",
    "bad": "bold red",
}
_ARROWS: Final = {True: "▼", False: "▲", None: " "}


def styled_text(part: Styled) -> Text:
    """Return a styled text; markup in it is not interpreted."""
    return Text(sanitize(part.text), style=_STYLES.get(part.style, ""), no_wrap=True)


class RowsTable(DataTable[Text], Generic[RowT]):
    """A table of rows.

    The cursor stays at the top until the user moves it; then it follows its row.

    Args:
        columns: The columns; the first is the row's name.
        sorted_by: The column by which it is sorted at first.
        id: The id of the widget.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("s", "sort_by(1)", "Sort"),
        Binding("S", "sort_by(-1)", "Sort by the column before", show=False),
        Binding("r", "reverse", "Reverse"),
    ]
    DEFAULT_CSS: ClassVar[str] = """
    RowsTable {
        height: 1fr; background: $surface; overflow-x: auto;
        scrollbar-size: 0 1; scrollbar-color: $panel; scrollbar-background: $background;
    }
    RowsTable:focus { background-tint: $foreground 0%; }
    RowsTable > .datatable--header { background: $panel; }
    RowsTable > .datatable--fixed { background: $surface; }
    """

    def __init__(self, columns: Sequence[Column[RowT]], *, sorted_by: int, id: str) -> None:  # noqa: A002 - textual's
        super().__init__(id=id, cursor_type="row", fixed_columns=1)
        self._columns = [column for column in columns if not column.optional]
        self._optional = [column for column in columns if column.optional]
        self._rows: Sequence[RowT] = ()
        self._words = ""
        self._names: list[str] = []
        self._moved = False
        self.sorted_by = sorted_by
        self.falling = columns[sorted_by].falls

    def on_mount(self) -> None:
        """Make the columns."""
        for at in range(len(self._columns)):
            self.add_column(self._label(at), key=str(at))

    @property
    def selected(self) -> str | None:
        """The name of the row that the cursor is on."""
        return self._names[self.cursor_row] if self.cursor_row < len(self._names) else None

    def show(self, rows: Sequence[RowT], words: str) -> None:
        """Show the rows that contain the words."""
        self._rows, self._words = rows, words
        for column in [each for each in self._optional if any(map(each.value, rows))]:
            self._optional.remove(column)
            self._columns.append(column)
            at = len(self._columns) - 1
            self.add_column(self._label(at), key=str(at), default=Text(""))
        self._update_rows()

    def action_sort_by(self, steps: int) -> None:
        """Sort by a column to the right or left."""
        self._sort((self.sorted_by + steps) % len(self._columns))

    def action_reverse(self) -> None:
        """Reverse the sort order."""
        self.falling = not self.falling
        self._update_rows()

    @on(DataTable.HeaderSelected)
    def _clicked(self, event: DataTable.HeaderSelected) -> None:
        event.stop()
        if event.column_index == self.sorted_by:
            self.action_reverse()
        else:
            self._sort(event.column_index)

    def _sort(self, at: int) -> None:
        self.sorted_by, self.falling = at, self._columns[at].falls
        self._update_rows()

    def _label(self, at: int) -> Text:
        column = self._columns[at]
        arrow = _ARROWS[self.falling if at == self.sorted_by else None]
        return Text(column.title + arrow, justify="right" if column.style == "count" else "left")

    def _update_rows(self) -> None:
        """Update the screen, with as few changes as possible."""
        found = chosen(self._rows, self._columns[self.sorted_by], self._words, falling=self.falling)
        del found[SHOWN_ROWS:]
        self._moved = self._moved or self.cursor_row != 0
        selected = self.selected
        order = {self._title_of(row): at for at, row in enumerate(found)}
        for name in self._names:
            if name not in order:
                self.remove_row(name)
        for row in found:
            self._put(row)
        self._names = list(order)
        for at, column in enumerate(self.ordered_columns):
            column.label = self._label(at)
        self.sort("0", key=lambda text: order[text.plain])
        stays = min(self.cursor_row, max(0, len(found) - 1))
        self.move_cursor(row=order.get(selected or "", stays) if self._moved else 0, scroll=False)

    def _title_of(self, row: RowT) -> str:
        return self._columns[0].text(row)

    def _put(self, row: RowT) -> None:
        cells, name = [self._cell(column, row) for column in self._columns], self._title_of(row)
        if name not in self.rows:
            self.add_row(*cells, key=name)
            return
        at = self.get_row_index(name)
        for column, cell in enumerate(cells):
            where = Coordinate(at, column)
            now = self.get_cell_at(where)
            if now != cell or now.style != cell.style:
                wider = cell.cell_len > self.ordered_columns[column].content_width
                self.update_cell_at(where, cell, update_width=wider)  # measures the whole column

    def _cell(self, column: Column[RowT], row: RowT) -> Text:
        text = styled_text(column.cell(row))
        text.justify = "right" if column.style == "count" else "left"
        return text

"""The help screen: keys and columns."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Final

from rich.text import Text
from textual.binding import Binding
from textual.screen import ModalScreen
from textual.widgets import Static

if TYPE_CHECKING:
    from textual.app import ComposeResult
    from textual.binding import BindingType

KEYS: Final = {
    "1  2  3": "topics, nodes, services",
    "↑ ↓  PgUp PgDn": "choose a row",
    "← →": "see the columns that do not fit",
    "s  S": "sort by another column; or click on its title",
    "r": "sort the other way round",
    "/": "filter by name, type or state; Esc ends it",
    "Enter": "see a topic's messages and delays; Esc ends it",
    "Space": "pause; again: go on",
    "h": "also show names with a leading _, or not",
    "q  Ctrl-C": "quit",
}
TERMS: Final = {
    "DROPS/S": "copies dropped: a reader is too slow for its depth",
    "QUEUED": "copies that wait in the broker",
    "LOST": "copies dropped or lost with a link, up to now",
    "CALLS": "calls of a node that wait for an answer",
    "OWED": "calls that a node (a service: its nodes) has not answered",
}


class HelpScreen(ModalScreen[None]):
    """The help screen, which any of its keys closes."""

    DEFAULT_CSS: ClassVar[str] = """
    HelpScreen { align: center middle; }
    HelpScreen > Static {
        width: auto; max-width: 100%; height: auto; max-height: 100%;
        padding: 0 1; border: round $accent; background: $surface;
    }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,q,question_mark,enter,space", "dismiss", "Close", show=False)
    ]

    def compose(self) -> ComposeResult:
        """Make the widgets."""
        lines: list[Text] = []
        for title, words in (("Keys", KEYS), ("Columns", TERMS)):
            lines += [Text(title, "bold")]
            lines += [Text.assemble((f"  {word:<16}", "cyan"), what) for word, what in words.items()]
            lines += [Text()]
        yield Static(Text("\n").join(lines[:-1]))

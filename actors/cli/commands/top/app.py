"""The live view: tables of topics, nodes and services, and totals of the broker."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any, ClassVar, Final

from rich.text import Text
from textual import on
from textual.app import App
from textual.binding import Binding
from textual.content import Content
from textual.widgets import DataTable, Footer, Input, Static, TabbedContent, TabPane

from actors.cli.commands.top.columns import BUSIEST, NODES, SERVICES, TOPICS, headlines
from actors.cli.commands.top.echo import EchoPane
from actors.cli.commands.top.help import HelpScreen
from actors.cli.commands.top.rows import RowsTable, styled_text
from actors.errors import BrokerUnreachable
from actors.graph.snapshot import GraphSnapshot
from actors.tools.overview import Samples
from proto.untrusted_text import sanitize

if TYPE_CHECKING:
    from collections.abc import Sequence

    from textual.app import ComposeResult
    from textual.binding import BindingType

    from actors.cli.commands.top.source import TopDataSource
    from actors.tools.overview import Overview

ECHO_INTERVAL_S: Final = 0.25
RETRY_S: Final = 0.5
"""The time between two attempts while there is no broker; the node reconnects by itself."""


class TopApp(App[None]):
    """Samples at a broker again and again.

    Args:
        source: Returns samples and messages.
        interval_s: The time between two samples.
        echo_interval_s: The time between two updates of the echo pane.
        words: The initial text of the filter.
        hidden: Whether hidden names are shown at first.
    """

    TITLE = "callboard top"
    ENABLE_COMMAND_PALETTE = False
    CSS: ClassVar[str] = """
    #target { height: 1; padding: 0 1; background: $panel; }
    #totals { height: auto; padding: 0 1; }
    #lost { display: none; height: auto; padding: 0 1; background: $error; color: $text; }
    #lost.open { display: block; }
    TabbedContent { height: 1fr; }
    TabPane { padding: 0; }
    #filter { display: none; height: 1; border: none; padding: 0 1; background: $boost; }
    #filter.open { display: block; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("1", "pane('topics')", "Topics", show=False),
        Binding("2", "pane('nodes')", "Nodes", show=False),
        Binding("3", "pane('services')", "Services", show=False),
        Binding("slash", "filter", "Filter", key_display="/"),
        Binding("space", "pause", "Pause"),
        Binding("h", "hidden", "Hidden"),
        Binding("escape", "undo", "Back", show=False),
        Binding("question_mark", "help", "Help", key_display="?"),
        Binding("q", "quit", "Quit"),
        Binding("ctrl+c", "quit", "Quit", show=False, priority=True),
    ]

    def __init__(
        self,
        source: TopDataSource,
        *,
        interval_s: float = 1.0,
        echo_interval_s: float = ECHO_INTERVAL_S,
        words: str = "",
        hidden: bool = False,
    ) -> None:
        super().__init__()
        self._source = source
        self._interval_s = interval_s
        self._echo_interval_s = echo_interval_s
        self._words = words
        self._hidden = hidden
        self._paused = False
        self._tables: dict[str, RowsTable[Any]] = {
            "topics": RowsTable(TOPICS, sorted_by=BUSIEST, id="topics-table"),
            "nodes": RowsTable(NODES, sorted_by=0, id="nodes-table"),
            "services": RowsTable(SERVICES, sorted_by=0, id="services-table"),
        }
        # Not queried: a sample may end while the screen is being removed.
        self._lost = Static(id="lost")
        self._samples = Samples()
        self._snapshot = GraphSnapshot()
        self._seen: Overview | None = None

    def compose(self) -> ComposeResult:
        """Make the widgets."""
        yield Static(id="target")
        yield Static(id="totals")
        yield self._lost
        with TabbedContent(initial="topics"):
            for pane, table in self._tables.items():
                with TabPane(pane.capitalize(), id=pane):
                    yield table
        yield EchoPane()
        shown = "open" if self._words else ""
        yield Input(self._words, placeholder="part of a name, type or state", id="filter", classes=shown)
        yield Footer()

    def on_mount(self) -> None:
        """Start to take samples."""
        self._show_target()
        self._tables["topics"].focus()
        self.run_worker(self._watch(), name="samples")
        self.set_interval(self._echo_interval_s, self._echo.show_new)

    async def _watch(self) -> None:
        while True:
            there = self._paused or await self.sample_now()
            await asyncio.sleep(self._interval_s if there else min(RETRY_S, self._interval_s))

    async def sample_now(self) -> bool:
        """Sample and show it; return whether there is a broker."""
        try:
            sample = await self._source.sample()
        except BrokerUnreachable:
            text = (
                f"The broker at {self._source.target} does not answer. These values are old; trying again ..."
            )
            self._lost.update(text)
            self._lost.add_class("open")
            return False
        self._lost.remove_class("open")
        self._snapshot = sample.snapshot
        self._seen = self._samples.add(sample)
        self._show()
        return True

    def _show(self) -> None:
        """Show the newest overview."""
        if self._seen is None or not self.query("#totals"):  # a sample may come after the widgets are gone
            return
        self._show_totals(self._seen)
        shown = self._seen if self._hidden else self._seen.without_hidden()
        tabs = self.query_one(TabbedContent)
        rows: dict[str, Sequence[Any]] = {
            "topics": shown.topics,
            "nodes": shown.nodes,
            "services": shown.services,
        }
        for pane, each in rows.items():
            tabs.get_tab(pane).label = Content(f"{pane.capitalize()} {len(each)}")
            self._tables[pane].show(each, self._words)
        if self._echo.topic:
            named = [row for row in self._seen.topics if row.name == self._echo.topic]
            self._echo.set_row(named[0] if named else None)

    def _show_totals(self, seen: Overview) -> None:
        lines = [Text("   ").join(map(styled_text, line)) for line in headlines(seen.totals)]
        self.query_one("#totals", Static).update(Text("\n").join(lines))

    def _show_target(self) -> None:
        line = Text.assemble(("callboard top", "bold"), "  ", sanitize(self._source.target))
        if self._paused:
            line.append("  paused", "bold yellow")
        self.query_one("#target", Static).update(line)

    @property
    def _echo(self) -> EchoPane:
        return self.query_one(EchoPane)

    # Keys and clicks

    def action_pane(self, pane: str) -> None:
        """Show one of the tables."""
        self.query_one(TabbedContent).active = pane
        self._tables[pane].focus()

    def action_filter(self) -> None:
        """Focus the filter."""
        entry = self.query_one(Input)
        entry.add_class("open")
        entry.focus()

    def action_pause(self) -> None:
        """Pause or continue."""
        self._paused = not self._paused
        self._echo.pause(paused=self._paused)
        self._show_target()

    def action_hidden(self) -> None:
        """Show names with a leading underscore, or hide them."""
        self._hidden = not self._hidden
        self._show()

    async def action_undo(self) -> None:
        """Clear the filter if it has the focus; else close the messages, then the filter."""
        entry = self.query_one(Input)
        if self._echo.topic and not entry.has_focus:
            await self._echo.close()
        else:
            entry.value = ""
            entry.remove_class("open")
        self._focus_table()

    def action_help(self) -> None:
        """Show the keys."""
        self.push_screen(HelpScreen())

    @on(Input.Changed)
    def _filter_typed(self, event: Input.Changed) -> None:
        self._words = event.value
        self._show()

    @on(Input.Submitted)
    def _filter_done(self, event: Input.Submitted) -> None:
        event.input.set_class(bool(event.value), "open")
        self._focus_table()

    @on(DataTable.RowSelected, "#topics-table")
    async def _topic_chosen(self, event: DataTable.RowSelected) -> None:
        topic = event.row_key.value
        if topic is not None and topic != self._echo.topic:
            await self._echo.open(topic, await self._source.listen(topic, self._snapshot))
            self._show()

    def _focus_table(self) -> None:
        self._tables[self.query_one(TabbedContent).active].focus()

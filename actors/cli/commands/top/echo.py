"""The pane with a topic's messages and delays."""

from __future__ import annotations

from datetime import datetime
from typing import TYPE_CHECKING, ClassVar, Final

from rich.text import Text
from textual.containers import Vertical
from textual.widgets import RichLog, Static

from actors.cli.commands.top.columns import compact, duration, rate
from proto.untrusted_text import sanitize

if TYPE_CHECKING:
    from textual.app import ComposeResult

    from actors.cli.commands.top.source import Received, ReceivedMessage, TopicReader
    from actors.tools.overview import TopicRow

KEPT_LINES: Final = 2000


class EchoPane(Vertical):
    """Shows a topic's messages while it is open.

    Attributes:
        topic: The topic's name; empty while it is closed.
        not_shown: Messages that were too many to show, or lost, or arrived during a pause.
    """

    DEFAULT_CSS: ClassVar[str] = """
    EchoPane { display: none; height: 1fr; border-top: heavy $accent; }
    EchoPane.open { display: block; }
    EchoPane > #status { height: auto; padding: 0 1; background: $surface; }
    EchoPane > #messages {
        padding: 0 1; background: $background;
        scrollbar-size: 0 1; scrollbar-color: $panel; scrollbar-background: $background;
    }
    """

    def __init__(self) -> None:
        super().__init__(id="echo")
        self.topic = ""
        self.not_shown = 0
        self._reader: TopicReader | None = None
        self._received: Received | None = None
        self._row: TopicRow | None = None
        self._paused = False

    def compose(self) -> ComposeResult:
        """Make the widgets."""
        yield Static(id="status")
        yield RichLog(id="messages", max_lines=KEPT_LINES, wrap=True, auto_scroll=True)

    async def open(self, topic: str, reader: TopicReader) -> None:
        """Show the messages of a topic."""
        await self.close()
        self.topic, self._reader = topic, reader
        self.not_shown = 0
        self.query_one(RichLog).clear()
        self.add_class("open")
        self._show_status()

    async def close(self) -> None:
        """Unsubscribe, and close the pane."""
        reader, self._reader = self._reader, None
        self.topic, self._row, self._received = "", None, None
        self.remove_class("open")
        if reader is not None:
            await reader.close()

    def pause(self, *, paused: bool) -> None:
        """Pause or continue."""
        self._paused = paused
        self._show_status()

    def set_row(self, row: TopicRow | None) -> None:
        """Set the topic's row; None if the topic is gone."""
        self._row = row
        self._show_status()

    async def show_new(self) -> None:
        """Show the messages since the last update."""
        reader = self._reader
        if reader is None or self._paused:
            return
        received = await reader.pop()
        if self._reader is not reader:  # the user has chosen another topic
            return
        self._received = received
        self.not_shown += received.besides
        log = self.query_one(RichLog)
        for message in received.messages:
            log.write(_shown(message))
        self._show_status()

    def _show_status(self) -> None:
        parts = [_delays(self._received)]
        if self._row is None:
            parts.append("the topic is gone")
        else:
            parts.insert(0, f"{rate(self._row.messages_per_sec)} messages/s")
        if self.not_shown:
            parts.append(f"{compact(self.not_shown)} not shown")
        line = Text.assemble((sanitize(self.topic), "bold cyan"), "  ", "  ".join(parts))
        if self._paused:
            line.append("  paused", "bold yellow")
        self.query_one("#status", Static).update(line)


def _delays(received: Received | None) -> str:
    if received is None or received.p50_s is None or received.p99_s is None:
        return "no delays measured yet"
    of = f"last {compact(received.measured)}" if received.measured > 1 else "last one"
    return f"delay p50 {duration(received.p50_s)}, p99 {duration(received.p99_s)} of the {of}"


def _shown(message: ReceivedMessage) -> Text:
    sent = datetime.fromtimestamp(message.sent_ns / 1e9).astimezone()
    stamp = f"{sent:%H:%M:%S}.{message.sent_ns // 1_000_000 % 1000:03}"
    head = f"{stamp}  {sanitize(message.node)}  {duration(message.delay_s)}\n"
    return Text.assemble((head, "dim"), message.text)

"""The pane with a topic's messages, and how long they take."""

from __future__ import annotations

from datetime import datetime
from typing import TYPE_CHECKING, ClassVar, Final

from rich.text import Text
from textual.containers import Vertical
from textual.widgets import RichLog, Static

from actors.cli.commands.top.columns import compact, duration, rate
from actors.cli.output import sanitize

if TYPE_CHECKING:
    from textual.app import ComposeResult

    from actors.cli.commands.top.source import Ear, Heard, HeardMessage
    from actors.tools.overview import TopicRow

KEPT_LINES: Final = 2000


class EchoPane(Vertical):
    """Shows a topic's messages while it is open.

    Attributes:
        topic: Which one; empty while it is closed.
        not_shown: Messages that came too fast to be shown, or while it was paused, or were lost.
    """

    DEFAULT_CSS: ClassVar[str] = """
    EchoPane { display: none; height: 1fr; border-top: heavy $accent; }
    EchoPane.open { display: block; }
    EchoPane > #heard-of { height: auto; padding: 0 1; background: $surface; }
    EchoPane > #heard {
        padding: 0 1; background: $background;
        scrollbar-size: 0 1; scrollbar-color: $panel; scrollbar-background: $background;
    }
    """

    def __init__(self) -> None:
        super().__init__(id="echo")
        self.topic = ""
        self.not_shown = 0
        self._ear: Ear | None = None
        self._heard: Heard | None = None
        self._row: TopicRow | None = None
        self._paused = False

    def compose(self) -> ComposeResult:
        """Make what is in it."""
        yield Static(id="heard-of")
        yield RichLog(id="heard", max_lines=KEPT_LINES, wrap=True, auto_scroll=True)

    async def open(self, topic: str, ear: Ear) -> None:
        """Show the messages of a topic."""
        await self.close()
        self.topic, self._ear = topic, ear
        self.not_shown = 0
        self.query_one(RichLog).clear()
        self.add_class("open")
        self._say_how()

    async def close(self) -> None:
        """Hear no more."""
        ear, self._ear = self._ear, None
        self.topic, self._row, self._heard = "", None, None
        self.remove_class("open")
        if ear is not None:
            await ear.close()

    def pause(self, *, paused: bool) -> None:
        """Let the messages stand, or go on."""
        self._paused = paused
        self._say_how()

    def seen(self, row: TopicRow | None) -> None:
        """Take what the broker says of the topic; None if it is not there."""
        self._row = row
        self._say_how()

    async def take(self) -> None:
        """Show what has come since the last time."""
        ear = self._ear
        if ear is None or self._paused:
            return
        heard = await ear.take()
        if self._ear is not ear:  # another topic has been chosen meanwhile
            return
        self._heard = heard
        self.not_shown += heard.besides
        log = self.query_one(RichLog)
        for message in heard.messages:
            log.write(_shown(message))
        self._say_how()

    def _say_how(self) -> None:
        parts = [_delays(self._heard)]
        if self._row is None:
            parts.append("the topic is gone")
        else:
            parts.insert(0, f"{rate(self._row.messages_per_sec)} messages/s")
        if self.not_shown:
            parts.append(f"{compact(self.not_shown)} not shown")
        line = Text.assemble((sanitize(self.topic), "bold cyan"), "  ", "  ".join(parts))
        if self._paused:
            line.append("  paused", "bold yellow")
        self.query_one("#heard-of", Static).update(line)


def _delays(heard: Heard | None) -> str:
    if heard is None or heard.half_s is None or heard.most_s is None:
        return "no delays measured yet"
    of = f"last {compact(heard.measured)}" if heard.measured > 1 else "last one"
    return f"delay p50 {duration(heard.half_s)}, p99 {duration(heard.most_s)} of the {of}"


def _shown(message: HeardMessage) -> Text:
    sent = datetime.fromtimestamp(message.sent_ns / 1e9).astimezone()
    stamp = f"{sent:%H:%M:%S}.{message.sent_ns // 1_000_000 % 1000:03}"
    head = f"{stamp}  {sanitize(message.node)}  {duration(message.delay_s)}\n"
    return Text.assemble((head, "dim"), message.text)

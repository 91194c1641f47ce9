"""The live view, driven by keys and clicks, with a source that the test makes up."""

from __future__ import annotations

import asyncio
from contextlib import asynccontextmanager, contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final
from unittest import mock

from textual.widgets import Input, RichLog, Static, TabbedContent

from actors.cli.commands.top.app import TopApp
from actors.cli.commands.top.help import HelpScreen
from actors.cli.commands.top.rows import SHOWN_ROWS, RowsTable
from actors.cli.commands.top.source import Received, ReceivedMessage
from actors.errors import BrokerUnreachable
from proto.wire.codes import EntryKind
from proto.wire.stats import MeshBrokerStats
from tests.actors.tools.made_up import entry, link, sample, snapshot, topic
from tests.waiting import until

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator, Iterator

    import pytest
    from textual.pilot import Pilot

    from actors.graph.snapshot import GraphSnapshot
    from actors.tools.overview import Sample

NEVER: Final = 10_000.0
"""The view takes a sample when the test asks for it."""
TURNS_WITHOUT_MESSAGES: Final = 5
"""A message that a widget handles, or has put off to the next turn, leads to others by then."""
GRAPH: Final = snapshot(
    *(entry(EntryKind.NODE, name) for name in ("/a", "/b", "/_tool")),
    *(entry(EntryKind.PUBLISHER, "/a", name) for name in ("/fast", "/slow", "/_hidden", "/idle")),
    entry(EntryKind.SERVICE, "/a", "/add", "example_interfaces/srv/AddTwoInts"),
)


def at_second(second: int, graph: GraphSnapshot = GRAPH, *, fast: int = 100) -> Sample:
    """Return a sample of a broker with steady traffic."""
    return sample(
        float(second),
        graph,
        topics=(topic("/fast", messages=fast * second), topic("/slow", messages=5 * second)),
        links=(link(1, "/a", bytes_received=900 * second), link(2, "/b", owed_calls=3)),
        routed=105 * second,
    )


class FakeTopicReader:
    """Has received what the test sets."""

    def __init__(self) -> None:
        self.received = Received([], 0, 0, None, None)
        self.closed = False

    async def pop(self) -> Received:
        """Return it."""
        return self.received

    async def close(self) -> None:
        """Record it."""
        self.closed = True


class FakeSource:
    """Returns the sample that the test sets; without a sample there is no broker."""

    def __init__(self) -> None:
        self.target = "callboard://somewhere:1"
        self.shown: Sample | None = at_second(1)
        self.readers: dict[str, FakeTopicReader] = {}

    async def sample(self) -> Sample:
        """Return the sample."""
        if self.shown is None:
            raise BrokerUnreachable("No broker")
        return self.shown

    async def listen(self, topic: str, snapshot: GraphSnapshot) -> FakeTopicReader:
        """Return a reader."""
        assert snapshot is GRAPH
        self.readers[topic] = FakeTopicReader()
        return self.readers[topic]


class Screen:
    """What one sees, and what one does."""

    def __init__(self, app: TopApp, source: FakeSource, pilot: Pilot[None]) -> None:
        self.app = app
        self.source = source
        self.pilot = pilot

    def text(self, selector: str) -> str:
        """Return the text of a widget."""
        return str(self.app.query_one(selector, Static).content)

    def rows(self, pane: str = "topics") -> list[list[str]]:
        """Return what stands in a table."""
        table: RowsTable[Any] = self.app.query_one(f"#{pane}-table", RowsTable)
        return [[cell.plain for cell in table.get_row_at(at)] for at in range(table.row_count)]

    def names(self, pane: str = "topics") -> list[str]:
        """Return the names in a table."""
        return [row[0] for row in self.rows(pane)]

    def selected(self, pane: str = "topics") -> str | None:
        """Return the name under the cursor."""
        table: RowsTable[Any] = self.app.query_one(f"#{pane}-table", RowsTable)
        return table.selected

    def log(self) -> str:
        """Return the messages that are shown."""
        return "\n".join(line.text.rstrip() for line in self.app.query_one(RichLog).lines)

    async def samples(self, *samples: Sample | None) -> None:
        """Let the view take samples."""
        for each in samples:
            self.source.shown = each
            await self.app.sample_now()
        await self.pilot.pause()

    async def press(self, *keys: str) -> None:
        """Press keys."""
        await self.pilot.press(*keys)
        await self.pilot.pause()


@contextmanager
def idle_without_messages(app: TopApp) -> Iterator[None]:
    """Let Textual's pilot wait until no widget has messages, not until the process is idle for a moment.

    A process that gets no processor from a busy machine looks idle before it has handled anything.
    """

    async def wait_for_idle(*_: float) -> None:
        turns = 0
        while turns < TURNS_WITHOUT_MESSAGES:
            await asyncio.sleep(0)
            widgets = (app, *app.screen.walk_children(with_self=True))
            turns = 0 if any(each.message_queue_size for each in widgets) else turns + 1

    with (
        mock.patch("textual.pilot.wait_for_idle", wait_for_idle),
        mock.patch("textual.app.wait_for_idle", wait_for_idle),
    ):
        yield


@asynccontextmanager
async def screen(*, size: tuple[int, int] = (100, 30), **options: Any) -> AsyncGenerator[Screen]:
    """Run a view that has taken two samples."""
    source = FakeSource()
    app = TopApp(source, interval_s=NEVER, echo_interval_s=NEVER, **options)
    async with app.run_test(size=size) as pilot:
        with idle_without_messages(app):
            await pilot.pause()
            here = Screen(app, source, pilot)
            await here.samples(at_second(1), at_second(2))
            yield here


async def test_it_shows_what_goes_on() -> None:
    """The place, what the broker does, and the three tables, the busiest topic first."""
    async with screen() as here:
        assert here.text("#target") == "callboard top  callboard://somewhere:1"
        assert "up 2.0 s" in here.text("#totals")
        assert "routed 105/s" in here.text("#totals")
        assert [row[:4] for row in here.rows()] == [
            *(["/fast", "1", "0", "100"], ["/slow", "1", "0", "5"], ["/idle", "1", "0", "-"])
        ]
        assert [row[:5] for row in here.rows("nodes")] == [
            *(["/a", "linked", "5", "0", "900"], ["/b", "linked", "0", "0", "0"])
        ]
        assert [row[:4] for row in here.rows("services")] == [["/add", "1", "0", "0"]]
        tabs = here.app.query_one(TabbedContent)
        assert [str(tabs.get_tab(pane).label) for pane in ("topics", "nodes", "services")] == [
            *("Topics 3", "Nodes 2", "Services 1")
        ]


async def test_brokers_are_shown_as_soon_as_a_mesh_has_several() -> None:
    """In a last column, which is not there before."""
    brokers = {number: MeshBrokerStats(number, name, "1") for number, name in enumerate(("a", "b"))}
    async with screen() as here:
        table: RowsTable[Any] = here.app.query_one("#nodes-table", RowsTable)
        width = len(table.ordered_columns)
        both = at_second(3)
        await here.samples(both._replace(report=replace(both.report, brokers=brokers)))
        assert len(table.ordered_columns) == width + 1
        assert str(table.ordered_columns[-1].label).rstrip() == "BROKER"
        assert [row[-1] for row in here.rows("nodes")] == ["a", "a"]
        await here.samples(at_second(4))
        assert [row[-1] for row in here.rows("nodes")] == ["", ""]


async def test_numbers_choose_a_table() -> None:
    """1, 2 and 3; the table then has the keys."""
    async with screen() as here:
        for key, pane in (("2", "nodes"), ("3", "services"), ("1", "topics")):
            await here.press(key)
            assert here.app.query_one(TabbedContent).active == pane
            assert here.app.focused is here.app.query_one(f"#{pane}-table")


async def test_keys_sort() -> None:
    """S, s and r: by a column to the left or right, and the other way round; the title says which."""
    async with screen() as here:
        await here.press("S", "S", "S")
        assert here.names() == ["/fast", "/idle", "/slow"]
        await here.press("r")
        assert here.names() == ["/slow", "/idle", "/fast"]
        table: RowsTable[Any] = here.app.query_one("#topics-table", RowsTable)
        assert str(table.ordered_columns[0].label).rstrip() == "TOPIC▼"
        await here.press("s", "s", "s")
        assert here.names() == ["/fast", "/slow", "/idle"]
        await here.press("S", "S", "S", "S")
        assert str(table.ordered_columns[8].label).rstrip() == "TYPE▲"


async def test_clicks_on_titles_sort() -> None:
    """Once by this column, again the other way round."""
    async with screen() as here:
        await here.pilot.click("#topics-table", offset=(2, 0))
        await here.pilot.pause()
        assert here.names() == ["/fast", "/idle", "/slow"]
        await here.pilot.click("#topics-table", offset=(2, 0))
        await here.pilot.pause()
        assert here.names() == ["/slow", "/idle", "/fast"]


async def test_the_cursor_stays_on_its_row() -> None:
    """At the top it stays at the top; once it has been moved it goes where its row goes."""
    async with screen() as here:
        assert here.selected() == "/fast"
        await here.samples(at_second(3, fast=1), at_second(4, fast=1), at_second(5, fast=1))
        await here.samples(at_second(6, fast=1))
        assert (here.names()[0], here.selected()) == ("/slow", "/slow")
        await here.press("down")
        assert here.selected() == "/fast"
        await here.samples(at_second(7), at_second(8), at_second(9), at_second(10))
        assert (here.names()[0], here.selected()) == ("/fast", "/fast")
        gone = snapshot(*(entry(EntryKind.PUBLISHER, "/a", name) for name in ("/slow", "/idle")))
        await here.samples(at_second(11, gone))
        assert (here.names(), here.selected()) == (["/slow", "/idle"], "/slow")


async def test_nodes_that_share_a_name_have_a_row_each() -> None:
    """Each row follows its own link, also when another one of the name goes."""
    same = snapshot(*(entry(EntryKind.NODE, "/same") for _ in range(2)))
    links = [link(4, "/same", queued=1), link(7, "/same", queued=2)]
    async with screen() as here:
        await here.samples(sample(3.0, same, links=(links[0], links[1])))
        assert here.names("nodes") == ["/same (link 4)", "/same (link 7)"]
        assert [row[6] for row in here.rows("nodes")] == ["1", "2"]
        await here.samples(sample(4.0, same, links=(links[1],)))
        assert [(row[0], row[6]) for row in here.rows("nodes")] == [("/same", "2")]


async def test_a_filter_is_typed() -> None:
    """It acts as it is typed, in all tables; Enter keeps it, Escape ends it."""
    async with screen() as here:
        await here.press("slash", *"SLo")
        assert (here.names(), here.names("nodes"), here.names("services")) == (["/slow"], [], [])
        await here.press("enter")
        assert here.app.focused is here.app.query_one("#topics-table")
        await here.samples(at_second(3))
        assert here.names() == ["/slow"]
        await here.press("escape")
        assert len(here.names()) == 3
        assert not here.app.query_one(Input).has_class("open")


async def test_letters_in_the_filter_are_no_commands() -> None:
    """Not even q and the space."""
    async with screen() as here:
        await here.press("slash", "q", "space", "1")
        assert here.app.query_one(Input).value == "q 1"
        assert here.names() == []


async def test_the_command_line_can_filter_and_show_hidden_names() -> None:
    """As with --filter and --include-hidden; h hides them again."""
    async with screen(words="id", hidden=True) as here:
        assert here.names() == ["/_hidden", "/idle"]
        await here.press("h")
        assert here.names() == ["/idle"]
        assert here.app.query_one(Input).has_class("open")


async def test_a_topic_is_received() -> None:
    """Enter opens it: its messages, where they come from and how long they take; Escape closes it."""
    async with screen() as here:
        await here.press("down", "enter")
        reader = here.source.readers["/slow"]
        assert here.text("#status") == "/slow  5 messages/s  no delays measured yet"
        reader.received = Received(
            [ReceivedMessage("/a", 0, 0.0004, "data: hi [b]there[/b]")], 1234, 99, 0.0005, 0.021
        )
        await here.app.query_one("#echo").show_new()  # type: ignore[attr-defined]
        await here.pilot.pause()
        assert "  /a  0.4 ms\ndata: hi [b]there[/b]" in here.log()
        assert here.text("#status").endswith("delay p50 0.5 ms, p99 21 ms of the last 99  1,234 not shown")
        await here.samples(at_second(3, snapshot()))
        assert "  the topic is gone  " in here.text("#status")
        await here.press("escape")
        assert reader.closed
        assert not here.app.query_one("#echo").has_class("open")


async def test_another_topic_takes_the_place_of_the_first() -> None:
    """Its reader is closed; Enter on what is received already changes nothing."""
    async with screen() as here:
        await here.press("enter", "down", "enter", "enter")
        assert {topic: reader.closed for topic, reader in here.source.readers.items()} == {
            "/fast": True,
            "/slow": False,
        }


async def test_space_pauses() -> None:
    """Messages stand still, and the screen says so, until it is pressed again."""
    async with screen() as here:
        await here.press("enter", "space")
        reader = here.source.readers["/fast"]
        reader.received = Received([ReceivedMessage("/a", 0, 0.0, "data: hi")], 0, 1, 0.1, 0.1)
        pane = here.app.query_one("#echo")
        await pane.show_new()  # type: ignore[attr-defined]
        assert here.text("#target").endswith("paused")
        assert here.text("#status").endswith("paused")
        assert here.log() == ""
        await here.press("space")
        await pane.show_new()  # type: ignore[attr-defined]
        await here.pilot.pause()
        assert "data: hi" in here.log()
        assert here.text("#status").endswith("delay p50 100 ms, p99 100 ms of the last one")
        assert not here.text("#target").endswith("paused")


async def test_a_lost_broker_is_reported_until_it_is_back() -> None:
    """What was seen last stays; a new broker's rates do not come from the old one's counts."""
    async with screen() as here:
        banner = here.app.query_one("#lost")
        assert not banner.display
        await here.samples(None)
        assert banner.display
        assert "callboard://somewhere:1 does not answer" in here.text("#lost")
        assert here.names() == ["/fast", "/slow", "/idle"]
        again = sample(1.0, GRAPH, broker="b2")
        await here.samples(again)
        assert not banner.display
        assert here.rows()[0][3] == "-"


async def test_no_broker_at_first() -> None:
    """The view says so and waits."""
    source = FakeSource()
    source.shown = None
    app = TopApp(source, interval_s=NEVER, echo_interval_s=NEVER)
    async with app.run_test() as pilot:
        await pilot.pause()
        here = Screen(app, source, pilot)
        await here.samples(None)
        await here.press("h", "slash", "a", "escape", "enter", "s", "r")
        assert app.screen_stack[0].query_one("#lost").display  # help may still be above it
        await here.samples(at_second(1))
        assert len(here.names()) == 4


async def test_a_sample_that_comes_after_the_end() -> None:
    """Whether there is a broker or not, nothing is shown any more, and nothing fails."""
    source = FakeSource()
    app = TopApp(source, interval_s=NEVER, echo_interval_s=NEVER)
    async with app.run_test() as pilot:
        await pilot.pause()
    for source.shown in (at_second(1), None):
        assert await app.sample_now() == (source.shown is not None)


async def test_more_rows_than_anybody_reads_are_cut() -> None:
    """The filter still finds each of them; the tab says how many there are."""
    crowd = snapshot(*(entry(EntryKind.PUBLISHER, "/a", f"/t{number}") for number in range(SHOWN_ROWS + 50)))
    async with screen() as here:
        await here.samples(at_second(3, crowd))
        assert len(here.names()) == SHOWN_ROWS
        assert str(here.app.query_one(TabbedContent).get_tab("topics").label) == f"Topics {SHOWN_ROWS + 50}"
        await here.press("slash", *f"t{SHOWN_ROWS + 49}")
        assert here.names() == [f"/t{SHOWN_ROWS + 49}"]


async def test_help_says_what_the_keys_do() -> None:
    """A question mark opens it; q closes it, and only then quits."""
    async with screen() as here:
        await here.press("question_mark")
        assert isinstance(here.app.screen, HelpScreen)
        await here.press("q")
        assert not isinstance(here.app.screen, HelpScreen)
        assert here.app.is_running
        await here.press("q")
        assert here.app.return_code == 0


async def test_control_c_quits() -> None:
    """Also while one types."""
    async with screen() as here:
        await here.press("slash", "ctrl+c")
        assert here.app.return_code == 0


async def test_it_fits_any_terminal() -> None:
    """It is drawn anew when its size changes, down to a few lines."""
    async with screen(size=(160, 50)) as here:
        await here.press("enter")
        for width, height in ((80, 24), (30, 8), (120, 40)):
            await here.pilot.resize_terminal(width, height)
            await here.samples(at_second(3))
            assert here.app.size == (width, height)
        await until(lambda: here.app.query_one("#topics-table").size.width == 120)  # laid out by then


async def test_no_color_is_honoured(monkeypatch: pytest.MonkeyPatch) -> None:
    """The screen then has greys only."""
    monkeypatch.setenv("NO_COLOR", "1")
    async with screen() as here:
        colors = {
            color
            for color in here.app.export_screenshot().split("#")[1:]
            for color in [color[:6].lower()]
            if all(char in "0123456789abcdef" for char in color)
        }
        window = {"ff5f57", "febc2e", "28c840", "c5c8c6"}  # the frame that a screenshot is put in
        assert all(len({color[:2], color[2:4], color[4:]}) == 1 for color in colors - window)

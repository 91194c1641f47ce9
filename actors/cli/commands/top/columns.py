"""The columns of `callboard top`: their values, sort order and alarms."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Generic, TypeVar

from actors.cli.tables import Styled
from actors.tools.overview import SUSPENDED, WITHHELD, NodeRow, ServiceRow, TopicRow

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from actors.cli.tables import Style
    from actors.tools.overview import Overview, Totals

Row = TopicRow | NodeRow | ServiceRow
RowT = TypeVar("RowT", bound=Row)
UNKNOWN: Final = "-"
"""The text of an unknown number."""


def _no_alarm(_: object) -> Style:
    return ""


@dataclass(frozen=True, kw_only=True, slots=True)
class Column(Generic[RowT]):
    """A column of one of the tables.

    Attributes:
        title: Its heading.
        value: Returns the value of a row, by which it is sorted.
        text: Returns the text of a row.
        style: The style of the column.
        alarm: Returns the style of an alarming row; "" for others.
        optional: Whether to show it only if a row has a value.
    """

    title: str
    value: Callable[[RowT], float | str]
    text: Callable[[RowT], str]
    style: Style = "count"
    alarm: Callable[[RowT], Style] = _no_alarm
    optional: bool = False

    @property
    def falls(self) -> bool:
        """Whether the largest value comes first."""
        return self.style == "count"

    def cell(self, row: RowT) -> Styled:
        """Return the text and the style of a row."""
        return Styled(self.text(row), self.alarm(row) or self.style)


def compact(number: float) -> str:
    """Write a number of 0 or more in at most 6 characters: 0.25, 12.5, 1,234, 56.7k, 1.23M."""
    if number < 9.995:
        return f"{number:.2f}".rstrip("0").rstrip(".")
    if number < 999.5:
        return f"{number:.1f}".rstrip("0").rstrip(".")
    if number < 9999.5:
        return f"{number:,.0f}"
    for unit in "kMG":
        number /= 1000
        if number < 999.5:
            return f"{number:.3g}{unit}"
    return f"{number / 1000:.3g}T"


def duration(seconds: float) -> str:
    """Write a time in two units at most: 0.4 ms, 12 ms, 1.2 s, 45 s, 3 min 20 s, 2 h 5 min, 3 d 4 h."""
    if seconds < 0:  # of two clocks
        return f"-{duration(-seconds)}"
    if seconds < 0.9995:
        return f"{1000 * seconds:.2g} ms" if seconds < 0.00995 else f"{1000 * seconds:.0f} ms"
    if seconds < 59.5:
        return f"{seconds:.1f} s" if seconds < 9.95 else f"{seconds:.0f} s"
    whole = round(seconds)
    for size, unit, smaller, name in ((86400, "d", 3600, "h"), (3600, "h", 60, "min"), (60, "min", 1, "s")):
        if whole >= size:
            rest = whole % size // smaller
            return f"{whole // size} {unit} {rest} {name}" if rest else f"{whole // size} {unit}"
    raise AssertionError(seconds)


def rate(number: float | None) -> str:
    """Write a rate."""
    return UNKNOWN if number is None else compact(number)


def _known(number: float | None) -> float:
    return -1.0 if number is None else number


def _number(title: str, value: Callable[[RowT], float | None], alarm: Style = "") -> Column[RowT]:
    return Column(
        title=title,
        value=lambda row: _known(value(row)),
        text=lambda row: rate(value(row)),
        alarm=lambda row: alarm if value(row) else "",
    )


def _name(row: Row) -> str:
    return row.name


def _node(row: NodeRow) -> str:
    return f"{row.name} (link {row.link})" if row.shared else row.name


def _types(row: TopicRow | ServiceRow) -> str:
    return ", ".join(row.types)


def _clash(row: TopicRow | ServiceRow) -> Style:
    return "bad" if len(row.types) > 1 else ""


def _broker(row: NodeRow) -> str:
    return row.broker


def _state(row: NodeRow) -> str:
    return f"silent for {duration((row.silent_ms or 0) / 1000)}" if row.state == SUSPENDED else row.state


def _silent(row: NodeRow) -> Style:
    return "bad" if row.state == SUSPENDED else ""


TOPICS: Final[tuple[Column[TopicRow], ...]] = (
    Column(title="TOPIC", value=_name, text=_name, style="name"),
    _number("PUBS", lambda row: row.publishers),
    _number("SUBS", lambda row: row.subscriptions),
    _number("MSG/S", lambda row: row.messages_per_sec),
    _number("B/S", lambda row: row.bytes_per_sec),
    _number("DROPS/S", lambda row: row.drops_per_sec, "bad"),
    _number("QUEUED", lambda row: row.queued, "warn"),
    _number("LOST", lambda row: row.lost, "warn"),
    Column(title="TYPE", value=_types, text=_types, style="type", alarm=_clash),
)
BUSIEST: Final = 3
"""The column by which topics are sorted at first."""
NODES: Final[tuple[Column[NodeRow], ...]] = (
    Column(title="NODE", value=_node, text=_node, style="name"),
    Column(title="STATE", value=_state, text=_state, style="dim", alarm=_silent),
    _number("ENDS", lambda row: row.endpoints),
    _number("IN B/S", lambda row: row.received_bytes_per_sec),
    _number("OUT B/S", lambda row: row.sent_bytes_per_sec),
    _number("DROPS/S", lambda row: row.drops_per_sec, "bad"),
    _number("QUEUED", lambda row: row.queued, "warn"),
    _number("LOST", lambda row: row.dropped, "warn"),
    _number("CALLS", lambda row: row.pending_calls),
    _number("OWED", lambda row: row.owed_calls),
    Column(title="BROKER", value=_broker, text=_broker, style="dim", optional=True),
)
SERVICES: Final[tuple[Column[ServiceRow], ...]] = (
    Column(title="SERVICE", value=_name, text=_name, style="name"),
    _number("SERVERS", lambda row: row.servers),
    _number("CLIENTS", lambda row: row.clients),
    _number("OWED", lambda row: row.owed_calls),
    Column(title="TYPE", value=_types, text=_types, style="type", alarm=_clash),
)


def chosen(rows: Iterable[RowT], column: Column[RowT], words: str = "", *, falling: bool) -> list[RowT]:
    """Return the rows whose name, type or state contains the words, sorted by a column and then by name."""
    wanted = words.casefold()
    found = [row for row in rows if wanted in _searched(row).casefold()]
    found.sort(key=_name)
    found.sort(key=column.value, reverse=falling)
    return found


def _searched(row: Row) -> str:
    if isinstance(row, NodeRow):
        return f"{row.name} {row.broker} {row.state} {_state(row)}"
    return f"{row.name} {_types(row)}"


def headlines(totals: Totals) -> tuple[list[Styled], list[Styled]]:
    """Return the state and the traffic of the broker, in a few words each."""
    if totals.withheld:
        return [Styled(WITHHELD, "warn")], []
    condition = [
        Styled(f"up {duration(totals.uptime_sec)}", ""),
        Styled(f"connections {compact(totals.connections)}", ""),
        *([Styled(f"suspended {compact(totals.suspended)}", "warn")] if totals.suspended else []),
        Styled(f"loop late by {duration(totals.lag_sec)}, longest {duration(totals.longest_lag_sec)}", ""),
    ]
    dropping = totals.drops_per_sec is not None and totals.drops_per_sec > 0
    work = [
        Styled(f"routed {rate(totals.routed_per_sec)}/s", ""),
        Styled(f"delivered {rate(totals.delivered_per_sec)}/s", ""),
        *([Styled(f"shared {rate(totals.shared_per_sec)}/s", "")] if totals.shared_per_sec else []),
        Styled(f"drops {rate(totals.drops_per_sec)}/s", "bad" if dropping else ""),
        Styled(f"calls {rate(totals.calls_per_sec)}/s", ""),
        Styled(f"queued {compact(totals.queued)}", "warn" if totals.queued else ""),
    ]
    return condition, work


def found_in(seen: Overview, words: str) -> tuple[list[TopicRow], list[NodeRow], list[ServiceRow]]:
    """Return the rows that contain the words: the busiest topics first, nodes and services by name."""
    return (
        chosen(seen.topics, TOPICS[BUSIEST], words, falling=True),
        chosen(seen.nodes, NODES[0], words, falling=False),
        chosen(seen.services, SERVICES[0], words, falling=False),
    )

"""What stands in the columns of `callboard top`."""

from __future__ import annotations

from dataclasses import replace

import pytest

from actors.cli.commands.top.columns import (
    BUSIEST,
    NODES,
    SERVICES,
    TOPICS,
    chosen,
    compact,
    duration,
    headlines,
    rate,
)
from actors.cli.tables import Styled
from actors.tools.overview import WITHHELD, Samples
from proto.wire.codes import EntryKind
from tests.actors.tools.made_up import entry, link, sample, snapshot, topic


@pytest.mark.parametrize(
    ("number", "text"),
    [
        *((0, "0"), (0.254, "0.25"), (3.0, "3"), (9.994, "9.99"), (9.996, "10"), (12.34, "12.3")),
        *((999.4, "999.4"), (999.6, "1,000"), (1234, "1,234"), (9999.4, "9,999"), (9999.6, "10k")),
        *((56_712, "56.7k"), (999_499, "999k"), (999_600, "1M"), (1.23e9, "1.23G"), (4.5e13, "45T")),
    ],
)
def test_numbers_are_short(number: float, text: str) -> None:
    """Three digits are enough, but four before the units begin."""
    assert compact(number) == text


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        *((0, "0 ms"), (0.00042, "0.42 ms"), (0.0123, "12 ms"), (0.9994, "999 ms"), (0.9996, "1.0 s")),
        *((9.94, "9.9 s"), (9.96, "10 s"), (59.4, "59 s"), (59.6, "1 min"), (200, "3 min 20 s")),
        *((3600, "1 h"), (7500, "2 h 5 min"), (3 * 86400 + 4 * 3600, "3 d 4 h"), (-0.002, "-2 ms")),
    ],
)
def test_times_are_in_two_units_at_most(seconds: float, text: str) -> None:
    """From fractions of a millisecond to days; a negative one is the difference of two clocks."""
    assert duration(seconds) == text


def test_no_rate_is_no_zero() -> None:
    """There is none before the second sample."""
    assert (rate(None), rate(0.0)) == ("-", "0")


GRAPH = snapshot(
    *(entry(EntryKind.NODE, name) for name in ("/a", "/b")),
    *(entry(EntryKind.PUBLISHER, "/a", name) for name in ("/fast", "/slow", "/also_slow")),
    entry(EntryKind.SUBSCRIPTION, "/b", "/slow", "std_msgs/msg/Int32"),
    entry(EntryKind.SERVICE, "/a", "/add", "example_interfaces/srv/AddTwoInts"),
)
BEFORE = sample(1.0, GRAPH, topics=(topic("/fast"), topic("/slow")), links=(link(1, "/a"), link(2, "/b")))
AFTER = sample(
    2.0,
    GRAPH,
    topics=(topic("/fast", messages=900, dropped=3, queued=7), topic("/slow", messages=5)),
    links=(link(1, "/a", owed_calls=2), link(2, "/b", suspended=True, silent_ms=4200)),
    dropped=3,
    queued=7,
    suspended=1,
)
SAMPLES = Samples()
SAMPLES.add(BEFORE)
SEEN = SAMPLES.add(AFTER)


def test_rows_are_sorted_by_a_column_and_then_by_name() -> None:
    """The busiest topic first; those alike by their names, in both directions."""

    def names(*, falling: bool) -> list[str]:
        return [row.name for row in chosen(SEEN.topics, TOPICS[BUSIEST], falling=falling)]

    assert names(falling=True) == ["/fast", "/slow", "/also_slow"]
    assert names(falling=False) == ["/also_slow", "/slow", "/fast"]
    still = [replace(row, messages_per_sec=1.0) for row in SEEN.topics]
    for falling in (True, False):
        assert [row.name for row in chosen(still, TOPICS[BUSIEST], falling=falling)] == [
            *("/also_slow", "/fast", "/slow")
        ]


@pytest.mark.parametrize(
    ("words", "names"),
    [("SLOW", ["/also_slow", "/slow"]), ("int32", ["/slow"]), ("", ["/also_slow", "/fast", "/slow"])],
)
def test_the_filter_looks_at_names_and_types(words: str, names: list[str]) -> None:
    """In upper or lower case."""
    assert [row.name for row in chosen(SEEN.topics, TOPICS[0], words, falling=False)] == names


def test_the_filter_looks_at_states() -> None:
    """Silent nodes are found."""
    assert [row.name for row in chosen(SEEN.nodes, NODES[0], "silent", falling=False)] == ["/b"]


def test_what_is_wrong_stands_out() -> None:
    """Drops, queues, a clash of types, a silent node; what is as it should be does not."""
    also_slow, fast, slow = SEEN.topics
    cells = [column.cell(fast) for column in TOPICS]
    assert cells == [
        *(Styled("/fast", "name"), Styled("1", "count"), Styled("0", "count"), Styled("900", "count")),
        *(Styled("0", "count"), Styled("3", "bad"), Styled("7", "warn"), Styled("3", "warn")),
        Styled("std_msgs/msg/String", "type"),
    ]
    assert TOPICS[-1].cell(slow) == Styled("std_msgs/msg/Int32, std_msgs/msg/String", "bad")
    assert TOPICS[BUSIEST].cell(also_slow) == Styled("-", "count")
    assert [NODES[1].cell(row) for row in SEEN.nodes] == [
        *(Styled("linked", "dim"), Styled("silent for 4.2 s", "bad"))
    ]
    assert [column.cell(SEEN.services[0]).text for column in SERVICES] == [
        *("/add", "1", "0", "2", "example_interfaces/srv/AddTwoInts")
    ]


def test_the_headlines_say_what_is_wrong() -> None:
    """And suspended links only if there are any."""
    condition, work = headlines(SEEN.totals)
    assert Styled("suspended 1", "warn") in condition
    assert Styled("drops 3/s", "bad") in work
    assert Styled("queued 7", "warn") in work
    well, idle = headlines(replace(SEEN.totals, suspended=0, queued=0, drops_per_sec=0.0))
    assert {part.style for part in (*well, *idle)} == {""}


def test_the_headline_says_that_the_broker_withholds_its_numbers() -> None:
    """In place of zeros."""
    assert headlines(replace(SEEN.totals, broker="")) == ([Styled(WITHHELD, "warn")], [])


def test_the_headline_has_shared_memory_where_it_is_used() -> None:
    """Copies per second that are passed on by reference."""
    assert not any("shared" in part.text for part in headlines(SEEN.totals)[1])
    _, work = headlines(replace(SEEN.totals, shared_per_sec=120.0))
    assert Styled("shared 120/s", "") in work

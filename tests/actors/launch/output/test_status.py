"""The status line: counted from events."""

from __future__ import annotations

import pytest

from actors.launch.output.status import Status, StatusLine
from actors.launch.planning.events import Level, Message, ProcessRestarts, ProcessWaits, ShuttingDown
from tests.actors.launch.event_samples import exited, spec, started, wrote


def test_processes_are_counted_by_what_has_become_of_them() -> None:
    """Each counts once, as what it is now."""
    lines: list[str] = []
    status = Status(lambda line: lines.append(str(line)))
    one, two = spec("a-1"), spec("b-2")
    for event in (
        ProcessWaits(one, None, (), 0.0),
        started(two),
        started(one),
        exited(two, 1),
        ProcessRestarts(two, 7, 0.5, "respawn"),
        started(two),
        exited(one, 0),
        exited(two, 1),
        ShuttingDown("enough"),
    ):
        status(event)
    assert lines == [
        "1 waiting · Ctrl-C stops",
        "1 up · 1 waiting · Ctrl-C stops",
        "2 up · Ctrl-C stops",
        "1 up · 1 dead · Ctrl-C stops",
        "1 up · 1 restarting · Ctrl-C stops",
        "2 up · Ctrl-C stops",
        "1 up · 1 finished · Ctrl-C stops",
        "1 dead · 1 finished · Ctrl-C stops",
        "stopping: 0 left · Ctrl-C again kills",
    ]


def test_what_changes_nothing_is_not_shown_again() -> None:
    """Lines of processes, messages, and a wait that goes on."""
    lines: list[StatusLine] = []
    status = Status(lines.append)
    one = spec("a-1")
    for event in (ProcessWaits(one, None, (), 0.0), ProcessWaits(one, None, (), 10.0)):
        status(event)
    status(wrote(one, b"x"))
    status(Message(Level.INFO, "x"))
    assert len(lines) == 1


@pytest.mark.parametrize(
    ("columns", "text"),
    [(80, "3 up · Ctrl-C stops"), (20, "3 up · Ctrl-C stops"), (9, "3 up · C"), (1, ""), (0, "")],
)
def test_a_line_is_cut_to_the_terminal(columns: int, text: str) -> None:
    """One column is left for the cursor, so that nothing is ever wrapped."""
    line = StatusLine((("3 up", "\x1b[32m"), ("Ctrl-C stops", "")))
    assert line.drawn(columns, color=False).decode() == text
    colored = line.drawn(columns, color=True).decode()
    assert colored.replace("\x1b[32m", "").replace("\x1b[0m", "") == text
    assert ("\x1b[32m3 up\x1b[0m" in colored) is (columns > 4)

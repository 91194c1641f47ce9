"""What is kept of a launch, by its events."""

from __future__ import annotations

import re

from actors.launch.planning import events
from actors.launch.planning.events import Level, Stream
from actors.launch.planning.presence import Presence, PresenceKind
from actors.launch.planning.process_spec import ProcessSpec
from actors.processes.outcome import Outcome, outcome_of_exit
from actors.testing import transcript
from actors.testing.transcript import OutputLine, ProcessState, Search, Transcript


def spec(label: str, node: str | None = None) -> ProcessSpec:
    """Return a process."""
    return ProcessSpec(label=label, name=label.rpartition("-")[0], node=node, command=(), shown="")


TALKER = spec("talker-1", "/ns/talker")
LISTENER = spec("listener-2")


def wrote(process: ProcessSpec, *lines: bytes) -> events.ProcessIO:
    """Return that a process has written lines."""
    return events.ProcessIO(process, 7, Stream.OUTPUT, lines)


def texts(known: Transcript, process: str | None = None) -> list[str]:
    """Return the lines that are kept."""
    return [line.text for line in known.lines(process)]


def state(known: Transcript, label: str) -> ProcessState:
    """Return where a process is."""
    (status,) = known.called(label)
    return status.state


def test_lines_are_found_by_any_name_of_their_process() -> None:
    """By label, by name and by node; the launch's own by "launch"; in their order without a name."""
    known = Transcript()
    for event in (
        wrote(TALKER, b"one", b"tw\xff"),
        wrote(LISTENER, b"heard"),
        events.Message(Level.INFO, "hello"),
        events.Message(Level.WARN, "waits", "talker-1"),
    ):
        known.on_event(event)
    for name in ("talker-1", "talker", "/ns/talker"):
        assert texts(known, name) == ["one", "tw\ufffd"]
    assert texts(known, "launch") == ["hello", "talker-1: waits"]
    assert texts(known, "talk") == []
    assert texts(known) == ["one", "tw\ufffd", "heard", "hello", "talker-1: waits"]
    assert [line.number for line in known.lines()] == [1, 2, 3, 4, 5]
    assert str(next(known.lines("listener"))) == "[listener-2] heard"


def test_a_search_finds_the_first_line_that_came_or_comes() -> None:
    """Of what is there the first; else the first that comes; behind a line only later ones; until it ends."""
    known = Transcript()
    known.on_event(wrote(TALKER, b"a 1", b"b (2)"))
    there, later, after, over, other = (
        Search(re.compile(r"\d"), None),
        Search("(", "listener"),
        Search("a", "talker"),
        Search("a", None),
        Search("a", "nobody"),
    )
    for search in (there, later, over, other):
        known.begin(search)
    assert there.found == over.found == OutputLine("talker-1", "a 1", 1)
    known.begin(after, after=there.found)
    assert (later.found, after.found) == (None, None)
    known.end(later)
    known.on_event(wrote(LISTENER, b"(a)"))
    known.on_event(wrote(TALKER, b"a 3", b"a 4"))
    assert later.found is None
    assert after.found == OutputLine("talker-1", "a 3", 4)
    assert other.found is None


def test_a_line_is_found_that_is_dropped_at_once() -> None:
    """A search looks at what comes before the limits do."""
    known = Transcript(max_lines=2)
    search = Search("needle", None)
    known.begin(search)
    known.on_event(wrote(TALKER, b"needle", b"x", b"y", b"z"))
    assert search.found == OutputLine("talker-1", "needle", 1)
    assert texts(known) == ["y", "z"]
    assert known.dropped_lines == 2


def test_bytes_are_bounded_too() -> None:
    """Long lines push out more than one; one line over the limit leaves nothing."""
    known = Transcript(max_bytes=10)
    known.on_event(wrote(TALKER, b"1234", b"5678", b"12345678"))
    assert texts(known) == ["12345678"]
    known.on_event(wrote(TALKER, b"x" * 11))
    assert texts(known) == []
    assert known.dropped_lines == 4
    known.on_event(wrote(TALKER, b"x" * 10))
    assert texts(known) == ["x" * 10]


def test_a_process_is_followed_through_its_life() -> None:
    """Waiting, running, ended, restarting, running, ended; with how it ended."""
    known = Transcript()
    known.on_event(events.ProcessWaits(TALKER, None, (Presence(PresenceKind.NODE, "/a"),), 0.0))
    assert state(known, "talker") is ProcessState.WAITING
    assert str(known.processes[0]) == "talker-1: waiting for node /a"
    known.on_event(events.ProcessStarted(TALKER, 7))
    assert str(known.processes[0]) == "talker-1: running, pid 7"
    known.on_event(events.ProcessExited(TALKER, 7, outcome_of_exit(-2)))
    assert str(known.processes[0]) == "talker-1: ended, killed by SIGINT"
    assert known.processes[0].exit_code == -2
    known.on_event(events.ProcessRestarts(TALKER, None, 0.1, "respawn"))
    assert state(known, "talker") is ProcessState.RESTARTING
    known.on_event(events.ProcessStarted(TALKER, 8))
    assert str(known.processes[0]) == "talker-1: running, pid 8, before: killed by SIGINT, restarts: 1"
    known.on_event(events.ProcessExited(TALKER, 8, outcome_of_exit(0)))
    assert known.processes[0].exit_code == 0
    assert known.processes[0].restarts == 1


def test_one_that_is_stopped_to_be_started_again_has_not_ended() -> None:
    """It is running until it exits, and then restarting, unless the launch ends."""
    known = Transcript()
    known.on_event(events.ProcessStarted(TALKER, 7))
    for restarts in (1, 2):
        known.on_event(events.ProcessRestarts(TALKER, 7, 0.0, "talker.py has changed"))
        assert state(known, "talker") is ProcessState.RUNNING
        known.on_event(events.ProcessExited(TALKER, 7, outcome_of_exit(-2)))
        assert state(known, "talker") is ProcessState.RESTARTING
        known.on_event(events.ProcessStarted(TALKER, 8))
        assert known.processes[0].restarts == restarts
    known.on_event(events.ProcessRestarts(TALKER, 8, 0.0, "talker.py has changed"))
    known.on_event(events.ShuttingDown("enough"))
    assert state(known, "talker") is ProcessState.RUNNING
    known.on_event(events.ProcessExited(TALKER, 8, outcome_of_exit(-2)))
    assert state(known, "talker") is ProcessState.ENDED


def test_what_waits_at_the_end_has_ended() -> None:
    """Neither one that waits nor one that would be started again lives on; one that runs does."""
    known = Transcript()
    known.on_event(events.ProcessWaits(TALKER, None, (), 0.0))
    known.on_event(events.ProcessExited(LISTENER, 7, outcome_of_exit(1)))
    known.on_event(events.ProcessRestarts(LISTENER, None, 0.1, "respawn"))
    known.on_event(events.ProcessStarted(spec("other-3"), 9))
    known.on_event(events.ShuttingDown("enough"))
    states = [each.state for each in known.processes]
    assert states == [ProcessState.ENDED, ProcessState.ENDED, ProcessState.RUNNING]


def test_what_has_no_exit_code_gets_one() -> None:
    """A node in this process that returns has 0; one that raises, and a program that is missing, 1."""
    known = Transcript()
    known.on_event(events.ProcessExited(TALKER, None, Outcome(normal=True, reason="returned")))
    known.on_event(events.ProcessExited(LISTENER, None, Outcome(normal=False, reason="ValueError: no map")))
    assert [each.exit_code for each in known.processes] == [0, 1]


def test_processes_that_have_ended_are_forgotten_over_the_limit() -> None:
    """The oldest that has ended goes; its lines stay its own."""
    known = Transcript()
    known.on_event(events.ProcessStarted(TALKER, 1))
    for number in range(2, transcript.MAX_PROCESSES + 2):
        known.on_event(wrote(spec(f"short-{number}"), b"%d" % number))
        known.on_event(events.ProcessExited(spec(f"short-{number}"), number, outcome_of_exit(0)))
    assert len(known.processes) == transcript.MAX_PROCESSES
    assert [each.label for each in known.processes[:2]] == ["talker-1", "short-3"]
    assert texts(known, "launch") == []
    assert texts(known, "short-2") == ["2"]

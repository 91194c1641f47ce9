"""What a launch says of what happens."""

from __future__ import annotations

import pytest

from actors.launch.output.messages import message_for
from actors.launch.planning.events import (
    Appeared,
    Event,
    Level,
    Message,
    ProcessExited,
    ProcessRestarts,
    ProcessWaits,
    ShuttingDown,
)
from actors.launch.planning.presence import Presence, PresenceKind
from actors.processes.outcome import Outcome, outcome_of_error
from tests.actors.launch.event_samples import exited, program, spec, started, wrote

TALKER = spec()
NODE = spec(program=program)
SERVICE = Presence(PresenceKind.SERVICE, "/ns1/add_two_ints")
TOPIC = Presence(PresenceKind.TOPIC, "/news")


@pytest.mark.parametrize(
    ("event", "level", "text"),
    [
        (started(TALKER), Level.INFO, "process started with pid [7]"),
        (started(NODE, None), Level.INFO, "node started in this process"),
        (exited(TALKER, 0), Level.INFO, "process has finished cleanly [pid 7]"),
        (exited(TALKER, 3), Level.ERROR, "process has died [pid 7, exit code 3, cmd 'talker 'a b'']"),
        (exited(TALKER, -9), Level.ERROR, "process has died [pid 7, killed by SIGKILL, cmd 'talker 'a b'']"),
        (
            ProcessExited(TALKER, None, outcome_of_error(FileNotFoundError("no folder"))),
            Level.ERROR,
            "process could not be run: no folder",
        ),
        (
            ProcessExited(TALKER, None, Outcome(normal=False, reason="no service /a after 60 s")),
            Level.ERROR,
            "process could not be run: no service /a after 60 s",
        ),
        (exited(NODE, 0, None), Level.INFO, "node has finished cleanly"),
        (
            ProcessExited(NODE, None, outcome_of_error(ValueError("no such map"))),
            Level.ERROR,
            "node has died [ValueError: no such map]",
        ),
        (ProcessRestarts(TALKER, 7, 0.5, "respawn"), Level.INFO, "process starts again in 0.5 s"),
        (
            ProcessRestarts(TALKER, 7, 0, "a.py has changed"),
            Level.INFO,
            "process starts again: a.py has changed",
        ),
        (ProcessWaits(TALKER, None, (SERVICE, TOPIC), 0.0), Level.INFO, f"waits for {SERVICE}, topic /news"),
        (ProcessWaits(TALKER, None, (TOPIC,), 10.0), Level.WARN, "still waits for topic /news after 10 s"),
    ],
)
def test_each_process_has_its_lines(event: Event, level: Level, text: str) -> None:
    """They say what has become of it, with its label."""
    assert message_for(event) == Message(level, text, "talker-1")


def test_the_launch_speaks_for_itself() -> None:
    """Messages are reported as they are, and why it stops."""
    message = Message(Level.WARN, "careful", "b-2")
    assert message_for(message) is message
    assert message_for(ShuttingDown("enough")) == Message(Level.INFO, "stopping: enough")


@pytest.mark.parametrize(
    "event",
    [
        wrote(TALKER, b"hello"),
        Appeared(TOPIC),
        ProcessExited(TALKER, None, Outcome(normal=True, reason="not started")),
    ],
)
def test_not_everything_is_worth_a_line(event: Event) -> None:
    """What processes write is theirs; topics come and go; what has not run has not ended."""
    assert message_for(event) is None

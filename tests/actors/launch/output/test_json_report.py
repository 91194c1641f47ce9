"""Events as JSON: one object a line."""

from __future__ import annotations

import json
from typing import Any

import pytest

from actors.launch.description.process_actions import OutputMode
from actors.launch.output.json_report import JsonReport
from actors.launch.planning.events import (
    Appeared,
    Event,
    Level,
    Message,
    ProcessRestarts,
    ProcessWaits,
    ShuttingDown,
    Stream,
)
from actors.launch.planning.presence import Presence, PresenceKind
from tests.actors.launch.event_samples import exited, spec, started, wrote

TALKER = spec(node="/ns1/talker", output=OutputMode.LOG)
TOPIC = Presence(PresenceKind.TOPIC, "/news")
OF_TALKER = {"process": "talker-1", "pid": 7}


def reported(*events: Event) -> list[dict[str, Any]]:
    """Return the objects that events become."""
    written: list[bytes] = []
    report = JsonReport(written.append, lambda: 12.25)
    for event in events:
        report(event)
    return [json.loads(line) for line in b"".join(written).splitlines()]


@pytest.mark.parametrize(
    ("event", "facts"),
    [
        (
            started(TALKER),
            {"event": "started", "node": "/ns1/talker", "command": ["talker", "a b"], **OF_TALKER},
        ),
        (
            exited(TALKER, -9),
            {
                "event": "exited",
                "returncode": -9,
                "signal": "SIGKILL",
                "normal": False,
                **OF_TALKER,
                "reason": "killed by SIGKILL",
            },
        ),
        (
            ProcessWaits(TALKER, None, (TOPIC,), 1.5),
            {
                "event": "waiting",
                "process": "talker-1",
                "pid": None,
                "so_far_sec": 1.5,
                "missing": [{"kind": "topic", "name": "/news"}],
            },
        ),
        (
            ProcessRestarts(TALKER, 7, 0.5, "respawn"),
            {"event": "restarting", "delay_sec": 0.5, "reason": "respawn", **OF_TALKER},
        ),
        (Appeared(TOPIC), {"event": "appeared", "kind": "topic", "name": "/news"}),
        (
            Message(Level.WARN, "hm\n", "a-1"),
            {"event": "message", "level": "WARN", "text": "hm\n", "about": "a-1"},
        ),
        (ShuttingDown("enough"), {"event": "stopping", "reason": "enough"}),
    ],
)
def test_an_event_is_an_object(event: Event, facts: dict[str, Any]) -> None:
    """With its time, and all that is known of it."""
    assert reported(event) == [{"time": 12.25, **facts}]


def test_each_line_of_a_process_is_an_object() -> None:
    """Wherever the line is to go; bytes that are no text are replaced."""
    event = wrote(TALKER, b"one", b"tw\xffo \x1b[1m", stream=Stream.STDERR)
    assert reported(event) == [
        {"event": "output", "time": 12.25, **OF_TALKER, "stream": "stderr", "line": line}
        for line in ("one", "tw\ufffdo \x1b[1m")
    ]


def test_the_end_and_what_was_lost_are_objects() -> None:
    """Nothing else than objects is ever written."""
    written: list[bytes] = []
    report = JsonReport(written.append, lambda: 1.0)
    report.ended(3)
    assert written == [b'{"event": "ended", "time": 1.0, "exit_code": 3}\n']
    assert report.format_lost(5) == b'{"event": "lost", "time": 1.0, "lines": 5}\n'

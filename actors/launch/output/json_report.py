"""The events of a launch as JSON, one object a line. docs/reference/json.md describes it."""

from __future__ import annotations

import json
import time
from typing import TYPE_CHECKING, Any

from actors.launch.planning import events

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.launch.planning.presence import Presence


class JsonReport:
    """A listener that writes every event. It has no state, and may be called in any thread.

    Args:
        write: Called with whole lines; it must not block.
        now: Returns the time in seconds since the epoch.
    """

    def __init__(self, write: Callable[[bytes], None], now: Callable[[], float] = time.time) -> None:
        self._write = write
        self._now = now

    def __call__(self, event: events.Event) -> None:
        """Write an event; each line of a process is an object of its own."""
        stamp = self._now()
        if isinstance(event, events.ProcessIO):
            self._write(_of_output(event, stamp))
            return
        name, facts = _facts(event)
        if name:
            self._write(_line(name, stamp, **facts))

    def ended(self, exit_code: int) -> None:
        """Write the last object, with the exit code."""
        self._write(_line("ended", self._now(), exit_code=exit_code))

    def format_lost(self, lines: int) -> bytes:
        """Return the object that reports how many lines were lost because they were not read fast enough."""
        return _line("lost", self._now(), lines=lines)


def _of_output(event: events.ProcessIO, stamp: float) -> bytes:
    # Processes may write many lines, whose objects differ only in the line, so the rest is made once.
    begin = _line("output", stamp, **_process(event), stream=event.stream.value).removesuffix(b"}\n").decode()
    lines = (json.dumps(line.decode(errors="replace")) for line in event.lines)
    return "".join([f'{begin}, "line": {line}}}\n' for line in lines]).encode()


def _facts(event: events.Event) -> tuple[str, dict[str, Any]]:
    facts: dict[str, Any] = _process(event) if isinstance(event, events.ProcessEvent) else {}
    name = ""
    match event:
        case events.ProcessStarted():
            name, facts["node"], facts["command"] = "started", event.process.node, list(event.cmd)
        case events.ProcessExited(outcome=outcome):
            name, facts["returncode"] = "exited", event.returncode
            facts |= {"signal": outcome.signal_name, "normal": outcome.normal, "reason": outcome.reason}
        case events.ProcessWaits():
            missing = [_presence(each) for each in event.missing]
            name, facts["missing"], facts["so_far_sec"] = "waiting", missing, event.so_far_sec
        case events.ProcessRestarts():
            name, facts["delay_sec"], facts["reason"] = "restarting", event.delay_sec, event.reason
        case events.StateTransition():
            name, facts["transition"] = "transition", event.transition
            facts |= {"start_state": event.start_state, "goal_state": event.goal_state}
        case events.Appeared():
            name, facts = "appeared", _presence(event.presence)
        case events.Message():
            name = "message"
            facts = {"level": event.level.value, "text": event.text, "about": event.about}
        case events.ShuttingDown():
            name, facts["reason"] = "stopping", event.reason
        case _:
            pass
    return name, facts


def _process(event: events.ProcessEvent) -> dict[str, Any]:
    return {"process": event.process_name, "pid": event.pid}


def _presence(presence: Presence) -> dict[str, Any]:
    return {"kind": presence.kind.value, "name": presence.name}


def _line(event: str, stamp: float, **facts: Any) -> bytes:
    return json.dumps({"event": event, "time": round(stamp, 6), **facts}).encode() + b"\n"

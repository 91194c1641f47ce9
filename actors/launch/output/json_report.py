"""What happens in a launch, one JSON object a line, for programs. docs/reference/json.md describes it."""

from __future__ import annotations

import json
import time
from typing import TYPE_CHECKING, Any

from actors.launch.planning.events import (
    Appeared,
    Message,
    ProcessEvent,
    ProcessExited,
    ProcessIO,
    ProcessRestarts,
    ProcessStarted,
    ProcessWaits,
    ShuttingDown,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.launch.planning.events import Event
    from actors.launch.planning.presence import Presence


class JsonReport:
    """A listener that writes every event. It keeps nothing, and may be called in any thread.

    Args:
        write: Takes whole lines; it must not wait.
        now: The time, in s since the epoch.
    """

    def __init__(self, write: Callable[[bytes], None], now: Callable[[], float] = time.time) -> None:
        self._write = write
        self._now = now

    def __call__(self, event: Event) -> None:
        """Write an event; one with several lines of a process as so many objects."""
        stamp = self._now()
        if isinstance(event, ProcessIO):
            self._write(_of_output(event, stamp))
            return
        name, facts = _facts(event)
        if name:
            self._write(_line(name, stamp, **facts))

    def ended(self, exit_code: int) -> None:
        """Write the last object: the launch is over."""
        self._write(_line("ended", self._now(), exit_code=exit_code))

    def of_lost(self, lines: int) -> bytes:
        """Return the object that says how many were lost, since they were not read fast enough."""
        return _line("lost", self._now(), lines=lines)


def _of_output(event: ProcessIO, stamp: float) -> bytes:
    # Floods come by here: all but the line itself is the same for all lines.
    begin = _line("output", stamp, **_process(event), stream=event.stream.value).removesuffix(b"}\n").decode()
    lines = (json.dumps(line.decode(errors="replace")) for line in event.lines)
    return "".join([f'{begin}, "line": {line}}}\n' for line in lines]).encode()


def _facts(event: Event) -> tuple[str, dict[str, Any]]:
    if isinstance(event, ProcessEvent):
        name, facts = _of_process(event)
        return name, _process(event) | facts
    if isinstance(event, Appeared):
        return "appeared", _presence(event.presence)
    if isinstance(event, Message):
        return "message", {"level": event.level.value, "text": event.text, "about": event.about}
    if isinstance(event, ShuttingDown):
        return "stopping", {"reason": event.reason}
    return "", {}


def _of_process(event: ProcessEvent) -> tuple[str, dict[str, Any]]:
    if isinstance(event, ProcessStarted):
        return "started", {"node": event.process.node, "command": list(event.cmd)}
    if isinstance(event, ProcessExited):
        outcome = event.outcome
        return "exited", {
            "returncode": event.returncode,
            "signal": outcome.signal_name,
            "normal": outcome.normal,
            "reason": outcome.reason,
        }
    if isinstance(event, ProcessWaits):
        missing = [_presence(each) for each in event.missing]
        return "waiting", {"missing": missing, "so_far_sec": event.so_far_sec}
    if isinstance(event, ProcessRestarts):
        return "restarting", {"delay_sec": event.delay_sec, "reason": event.reason}
    return "", {}


def _process(event: ProcessEvent) -> dict[str, Any]:
    return {"process": event.process_name, "pid": event.pid}


def _presence(presence: Presence) -> dict[str, Any]:
    return {"kind": presence.kind.value, "name": presence.name}


def _line(event: str, stamp: float, **facts: Any) -> bytes:
    return json.dumps({"event": event, "time": round(stamp, 6), **facts}).encode() + b"\n"

"""The messages of a launch about its events."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.errors import error_text
from actors.launch.planning.events import (
    Level,
    Message,
    ProcessExited,
    ProcessRestarts,
    ProcessStarted,
    ProcessWaits,
    ShuttingDown,
)

if TYPE_CHECKING:
    from actors.launch.planning.events import Event


def message_for(event: Event) -> Message | None:
    """Return the message about an event; None if there is none."""
    message: tuple[Level, str] | None
    match event:
        case Message():
            return event
        case ShuttingDown():
            return Message(Level.INFO, f"stopping: {event.reason}")
        case ProcessStarted(pid=None):
            message = Level.INFO, "node started in this process"
        case ProcessStarted():
            message = Level.INFO, f"process started with pid [{event.pid}]"
        case ProcessExited():
            message = _of_exit(event)
        case ProcessRestarts():
            message = Level.INFO, _of_restart(event)
        case ProcessWaits():
            message = _of_wait(event)
        case _:
            return None
    return message and Message(*message, event.process_name)


def _of_exit(event: ProcessExited) -> tuple[Level, str] | None:
    process, outcome = event.process, event.outcome
    if process.program is not None:
        text = "node has finished cleanly" if outcome.normal else f"node has died [{outcome.reason}]"
    elif event.pid is None:
        if outcome.normal:  # it was stopped before it ran
            return None
        text = f"process could not be run: {error_text(outcome.error) if outcome.error else outcome.reason}"
    elif outcome.normal:
        text = f"process has finished cleanly [pid {event.pid}]"
    else:
        text = f"process has died [pid {event.pid}, {outcome.reason}, cmd '{process.shown}']"
    return Level.INFO if outcome.normal else Level.ERROR, text


def _of_wait(event: ProcessWaits) -> tuple[Level, str]:
    missing = ", ".join(map(str, event.missing))
    if event.so_far_sec > 0:
        return Level.WARN, f"still waits for {missing} after {event.so_far_sec:.3g} s"
    return Level.INFO, f"waits for {missing}"


def _of_restart(event: ProcessRestarts) -> str:
    when = f" in {event.delay_sec:.3g} s" if event.delay_sec > 0 else ""
    why = "" if event.reason == "respawn" else f": {event.reason}"
    return f"process starts again{when}{why}"

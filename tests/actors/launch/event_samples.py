"""Events for tests of what shows them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actors.launch.planning.events import ProcessExited, ProcessIO, ProcessStarted, Stream
from actors.launch.planning.process_spec import ProcessSpec
from actors.processes.outcome import outcome_of_exit

if TYPE_CHECKING:
    from actors.node.node import Node


def spec(label: str = "talker-1", **fields: Any) -> ProcessSpec:
    """Return a process."""
    fields = {
        "name": label.rpartition("-")[0],
        "command": ("talker", "a b"),
        "shown": "talker 'a b'",
    } | fields
    return ProcessSpec(label=label, **fields)


def started(process: ProcessSpec, pid: int | None = 7) -> ProcessStarted:
    """It runs."""
    return ProcessStarted(process, pid)


def wrote(process: ProcessSpec, *lines: bytes, stream: Stream = Stream.OUTPUT) -> ProcessIO:
    """It has written lines."""
    return ProcessIO(process, 7, stream, lines)


def exited(process: ProcessSpec, code: int, pid: int | None = 7) -> ProcessExited:
    """It has ended."""
    return ProcessExited(process, pid, outcome_of_exit(code))


def program() -> Node:
    """What makes a node in this process; nobody calls it here."""
    raise AssertionError

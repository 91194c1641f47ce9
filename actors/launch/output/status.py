"""The status of a launch in one line: how many processes are in which state."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Final

from actors.launch.planning import events
from actors.launch.planning.process_spec import MAX_PROCESSES
from actors.logging.terminal_text import RESET

if TYPE_CHECKING:
    from collections.abc import Callable


class State(Enum):
    """The state of a process, as the line names it."""

    UP = "up"
    WAITING = "waiting"
    RESTARTING = "restarting"
    DEAD = "dead"
    FINISHED = "finished"


_COLORS: Final = {
    State.UP: "\x1b[32m",
    State.WAITING: "\x1b[33m",
    State.RESTARTING: "\x1b[33m",
    State.DEAD: "\x1b[31m",
}
_BETWEEN: Final = " · "

MAX_KNOWN: Final = 2 * MAX_PROCESSES
"""Limit of remembered processes: those that run, and the last ones that have ended."""


@dataclass(frozen=True)
class StatusLine:
    """A status line.

    Attributes:
        words: Its parts, each with an escape sequence for its colour, or an empty string.
    """

    words: tuple[tuple[str, str], ...]

    def __str__(self) -> str:
        return _BETWEEN.join(text for text, _ in self.words)

    def drawn(self, columns: int, *, color: bool) -> bytes:
        """Return the line, cut to the columns of the terminal. One column stays free for the cursor."""
        left = max(0, columns - 1)
        pieces: list[str] = []
        for number, (text, paint) in enumerate(self.words):
            between = _BETWEEN[:left] if number else ""
            left -= len(between)
            shown = text[:left]
            left -= len(shown)
            pieces += [between, f"{paint}{shown}{RESET}" if color and paint and shown else shown]
        return "".join(pieces).encode()


class Status:
    """A listener that counts processes by state.

    Args:
        show: Called with each new line; it must not block.
    """

    def __init__(self, show: Callable[[StatusLine], None]) -> None:
        self._show = show
        self._states: dict[str, State] = {}
        self._counts: Counter[State] = Counter()
        self._stopping = False

    def __call__(self, event: events.Event) -> None:
        """Count an event."""
        if isinstance(event, events.ShuttingDown):
            self._stopping = True
        elif isinstance(event, events.ProcessEvent):
            state, before = _state_of(event), self._states.get(event.process_name)
            if state is None or state is before:
                return
            if before is None and len(self._states) >= MAX_KNOWN:
                self._forget_one()
            self._states[event.process_name] = state
            self._counts[state] += 1
            if before is not None:
                self._counts[before] -= 1
        else:
            return
        self._show(self.line)

    def _forget_one(self) -> None:
        """Forget the name of the process that ended first; it stays counted."""
        # A launch whose functions start processes for ever must not grow.
        for name, state in self._states.items():
            if state in {State.DEAD, State.FINISHED}:
                del self._states[name]
                return

    @property
    def line(self) -> StatusLine:
        """The current line."""
        if self._stopping:
            return StatusLine(
                (
                    (f"stopping: {self._counts[State.UP]} left", ""),
                    ("Ctrl-C again kills", ""),
                )
            )
        words = [
            (f"{self._counts[state]} {state.value}", _COLORS.get(state, ""))
            for state in State
            if self._counts[state]
        ]
        return StatusLine((*words, ("Ctrl-C stops", "")))


def _state_of(event: events.ProcessEvent) -> State | None:
    if isinstance(event, events.ProcessExited):
        return State.FINISHED if event.outcome.normal else State.DEAD
    return _STATES.get(type(event))


_STATES: Final[dict[type[events.ProcessEvent], State]] = {
    events.ProcessStarted: State.UP,
    events.ProcessWaits: State.WAITING,
    events.ProcessRestarts: State.RESTARTING,
}

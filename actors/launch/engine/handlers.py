"""Handlers and reactions: which steps an event leads to, and the order in which they are carried out."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Final, NamedTuple, TypeAlias

from actors.launch.planning.events import Level, Message, ProcessIO
from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Sequence

    from actors.launch.engine.effects import Ask
    from actors.launch.planning.events import Event
    from actors.launch.planning.steps import React, Step

MAX_HANDLERS: Final = 10_000
"""Only a launch that makes them as it runs has so many."""
MAX_WAITING_EVENTS: Final = 10_000
"""How many events may wait for their reactions while a function runs; events beyond it are only counted."""
MAX_WAITING_BYTES: Final = 16 * 1024 * 1024
"""How many bytes of output these events may hold together, for the same reason."""
LINE_BYTES: Final = 64
"""What a line takes beside its text, about."""
ABANDONED: Final = "a function of the description has not returned; going on without it"


class Answer(NamedTuple):
    """What a function of the description has returned, as steps.

    Attributes:
        steps: What to do.
        mistake: The error in the description, if there is one instead.
    """

    steps: Sequence[Step] = ()
    mistake: str = ""


def ask(give: Callable[[], Sequence[Step]]) -> Answer:
    """Ask a function of a description for steps; this may block."""
    try:
        return Answer(give())
    except CallboardError as error:
        return Answer(mistake=str(error))


Reaction: TypeAlias = "Generator[Ask, Answer, None]"
"""Carries steps out, and stops at each function of the description until there is its answer."""


class ReactionQueue:
    """Carries out reactions one after the other, in the order of the events that they react to.

    Args:
        emit: Takes the functions to call.
        notify: Takes warnings.
    """

    def __init__(self, emit: Callable[[Ask], None], notify: Callable[[Event], None]) -> None:
        self._emit = emit
        self._notify = notify
        self._reactions: deque[tuple[Reaction, int]] = deque()
        """Those that wait, with the bytes of output that each holds."""
        self._waiting_bytes = 0
        self._asked: tuple[Ask, Reaction] | None = None
        self._abandoned = False
        self._unhandled = 0

    @property
    def waiting(self) -> bool:
        """Whether a function has been called and has not returned."""
        return self._asked is not None

    def add(self, reaction: Reaction) -> None:
        """Carry out a reaction after all earlier ones: at once, unless a function runs."""
        self._add(reaction, 0)

    def add_for_event(self, reaction: Reaction, event: Event) -> None:
        """Carry out the reaction to an event; if too much is waiting, only count it."""
        size = sum(len(line) + LINE_BYTES for line in event.lines) if isinstance(event, ProcessIO) else 0
        if len(self._reactions) < MAX_WAITING_EVENTS and self._waiting_bytes + size <= MAX_WAITING_BYTES:
            self._add(reaction, size)
        else:
            self._unhandled += 1

    def _add(self, reaction: Reaction, size: int) -> None:
        self._reactions.append((reaction, size))
        self._waiting_bytes += size
        if self._asked is None:
            self._resume(None)

    def answered(self, ask: Ask, answer: Answer) -> None:
        """Take the answer of a function; ignore it if nothing waits for it any more."""
        if self._asked is not None and self._asked[0] is ask:
            self._resume(answer)

    def abandon(self) -> None:
        """Go on without the function that still runs, and call no others: the launch ends."""
        self._abandoned = True
        if self._asked is not None:
            self._notify(Message(Level.WARN, ABANDONED))
            self._resume(Answer())

    def _resume(self, answer: Answer | None) -> None:
        """Go on with the reaction that waits for an answer, if one does, and then with the others."""
        reaction = None if self._asked is None else self._asked[1]
        self._asked = None
        while reaction is not None or self._reactions:
            if reaction is None:
                reaction, size = self._reactions.popleft()
                self._waiting_bytes -= size
            try:
                ask = next(reaction) if answer is None else reaction.send(answer)
            except StopIteration:
                reaction = answer = None
                continue
            if not self._abandoned:
                self._asked = ask, reaction
                self._emit(ask)
                return
            answer = Answer()
        if self._unhandled:
            text = f"{self._unhandled} events were not handled: functions of the description are too slow"
            self._unhandled = 0
            self._notify(Message(Level.WARN, text))


class Handlers:
    """All reactions that are registered."""

    def __init__(self) -> None:
        self._all: list[React] = []

    @property
    def full(self) -> bool:
        """Whether the limit is reached."""
        return len(self._all) >= MAX_HANDLERS

    def add(self, handler: React) -> None:
        """Register a handler."""
        self._all.append(handler)

    def matching(self, event: Event) -> Sequence[React]:
        """Return those that react to an event, in the order in which they came."""
        return [each for each in self._all if each.matches(event)]

    def remove(self, handler: React) -> None:
        """Unregister a handler."""
        if handler in self._all:
            self._all.remove(handler)

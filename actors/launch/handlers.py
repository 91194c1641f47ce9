"""Handlers: who reacts to what, and what functions of a description give when they are asked."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Final, NamedTuple

from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from actors.launch.events import Event
    from actors.launch.steps import React, Step

MAX_HANDLERS: Final = 10_000
"""Only a launch that makes them as it runs has so many."""


class Answer(NamedTuple):
    """What was given.

    Attributes:
        steps: What to do.
        mistake: What is wrong with the description instead.
    """

    steps: Sequence[Step] = ()
    mistake: str = ""


def ask(give: Callable[[], Sequence[Step]]) -> Answer:
    """Ask a function of a description for steps."""
    try:
        return Answer(give())
    except CallboardError as error:
        return Answer(mistake=str(error))


class Handlers:
    """All reactions that are registered."""

    def __init__(self) -> None:
        self._all: list[React] = []

    @property
    def full(self) -> bool:
        """Whether there is no room for more."""
        return len(self._all) >= MAX_HANDLERS

    def add(self, handler: React) -> None:
        """Let it react from now on."""
        self._all.append(handler)

    def answers(self, event: Event) -> Iterator[Answer]:
        """Yield what those say that react to an event, in the order in which they came."""
        for handler in [each for each in self._all if each.matches(event)]:
            yield self.answer(handler, event)

    def answer(self, handler: React, event: Event) -> Answer:
        """Return what one of them says; one that was for once, or has failed, says nothing any more."""
        given = ask(partial(handler.steps, event))
        if (handler.once or given.mistake) and handler in self._all:
            self._all.remove(handler)
        return given

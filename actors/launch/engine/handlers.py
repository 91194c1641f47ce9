"""Handlers: who reacts to what, and what functions of a description give when they are asked."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from actors.launch.planning.events import Event
    from actors.launch.planning.steps import React, Step

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
    """Ask a function of a description for steps; this may block."""
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

    def matching(self, event: Event) -> Sequence[React]:
        """Return those that react to an event, in the order in which they came."""
        return [each for each in self._all if each.matches(event)]

    def remove(self, handler: React) -> None:
        """Let it not react any more."""
        if handler in self._all:
            self._all.remove(handler)

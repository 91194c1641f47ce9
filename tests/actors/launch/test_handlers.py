"""Who reacts, and what is said then."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.launch.errors import LaunchError
from actors.launch.events import Event, ShuttingDown
from actors.launch.handlers import MAX_HANDLERS, Handlers
from actors.launch.steps import React, Say

if TYPE_CHECKING:
    from actors.launch.steps import Step

END = ShuttingDown("x")


def says(word: str, *, once: bool = False) -> React:
    """Return a reaction to everything."""
    return React(what="x", matches=lambda event: True, steps=lambda event: [Say(text=word)], once=once)


def answers(handlers: Handlers) -> list[str]:
    """Return what is said to an event: words, or mistakes."""
    return [
        answer.mistake or "".join(step.text for step in answer.steps if isinstance(step, Say))
        for answer in handlers.answers(END)
    ]


def test_all_that_match_answer_in_order() -> None:
    """One that is for once does so once; one that fails says what is wrong, and nothing any more."""

    def fail(event: Event) -> list[Step]:
        raise LaunchError("no")

    handlers = Handlers()
    handlers.add(says("a"))
    handlers.add(React(what="x", matches=lambda event: event != END, steps=fail))
    handlers.add(says("b", once=True))
    handlers.add(React(what="x", matches=lambda event: True, steps=fail))
    assert answers(handlers) == ["a", "b", "no"]
    assert answers(handlers) == ["a"]


def test_there_is_room_for_so_many() -> None:
    """Whoever adds asks before."""
    handlers = Handlers()
    for _ in range(MAX_HANDLERS):
        assert not handlers.full
        handlers.add(says("a"))
    assert handlers.full

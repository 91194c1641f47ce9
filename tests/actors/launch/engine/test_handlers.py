"""Who reacts, and what is said then."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.launch.engine.handlers import MAX_HANDLERS, FunctionResult, Handlers, call_function
from actors.launch.errors import LaunchError
from actors.launch.planning.events import Event, ShuttingDown
from actors.launch.planning.steps import AddHandler, LogText

if TYPE_CHECKING:
    from actors.launch.planning.steps import Step

END = ShuttingDown("x")


def says(word: str, *, once: bool = False) -> AddHandler:
    """Return a reaction to everything."""
    return AddHandler(
        what="x", matches=lambda event: True, steps=lambda event: [LogText(text=word)], once=once
    )


def test_all_that_match_are_found_in_order() -> None:
    """Until they are removed, which may be done twice."""
    handlers = Handlers()
    first, other, second = (
        says("a"),
        AddHandler(what="x", matches=lambda event: event != END, steps=fail),
        says("b"),
    )
    for each in (first, other, second):
        handlers.add(each)
    assert handlers.matching(END) == [first, second]
    handlers.remove(first)
    handlers.remove(first)
    assert handlers.matching(END) == [second]


def test_a_mistake_is_an_answer() -> None:
    """Functions of a description give steps, or what is wrong with it."""
    step = LogText(text="a")
    assert call_function(lambda: [step]) == FunctionResult([step])
    assert call_function(lambda: fail(END)) == FunctionResult(error="no")


def fail(event: Event) -> list[Step]:
    """Be a function that is wrong."""
    raise LaunchError("no")


def test_there_is_room_for_so_many() -> None:
    """Whoever adds asks before."""
    handlers = Handlers()
    for _ in range(MAX_HANDLERS):
        assert not handlers.full
        handlers.add(says("a"))
    assert handlers.full

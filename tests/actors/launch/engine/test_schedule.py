"""What is due when."""

from __future__ import annotations

from functools import partial

from actors.launch.engine.schedule import Schedule


def test_what_is_due_comes_in_order() -> None:
    """By its time, then by when it came; also what is added in the meantime."""
    schedule, done = Schedule(), list[str]()

    def note(word: str) -> None:
        schedule.add({"b": 2.0, "a": 1.0, "c": 2.0, "d": 3.0}[word], lambda _now: done.append(word))

    for word in "dbca":
        note(word)
    schedule.add(1.0, lambda now: schedule.add(now, lambda _now: done.append("e")))
    assert schedule.next_at == 1.0
    for act in schedule.due(2.0):
        act(2.0)
    assert done == ["a", "b", "c", "e"]
    assert schedule.next_at == 3.0


def test_what_a_shutdown_cancels_is_not_done() -> None:
    """Also when that happens in the middle; nothing holds a launch any more then."""
    schedule, done = Schedule(), list[str]()
    schedule.add(1.0, lambda _now: schedule.shut_down(), keep_alive=True)
    schedule.add(1.0, lambda _now: done.append("a"), keep_alive=True)
    schedule.add(5.0, lambda _now: done.append("b"))
    assert schedule.keeping_alive == 2
    for act in schedule.due(9.0):
        act(9.0)
    assert done == []
    assert (schedule.keeping_alive, schedule.next_at) == (0, None)


def test_some_callbacks_survive_a_shutdown() -> None:
    """In their order; by force none of them."""
    schedule, done = Schedule(), list[str]()

    def note(word: str, _now: float) -> None:
        done.append(word)

    for due, word in ((3.0, "b"), (1.0, "x"), (2.0, "a")):
        cancel = word == "x"
        schedule.add(due, partial(note, word), keep_alive=True, cancel_on_shutdown=cancel)
    schedule.shut_down()
    assert (schedule.keeping_alive, schedule.next_at) == (2, 2.0)
    for act in schedule.due(2.0):
        act(2.0)
    schedule.shut_down(force=True)
    assert (schedule.keeping_alive, schedule.next_at, done) == (0, None, ["a"])

"""What is due when."""

from __future__ import annotations

from actors.launch.agenda import Agenda


def test_what_is_due_comes_in_order() -> None:
    """By its time, then by when it came; also what is added in the meantime."""
    agenda, done = Agenda(), list[str]()

    def note(word: str) -> None:
        agenda.add({"b": 2.0, "a": 1.0, "c": 2.0, "d": 3.0}[word], lambda _now: done.append(word))

    for word in "dbca":
        note(word)
    agenda.add(1.0, lambda now: agenda.add(now, lambda _now: done.append("e")))
    assert agenda.next_at == 1.0
    for act in agenda.due(2.0):
        act(2.0)
    assert done == ["a", "b", "c", "e"]
    assert agenda.next_at == 3.0


def test_what_is_cleared_is_not_done() -> None:
    """Also when that happens in the middle; nothing holds a launch any more then."""
    agenda, done = Agenda(), list[str]()
    agenda.add(1.0, lambda _now: agenda.clear(), holds=True)
    agenda.add(1.0, lambda _now: done.append("a"), holds=True)
    agenda.add(5.0, lambda _now: done.append("b"))
    assert agenda.holding == 2
    for act in agenda.due(9.0):
        act(9.0)
    assert done == []
    assert (agenda.holding, agenda.next_at) == (0, None)

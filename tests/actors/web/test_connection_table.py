"""Which connection makes room."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from actors.web import limits
from actors.web.connection_table import ConnectionTable

if TYPE_CHECKING:
    from collections.abc import Iterable


@pytest.fixture
def table(monkeypatch: pytest.MonkeyPatch) -> ConnectionTable[str]:
    """A table for six connections, four of them of one holder, and two in the reserve."""
    monkeypatch.setattr(limits, "MAX_CONNECTIONS", 6)
    monkeypatch.setattr(limits, "MAX_HOLDER_CONNECTIONS", 4)
    monkeypatch.setattr(limits, "RESERVED_CONNECTIONS", 2)
    return ConnectionTable[str]()


def enter(table: ConnectionTable[str], names: Iterable[str], holder: str) -> list[str | None]:
    """Add connections; return which ones make room for them."""
    return [table.enter(name, holder) for name in names]


def test_an_address_with_too_many_loses_its_oldest(table: ConnectionTable[str]) -> None:
    """Case 72: others lose nothing."""
    assert enter(table, "xy", "other") == [None, None]
    assert enter(table, "abcdef", "one") == [None, None, None, None, "a", "b"]
    assert set(table.connections()) == set("xycdef")


def test_the_address_with_most_makes_room(table: ConnectionTable[str]) -> None:
    """Case 72: for an address that has fewer."""
    enter(table, "abcd", "one")
    enter(table, "xy", "two")
    assert enter(table, "pqr", "three") == ["a", "b", "c"]


def test_one_at_work_makes_no_room(table: ConnectionTable[str]) -> None:
    """Until the server waits for its client again; then it is the newest that waits."""
    enter(table, "abcd", "one")
    for each in "ab":
        table.work(each)
    assert enter(table, "e", "one") == ["c"]
    table.wait("a")
    assert enter(table, "fgh", "one") == ["d", "e", "a"]


def test_one_with_a_token_makes_room_last(table: ConnectionTable[str]) -> None:
    """Although it is older than those of strangers."""
    enter(table, "abcd", "one")
    for each in "ab":
        table.work(each)
        assert table.prove(each, None) is None
        table.wait(each)
    assert enter(table, "efgh", "one") == ["c", "d", "e", "f"]
    for each in "gh":
        table.work(each)
    assert enter(table, "i", "one") == ["a"]


def test_one_of_a_user_does_not_count_for_its_address(table: ConnectionTable[str]) -> None:
    """Strangers behind the same proxy have the limit for themselves, and the user has one of its own."""
    enter(table, "ab", "proxy")
    for each in "ab":
        table.work(each)
        assert table.prove(each, "zoe") is None
        table.wait(each)
    assert enter(table, "cdef", "proxy") == [None] * 4


@pytest.mark.parametrize("waits", [True, False])
def test_a_user_with_too_many_loses_one(table: ConnectionTable[str], *, waits: bool) -> None:
    """The oldest that waits, or the new one."""
    for each in "abcd":
        table.enter(each, "proxy")
        table.work(each)
        assert table.prove(each, "zoe") is None
        if waits:
            table.wait(each)
    table.enter("e", "proxy")
    table.work("e")
    lost = table.prove("e", "zoe")
    assert lost == ("a" if waits else "e")
    assert set(table.connections()) == set("abcde") - {lost}


def test_when_all_are_at_work_new_ones_are_in_the_reserve(table: ConnectionTable[str]) -> None:
    """Case 72: the newest of them, for probes."""
    for name, holder in zip("abcdef", "uvwxyz", strict=True):
        table.enter(name, holder)
        table.work(name)
    assert enter(table, "pqrs", "new") == [None, None, "p", "q"]
    assert [each for each in table.connections() if table.in_reserve(each)] == ["r", "s"]
    table.leave("a")
    table.leave("r")
    assert enter(table, "t", "new") == [None]
    assert not table.in_reserve("t")
    assert len(table) == 7


def test_what_has_left_is_forgotten(table: ConnectionTable[str]) -> None:
    """Also twice, and whatever happens to it afterwards."""
    enter(table, "abcd", "one")
    for each in "abcda":
        table.leave(each)
        table.work(each)
        table.wait(each)
        assert table.prove(each, "zoe") is None
    assert not len(table)
    assert enter(table, "abcd", "one") == [None] * 4

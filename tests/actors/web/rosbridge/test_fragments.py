"""Operations in parts."""

from __future__ import annotations

import pytest

from actors.web.rosbridge import fragments
from actors.web.rosbridge.fragments import MAX_TOTAL, TIMEOUT_SEC, Fragments, divided
from actors.web.rosbridge.operations import Fragment, OperationError


def _fragment(data: str, num: int, total: int, id_: str = "a") -> Fragment:
    return Fragment(id=id_, data=data, num=num, total=total)


def test_parts_are_put_together() -> None:
    """In any order, and between those of another operation."""
    received = Fragments()
    assert received.add(_fragment("c", 2, 3), 0) is None
    assert received.add(_fragment("x", 0, 2, "b"), 0) is None
    assert received.add(_fragment("a", 0, 3), 0) is None
    assert received.add(_fragment("b", 1, 3), 0) == "abc"
    assert received.add(_fragment("y", 1, 2, "b"), 0) == "xy"
    assert received.add(_fragment("whole", 0, 1), 0) == "whole"


@pytest.mark.parametrize(
    ("fragment", "text"),
    [
        (_fragment("", 0, 2), "has been sent before"),
        (_fragment("", 3, 3), "The total is 3, and 2 before"),
        (_fragment("", 2, 2), "is not below the total"),
        (_fragment("x" * fragments.MAX_BYTES, 1, 2), "characters"),
        (_fragment("", 0, MAX_TOTAL + 1, "b"), "fragments of one operation"),
    ],
)
def test_a_part_that_does_not_fit_ends_its_operation(fragment: Fragment, text: str) -> None:
    """Its id can be used again."""
    received = Fragments()
    received.add(_fragment("a", 0, 2), 0)
    with pytest.raises(OperationError, match=text):
        received.add(fragment, 0)
    assert received.add(_fragment("whole", 0, 1, str(fragment.id)), 0) == "whole"


def test_an_id_is_needed() -> None:
    """Parts of several operations could not be told apart."""
    with pytest.raises(OperationError, match="An id is needed"):
        Fragments().add(Fragment(data="", num=0, total=1), 0)


def test_incomplete_operations_are_few_and_expire() -> None:
    """Each is dropped some time after its newest part."""
    received = Fragments()
    for number in range(fragments.MAX_INCOMPLETE):
        received.add(_fragment("a", 0, 2, str(number)), 0)
    with pytest.raises(OperationError, match="incomplete already"):
        received.add(_fragment("a", 0, 2, "more"), TIMEOUT_SEC)
    assert received.add(_fragment("a", 0, 2, "more"), TIMEOUT_SEC + 1) is None
    assert received.add(_fragment("b", 1, 2, "more"), TIMEOUT_SEC + 1) == "ab"


def test_a_text_is_divided() -> None:
    """Into parts with a whole total; a size that would make too many of them is too small."""
    assert [*divided("abcde", 2)] == [(0, 3, "ab"), (1, 3, "cd"), (2, 3, "e")]
    assert [*divided("abcd", 2)] == [(0, 2, "ab"), (1, 2, "cd")]
    assert len([*divided("x" * (3 * MAX_TOTAL), 1)]) == MAX_TOTAL

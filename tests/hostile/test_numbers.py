"""Each numbered attack has a test."""

from __future__ import annotations

import re
from pathlib import Path

from tests.hostile.numbers import HIGHEST, find_tests, numbers_in


def test_each_case_has_a_test() -> None:
    """A docstring of a test, or an entry of `bytes/*.json`, names it."""
    assert find_tests().keys() >= set(range(1, HIGHEST + 1))


def test_the_table_has_each_case_once() -> None:
    """README.md says what each attack is, in order."""
    text = (Path(__file__).parent / "README.md").read_text(encoding="utf-8")
    assert [int(number) for number in re.findall(r"^\| (\d+) \|", text, re.MULTILINE)] == [
        *range(1, HIGHEST + 1)
    ]


def test_numbers_are_read_from_docstrings() -> None:
    """One, several, and ranges."""
    assert numbers_in("Hostile case 5: x") == {5}
    assert numbers_in("Cases 3 to 5, 8, and 9: x") == {3, 4, 5, 8, 9}
    assert numbers_in("In case 10,000 come") == {10}
    assert numbers_in("In any case: 7") == set()

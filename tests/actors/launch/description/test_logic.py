"""Texts that say yes or no."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from actors.launch.description.conditions import IfCondition
from actors.launch.description.logic import (
    AllSubstitution,
    AndSubstitution,
    AnySubstitution,
    BooleanSubstitution,
    EqualsSubstitution,
    IfElseSubstitution,
    NotEqualsSubstitution,
    NotSubstitution,
    OrSubstitution,
)
from actors.launch.description.substitutions import LaunchConfiguration, resolve
from actors.launch.errors import LaunchError
from tests.actors.launch.fake_library import scope

if TYPE_CHECKING:
    from actors.launch.description.logic import Truth, Value
    from actors.launch.description.substitutions import Substitution, Text

ROBOT = LaunchConfiguration("robot")
NONE = LaunchConfiguration("none")


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        (BooleanSubstitution(" TRUE"), "true"),
        (BooleanSubstitution(value=False), "false"),
        (NotSubstitution("0"), "true"),
        (NotSubstitution(NotSubstitution(["tr", "ue"])), "true"),
        (AndSubstitution("true", True), "true"),
        (AndSubstitution("1", "False"), "false"),
        (AndSubstitution(False, NONE), "false"),
        (OrSubstitution("0", "1"), "true"),
        (OrSubstitution("0", False), "false"),
        (OrSubstitution(left=True, right=NONE), "true"),
        (AllSubstitution("1", True, "true"), "true"),
        (AllSubstitution("1", "0", NONE), "false"),
        (AllSubstitution(), "true"),
        (AnySubstitution("0", False, "1", NONE), "true"),
        (AnySubstitution("0", "0"), "false"),
        (AnySubstitution(), "false"),
        (IfElseSubstitution(EqualsSubstitution(ROBOT, "r2"), "fast", NONE), "fast"),
        (IfElseSubstitution("0", if_value=NONE, else_value=["slow ", ROBOT]), "slow r2"),
        (IfElseSubstitution(True), ""),
    ],
)
def test_each_stands_for_a_word(text: Text, meant: str) -> None:
    """What is not needed for that is not looked at."""
    assert resolve(text, scope(launch_configurations={"robot": "r2"})) == meant


@pytest.mark.parametrize(
    ("left", "right", "same"),
    [
        ("a", "a", True),
        ("a", "A", False),
        (ROBOT, ["r", "2"], True),
        ("1", "true", True),
        (False, "0", True),
        ("false", "False", True),
        (True, "0", False),
        (1, "1.0", True),
        (0.1 + 0.2, "0.3", True),
        ("1e3", 1000, True),
        (2, 3, False),
        ("nan", "nan", False),
        ("", "0", False),
        ("", "", True),
    ],
)
def test_two_are_the_same_as_words_numbers_or_texts(left: Value, right: Value, *, same: bool) -> None:
    """Whichever both are; conditions understand the answer."""
    here = scope(launch_configurations={"robot": "r2"})
    assert IfCondition(EqualsSubstitution(left, right)).evaluate(here) is same
    assert IfCondition(EqualsSubstitution(right, left)).evaluate(here) is same
    assert IfCondition(NotEqualsSubstitution(left, right)).evaluate(here) is not same


@pytest.mark.parametrize(
    "text",
    [
        NotSubstitution("maybe"),
        AndSubstitution("1", "maybe"),
        OrSubstitution("maybe", "1"),
        AnySubstitution("0", "maybe"),
        IfElseSubstitution("maybe"),
    ],
)
def test_what_is_neither_yes_nor_no_is_an_error(text: Substitution) -> None:
    """As in a condition."""
    with pytest.raises(LaunchError, match="Expected true or false, got 'maybe'"):
        text.perform(scope())


@pytest.mark.parametrize(
    ("word", "opposite"),
    [("yes", "false"), ("Off", "true"), ("on", "false"), ("no", "true"), (" true", "false")],
)
def test_words_of_yaml_are_truth_values(word: str, opposite: str) -> None:
    """As in ROS 2; but they are not equal to true and false, and conditions refuse them."""
    assert NotSubstitution(word).perform(scope()) == opposite
    assert EqualsSubstitution("yes", "true").perform(scope()) == "false"


def test_substitutions_with_the_same_parts_are_the_same() -> None:
    """They are data."""
    values: tuple[Truth, ...] = ("1", ROBOT)
    assert AllSubstitution(*values) == AllSubstitution(*values)
    assert AnySubstitution(*values) != AnySubstitution("1")
    assert EqualsSubstitution("a", "b") != NotEqualsSubstitution("a", "b")

"""Conditions: which words mean yes and no."""

from __future__ import annotations

import pytest

from actors.launch.description.conditions import (
    IfCondition,
    LaunchConfigurationEquals,
    LaunchConfigurationNotEquals,
    UnlessCondition,
)
from actors.launch.description.substitutions import LaunchConfiguration
from actors.launch.errors import LaunchError
from tests.actors.launch.fake_library import scope


@pytest.mark.parametrize(
    ("word", "yes"),
    [("true", True), ("1", True), (" TRUE\n", True), ("false", False), ("0", False), ("False ", False)],
)
def test_words_mean_yes_or_no(word: str, *, yes: bool) -> None:
    """In any case, with space around; `unless` is the opposite. `evaluate` has had another name."""
    here = scope(launch_configurations={"c": word})
    assert IfCondition(LaunchConfiguration("c")).evaluate(here) is yes
    assert UnlessCondition([LaunchConfiguration("c")]).evaluate(here) is not yes
    assert IfCondition(LaunchConfiguration("c")).holds(here) is yes


@pytest.mark.parametrize("word", ["", "typo", "yes", "2"])
def test_other_words_are_errors(word: str) -> None:
    """Rather than no."""
    with pytest.raises(LaunchError, match=f"Expected true, 1, false or 0, got '{word}'"):
        IfCondition(word).evaluate(scope())


@pytest.mark.parametrize(
    ("name", "expected", "equal"),
    [("robot", "r2", True), ("robot", "r3", False), ("robot", None, False), ("none", None, True)],
)
def test_values_of_arguments_are_compared(name: str, expected: str | None, *, equal: bool) -> None:
    """As texts; None is what an argument has that has not been set. The look at it counts as use."""
    here = scope(launch_configurations={"robot": "r2"})
    assert LaunchConfigurationEquals(name, expected).evaluate(here) is equal
    assert LaunchConfigurationNotEquals(name, expected).evaluate(here) is not equal
    assert here.used == {name}

"""What texts stand for."""

from __future__ import annotations

from pathlib import PurePath
from typing import Any

import pytest

from actors.launch.description.substitutions import (
    EnvironmentVariable,
    LaunchConfiguration,
    LaunchContext,
    PathJoinSubstitution,
    TextSubstitution,
    ThisLaunchFile,
    ThisLaunchFileDir,
    resolve,
)
from actors.launch.errors import LaunchError
from tests.actors.launch.fake_library import scope


def here() -> LaunchContext:
    """One in which something is set."""
    return scope(
        launch_configurations={"robot": "r2"},
        environment={"HOME": "/home/me"},
        folder="/launch",
        file="/launch/f",
    )


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("plain", "plain"),
        (PurePath("/a/b"), "/a/b"),
        (TextSubstitution("x"), "x"),
        (TextSubstitution(text="x"), "x"),
        (LaunchConfiguration("robot"), "r2"),
        (LaunchConfiguration(["ro", "bot"]), "r2"),
        (LaunchConfiguration("none", default=["a", LaunchConfiguration("robot")]), "ar2"),
        (EnvironmentVariable("HOME"), "/home/me"),
        (EnvironmentVariable("NONE", default_value=""), ""),
        (EnvironmentVariable(name="HOME"), "/home/me"),
        (LaunchConfiguration(variable_name="robot"), "r2"),
        (ThisLaunchFileDir(), "/launch"),
        (ThisLaunchFile(), "/launch/f"),
        (PathJoinSubstitution([ThisLaunchFileDir(), "..", [LaunchConfiguration("robot"), ".yaml"]]), None),
        (["a", ["b", LaunchConfiguration("robot")], ()], "abr2"),
    ],
)
def test_each_stands_for_a_text(text: Any, meant: str | None) -> None:
    """A list is its pieces, one behind the other."""
    assert resolve(text, here()) == (meant if meant is not None else "/launch/../r2.yaml")


def endless() -> list[Any]:
    """A list that contains itself."""
    made: list[Any] = []
    made.append(made)
    return made


@pytest.mark.parametrize(
    ("text", "error"),
    [
        (LaunchConfiguration("none"), "Launch argument 'none' is used, but not declared"),
        (EnvironmentVariable("NONE"), "Environment variable 'NONE' is not set"),
        (3, "Expected a string or a substitution, not 3"),
        (["a", None], "Expected a string or a substitution, not None"),
        (endless(), "Expected a string"),
    ],
)
def test_what_stands_for_nothing_is_an_error(text: Any, error: str) -> None:
    """It names what is missing or wrong."""
    with pytest.raises(LaunchError, match=error):
        resolve(text, here())


def test_an_inner_scope_keeps_what_it_sets() -> None:
    """It begins as the outer one is, and looks at names are noted in both."""
    outer = here()
    inner = outer.inner()
    inner.launch_configurations["robot"] = "x"
    inner.environment["HOME"] = "/"
    assert resolve(LaunchConfiguration("robot"), inner) == "x"
    assert (outer.launch_configurations, outer.environment) == ({"robot": "r2"}, {"HOME": "/home/me"})
    assert outer.used == {"robot"}


def test_a_description_without_a_file_has_no_path() -> None:
    """It may have been made by a program."""
    with pytest.raises(LaunchError, match="ThisLaunchFile: this description comes from no file"):
        resolve(ThisLaunchFile(), scope())


def test_functions_are_called_with_what_ros_2_calls_a_context() -> None:
    """They resolve texts in it, either way round, and may set arguments."""
    context = here()
    context.launch_configurations["robot"] = "r3"
    assert LaunchConfiguration("robot").perform(context) == "r3"
    assert context.perform_substitution(["a", LaunchConfiguration("robot")]) == "ar3"

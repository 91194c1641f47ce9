"""Which arguments a launch takes, also by the files that it includes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actors.launch.description.actions import (
    DeclareLaunchArgument,
    GroupAction,
    IncludeLaunchDescription,
    PushNamespace,
    SetLaunchConfiguration,
    TimerAction,
)
from actors.launch.description.conditions import IfCondition
from actors.launch.description.description import LaunchDescription
from actors.launch.description.substitutions import LaunchConfiguration, LaunchContext
from actors.launch.planning.declarations import all_declared
from tests.actors.launch.fake_library import FakeLibrary

if TYPE_CHECKING:
    from collections.abc import Mapping

    from actors.launch.description.action import Action

A, B, C = (DeclareLaunchArgument(name, default_value=f"{name}.py") for name in "abc")


def names(*actions: Action, given: Mapping[str, str] | None = None, **files: LaunchDescription) -> list[str]:
    """Return the names of the arguments that can be given."""
    library = FakeLibrary(**files)
    scope = LaunchContext(library=library, folder="/files", launch_configurations=dict(given or {}))
    return [each.name for each in all_declared(actions, scope, library)]


def test_those_of_included_files_count() -> None:
    """However deep, whatever conditions say, and each once."""
    inner = LaunchDescription([C, A])
    middle = LaunchDescription([B, IncludeLaunchDescription("inner")])
    include = IncludeLaunchDescription("middle", condition=IfCondition("0"))
    later = TimerAction(period=1, actions=[GroupAction([include])])
    assert names(A, later, sub=inner, middle=middle, inner=inner) == ["a", "b", "c"]


def test_what_an_include_says_itself_cannot_be_given() -> None:
    """There; where another include of the file does not say it, it can."""
    file = LaunchDescription([A, B])
    first = IncludeLaunchDescription("f", launch_arguments={"a": "1"})
    assert names(first, f=file) == ["b"]
    assert names(first, IncludeLaunchDescription("f"), f=file) == ["b", "a"]


def test_a_path_may_depend_on_what_is_known() -> None:
    """Defaults, what is given, and what is set; a file whose path is not known is left out."""
    files: dict[str, Any] = {"a.py": LaunchDescription([B]), "x": LaunchDescription([C])}
    include = IncludeLaunchDescription(LaunchConfiguration("a"))
    assert names(A, include, **files) == ["a", "b"]
    assert names(A, include, given={"a": "x"}, **files) == ["a", "c"]
    assert names(SetLaunchConfiguration("a", "x"), include, **files) == ["c"]
    assert names(include, IncludeLaunchDescription("none"), PushNamespace("a b"), B) == ["b"]


def test_files_that_include_each_other_come_to_an_end() -> None:
    """Twice over, too."""
    again = [IncludeLaunchDescription("f"), IncludeLaunchDescription("g")]
    assert names(*again, f=LaunchDescription([A, *again]), g=LaunchDescription([B, *again])) == ["a", "b"]

"""What actions set, and where it holds."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from actors.launch.description.action import Setting
from actors.launch.description.actions import (
    AppendEnvironmentVariable,
    PushNamespace,
    PushRosNamespace,
    SetEnvironmentVariable,
    SetLaunchConfiguration,
    SetParameter,
    SetRemap,
    UnsetEnvironmentVariable,
)
from actors.launch.description.substitutions import LaunchConfiguration
from actors.launch.errors import LaunchError
from actors.launch.planning.settings import apply_setting
from tests.actors.launch.fake_library import scope

if TYPE_CHECKING:
    from actors.launch.description.substitutions import LaunchContext

ROBOT = LaunchConfiguration("robot")


def after(*settings: Setting) -> LaunchContext:
    """Return a scope in which something has been set."""
    here = scope(launch_configurations={"robot": "r2"}, environment={"PATH": "/bin", "EMPTY": ""})
    for each in settings:
        apply_setting(each, here)
    return here


@pytest.mark.parametrize(
    ("setting", "field", "value"),
    [
        (PushNamespace(["a_", ROBOT]), "namespace", "a_r2"),
        (PushRosNamespace(namespace="b"), "namespace", "b"),
        (SetLaunchConfiguration("x", [ROBOT, "x"]), "launch_configurations", {"robot": "r2", "x": "r2x"}),
        (SetLaunchConfiguration("robot", "r3"), "launch_configurations", {"robot": "r3"}),
        (
            SetEnvironmentVariable(ROBOT, "1"),
            "environment",
            {"PATH": "/bin", "EMPTY": "", "r2": "1"},
        ),
        (UnsetEnvironmentVariable("EMPTY"), "environment", {"PATH": "/bin"}),
        (UnsetEnvironmentVariable("NONE"), "environment", {"PATH": "/bin", "EMPTY": ""}),
        (SetParameter("speed", 1.5), "parameters", {"speed": "1.5"}),
        (SetParameter("a", {"b": ["x", "y"], "c": ROBOT}), "parameters", {"a.b": '[x, "y"]', "a.c": "r2"}),
        (SetRemap(src="a", dst=["/", ROBOT]), "remappings", [("a", "/r2")]),
    ],
)
def test_each_sets_its_part(setting: Setting, field: str, value: Any) -> None:
    """And resolves its texts when it does."""
    assert getattr(after(setting), field) == value


@pytest.mark.parametrize(
    ("setting", "value"),
    [
        (AppendEnvironmentVariable("PATH", ["/", ROBOT]), "/bin:/r2"),
        (AppendEnvironmentVariable("PATH", "/first", prepend=True), "/first:/bin"),
        (AppendEnvironmentVariable("PATH", "/first", prepend="true", separator=";"), "/first;/bin"),
        (AppendEnvironmentVariable("PATH", ""), "/bin"),
        (AppendEnvironmentVariable("EMPTY", "/only"), "/only"),
        (AppendEnvironmentVariable("NEW", "/only", prepend=True), "/only"),
    ],
)
def test_more_is_added_to_a_variable(setting: AppendEnvironmentVariable, value: str) -> None:
    """At either end; a separator with nothing beside it would mean the current folder."""
    assert after(setting).environment[str(setting.name)] == value


def test_the_last_value_of_a_parameter_counts_and_all_rules_stay() -> None:
    """Rules for names are tried in their order."""
    here = after(SetParameter("a", 1), SetParameter("a", 2), SetRemap("x", "y"), SetRemap("x", "z"))
    assert here.parameters == {"a": "2"}
    assert here.remappings == [("x", "y"), ("x", "z")]


def test_an_inner_scope_keeps_its_parameters_and_rules() -> None:
    """It begins with those around it."""
    outer = after(SetParameter("a", 1), SetRemap("x", "y"))
    inner = outer.inner()
    apply_setting(SetParameter("a", 2), inner)
    apply_setting(SetRemap("v", "w"), inner)
    assert (inner.parameters, inner.remappings) == ({"a": "2"}, [("x", "y"), ("v", "w")])
    assert (outer.parameters, outer.remappings) == ({"a": "1"}, [("x", "y")])


@pytest.mark.parametrize(
    ("setting", "error"),
    [
        (Setting(), "Setting is not an action that can be carried out"),
        (SetLaunchConfiguration("x", LaunchConfiguration("none")), "'none' is used, but not declared"),
        (SetParameter("a", None), "Parameter 'a': cannot be None"),  # type: ignore[arg-type]
        (AppendEnvironmentVariable("PATH", "x", prepend="maybe"), "Expected true or false"),
    ],
)
def test_what_cannot_be_set_is_an_error(setting: Setting, error: str) -> None:
    """In one line."""
    with pytest.raises(LaunchError, match=error):
        after(setting)

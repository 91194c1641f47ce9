"""Settings that save and restore: what is set after them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from actors.launch.description.actions import (
    DeclareLaunchArgument,
    EmitEvent,
    GroupAction,
    IncludeLaunchDescription,
    LogInfo,
    PopEnvironment,
    PopLaunchConfigurations,
    PushEnvironment,
    PushLaunchConfigurations,
    PushNamespace,
    RegisterEventHandler,
    ResetEnvironment,
    ResetLaunchConfigurations,
    SetEnvironmentVariable,
    SetLaunchConfiguration,
    SetParameter,
    SetParametersFromFile,
    SetRemap,
    UnsetLaunchConfiguration,
)
from actors.launch.description.description import LaunchDescription
from actors.launch.description.event_handlers import OnProcessExit, OnShutdown
from actors.launch.description.lifecycle import ChangeState, LifecycleNode, matches_node_name
from actors.launch.description.process_actions import ExecuteProcess, Node
from actors.launch.description.substitutions import (
    EnvironmentVariable,
    LaunchConfiguration,
    LocalSubstitution,
)
from actors.launch.errors import LaunchError
from actors.launch.planning.events import ProcessExited, ShuttingDown
from actors.launch.planning.plan import make_plan
from actors.launch.planning.steps import AddHandler, ChangeStates, LogText, Start, Step
from actors.processes.outcome import Outcome
from tests.actors.launch.fake_library import FakeLibrary

if TYPE_CHECKING:
    from collections.abc import Sequence

    from actors.launch.description.action import Action


def steps(*actions: Action) -> list[Step]:
    """Return what actions come to."""
    return make_plan(
        LaunchDescription(actions), FakeLibrary(), arguments={}, environment={"A": "0"}, folder="/files"
    )


def said(*actions: Action) -> list[str]:
    """Return what actions log."""
    return [step.text for step in steps(*actions) if isinstance(step, LogText)]


X = LogInfo(msg=LaunchConfiguration("x", default="none"))
A = LogInfo(msg=EnvironmentVariable("A", default_value="none"))


def test_arguments_are_saved_and_restored() -> None:
    """A pop restores what the last push has saved."""
    push, pop = PushLaunchConfigurations(), PopLaunchConfigurations()
    one, two = SetLaunchConfiguration("x", "1"), SetLaunchConfiguration("x", "2")
    assert said(one, push, two, X, pop, X) == ["2", "1"]
    assert said(one, UnsetLaunchConfiguration("x"), X) == ["none"]
    assert said(one, ResetLaunchConfigurations({"y": LaunchConfiguration("x")}), X) == ["none"]
    assert said(one, GroupAction([X], forwarding=False), X) == ["none", "1"]


def test_a_group_without_forwarding_begins_anew() -> None:
    """As in ROS 2: not only arguments are forgotten. One that is not scoped forgets nothing."""
    settings = (
        *(SetLaunchConfiguration("x", "1"), SetEnvironmentVariable("A", "1"), PushNamespace("ns")),
        *(SetParameter("p", 1), SetRemap("a", "b"), SetParametersFromFile("p.yaml")),
    )
    actions = (X, A, Node(script="a.py"))
    for scoped, texts in ((True, ["none", "0"]), (False, ["1", "1"])):
        found = steps(*settings, GroupAction(actions, forwarding=False, scoped=scoped), X, A)
        assert [step.text for step in found if isinstance(step, LogText)] == [*texts, "1", "1"]
        (start,) = [step for step in found if isinstance(step, Start)]
        # There are such arguments if there is a namespace, parameter, file or rule.
        assert ("--ros-args" in start.process.command) is not scoped


@pytest.mark.parametrize(
    ("before", "after"),
    [((), (ResetLaunchConfigurations(),)), ((PushLaunchConfigurations(),), (PopLaunchConfigurations(),))],
)
def test_settings_of_nodes_belong_to_the_arguments(before: Sequence[Action], after: Sequence[Action]) -> None:
    """As in ROS 2, what saves, restores or forgets arguments does it with them."""
    settings = PushNamespace("ns"), SetParameter("p", 1), SetRemap("a", "b"), SetParametersFromFile("p.yaml")
    first, last = steps(*before, *settings, Node(script="a.py"), *after, Node(script="a.py"))
    assert isinstance(first, Start)
    assert isinstance(last, Start)
    assert "--ros-args" in first.process.command
    assert "--ros-args" not in last.process.command


def test_environments_are_saved_and_restored() -> None:
    """A reset goes back to the beginning of the launch."""
    one = SetEnvironmentVariable("A", "1")
    assert said(PushEnvironment(), one, A, PopEnvironment(), A) == ["1", "0"]
    assert said(one, PushEnvironment(), ResetEnvironment(), A, PopEnvironment(), A) == ["0", "1"]


@pytest.mark.parametrize("pop", [PopEnvironment(), PopLaunchConfigurations()])
def test_only_what_was_pushed_in_a_group_is_popped(pop: Action) -> None:
    """An outer group's values are its own."""
    with pytest.raises(LaunchError, match="nothing has been pushed in this group or file"):
        steps(PushEnvironment(), PushLaunchConfigurations(), GroupAction([pop]))


def test_parameters_of_a_file_are_for_all_nodes() -> None:
    """They come before those of `SetParameter` and of the node."""
    (start,) = steps(GroupAction([SetParametersFromFile("p.yaml"), Node(script="a.py")]))
    assert isinstance(start, Start)
    assert start.process.command[-2:] == ("--params-file", "/files/p.yaml")


def test_a_program_needs_no_package() -> None:
    """It is found as the shell does; its label is its file's name, or the given one."""
    nodes = (Node(executable="/bin/talker", arguments=["x"]), Node(executable="a", name="n", exec_name="l"))
    first, second = steps(*nodes)
    assert isinstance(first, Start)
    assert isinstance(second, Start)
    assert (first.process.label, first.process.command) == ("talker-1", ("/bin/talker", "x"))
    assert (second.process.label, second.process.node) == ("l-2", "/n")


def test_a_text_about_an_event_is_known_when_it_happens() -> None:
    """Elsewhere it is a mistake, and so is a fact that the event does not have."""
    reason = LogInfo(msg=["ends: ", LocalSubstitution("event.reason")])
    (react,) = steps(RegisterEventHandler(OnShutdown(on_shutdown=reason)))
    assert isinstance(react, AddHandler)
    assert react.steps(ShuttingDown("enough")) == [LogText(text="ends: enough")]
    with pytest.raises(LaunchError, match=r"event\.reason' is known in event handlers only"):
        steps(reason)
    for wrong in ("event.none", "event.__class__", "other"):
        (react,) = steps(
            RegisterEventHandler(OnShutdown(on_shutdown=[reason, LogInfo(msg=LocalSubstitution(wrong))]))
        )
        assert isinstance(react, AddHandler)
        with pytest.raises(LaunchError, match="LocalSubstitution"):
            react.steps(ShuttingDown("enough"))


def test_a_function_chooses_the_process_of_a_handler() -> None:
    """It is called with the action."""
    one, two = ExecuteProcess(cmd=["one"]), ExecuteProcess(cmd=["two"])
    handler = OnProcessExit(target_action=lambda action: action is two, on_exit=[])
    first, second, react = steps(one, two, RegisterEventHandler(handler))
    assert isinstance(react, AddHandler)
    found = [
        react.matches(ProcessExited(each.process, 1, Outcome(normal=True, reason="")))
        for each in (first, second)
        if isinstance(each, Start)
    ]
    assert found == [False, True]
    assert react.what == "a process that <lambda>() chooses exits"


def test_a_lifecycle_node_is_chosen_by_its_name() -> None:
    """The name is seen from the namespace of the action."""
    node = LifecycleNode(script="a.py", name="n", namespace="ns")
    event = ChangeState(lifecycle_node_matcher=matches_node_name("ns/n"), transition_id=1)
    start, change = steps(DeclareLaunchArgument("x", default_value=""), node, EmitEvent(event=event))
    assert isinstance(start, Start)
    assert isinstance(change, ChangeStates)
    assert change.matches(start.process)


def test_an_include_can_set_what_applies_after_it() -> None:
    """Its arguments, too; by default it does not."""
    inner = LaunchDescription([SetLaunchConfiguration("x", "2")])
    for scoped, expected in ((True, ["1"]), (False, ["2"])):
        include = IncludeLaunchDescription("inner", scoped=scoped)
        found = make_plan(
            LaunchDescription([SetLaunchConfiguration("x", "1"), include, X]),
            FakeLibrary(inner=inner),
            arguments={},
            environment={},
            folder="/files",
        )
        assert [step.text for step in found if isinstance(step, LogText)] == expected

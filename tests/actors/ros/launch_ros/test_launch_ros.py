"""ROS 2's names for launches of nodes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from actors.launch.description.process_actions import OutputMode
from actors.launch.errors import LaunchError
from actors.launch.planning.plan import make_plan
from actors.launch.planning.settings import apply_setting
from actors.launch.planning.steps import AddHandler, ChangeStates, Start, Step
from actors.ros import launch_ros
from actors.ros.launch import LaunchDescription
from actors.ros.launch.actions import (
    EmitEvent,
    GroupAction,
    RegisterEventHandler,
    SetEnvironmentVariable,
)
from actors.ros.launch.conditions import IfCondition
from actors.ros.launch.substitutions import LaunchConfiguration
from actors.ros.launch_ros import actions, descriptions, event_handlers, substitutions
from actors.ros.launch_ros.events import lifecycle
from actors.ros.launch_xml.launch_description_sources import XMLLaunchDescriptionSource
from actors.ros.launch_yaml.launch_description_sources import YAMLLaunchDescriptionSource
from tests.actors.launch.fake_library import FakeLibrary, scope


def steps(*given: Any, **arguments: str) -> list[Step]:
    """Return what actions come to."""
    return make_plan(
        LaunchDescription(given), FakeLibrary(), arguments=arguments, environment={}, folder="/files"
    )


def process(*given: Any, **arguments: str) -> Any:
    """Return the process that actions come to."""
    (step,) = steps(*given, **arguments)
    assert isinstance(step, Start)
    return step.process


def test_a_node_is_labelled_by_its_program() -> None:
    """Its name in the graph is another thing; its output goes to the log."""
    found = process(actions.Node(package="p", executable="talker", name="n", parameters=None))
    assert (found.label, found.node, found.output) == ("talker-1", "/n", OutputMode.LOG)
    assert process(actions.Node(executable="/bin/talker", exec_name="t")).label == "t-1"
    assert process(actions.Node(executable="/bin/talker", name="n")).label == "talker-1"


def test_a_shell_reads_the_arguments_of_a_node() -> None:
    """Of them alone: the program and what callboard adds are quoted."""
    found = process(
        actions.Node(
            package="p q", executable="e", shell=True, arguments=["$HOME"], parameters=[{"a": "b c"}]
        )
    )
    assert found.command == ("/bin/sh", "-c", """'p q:e' $HOME --ros-args -p 'a:=b c'""")


def test_settings_are_for_all_nodes() -> None:
    """Simulated time, parameters, files of them, names and namespaces."""
    found = process(
        actions.SetUseSimTime(True),
        actions.SetParameter("speed", 1.5),
        actions.SetParametersFromFile("p.yaml"),
        actions.SetRemap("a", "b"),
        actions.PushRosNamespace("ns"),
        actions.SetROSLogDir("/log"),
        actions.Node(package="p", executable="e"),
    )
    text = " ".join(found.command)
    for each in ("use_sim_time:=true", "speed:=1.5", "--params-file /files/p.yaml", "a:=b", "__ns:=/ns"):
        assert each in text
    assert found.environment["ROS_LOG_DIR"] == "/log"


def test_parameters_are_described() -> None:
    """With types, also of lists."""
    value = descriptions.ParameterValue(["1", "2"], value_type=list[int])
    given = [
        descriptions.Parameter("a", "7", value_type=str, description="an example"),
        descriptions.Parameter(["b", "c"], [1.5]),
        {"d": value, "e": descriptions.ParameterValue(LaunchConfiguration("x"), value_type=list[str])},
    ]
    found = process(actions.Node(package="p", executable="e", parameters=given), x="[u, v]")
    assert [each for each in found.command if ":=" in each] == [
        'a:="7"',
        "bc:=[1.5]",
        "d:=[1, 2]",
        "e:=[u, v]",
    ]


def test_a_file_of_parameters_can_have_substitutions() -> None:
    """Then a node gets another file, in which they have their values."""
    assert _parameter_files("p.yaml", allow=True) == ["/temporary/p.yaml"]
    assert _parameter_files("p.yaml", allow=False) == ["/files/p.yaml"]


def _parameter_files(path: str, *, allow: bool) -> list[str]:
    entry = descriptions.ParameterFile(path, allow_substs=allow)
    command = process(actions.Node(package="p", executable="e", parameters=[entry])).command
    return [command[at + 1] for at, each in enumerate(command) if each == "--params-file"]


def test_a_lifecycle_node_changes_its_state() -> None:
    """It is chosen by its action or its name, and its transitions are events."""
    node = actions.LifecycleNode(package="p", executable="e", name="n", namespace="")
    change = lifecycle.ChangeState(
        lifecycle_node_matcher=launch_ros.events.matches_node_name("/n"), transition_id=1
    )
    handler = event_handlers.OnStateTransition(
        target_lifecycle_node=node, goal_state="inactive", entities=[EmitEvent(event=change)]
    )
    start, react, now = steps(node, RegisterEventHandler(handler), EmitEvent(event=change))
    assert isinstance(start, Start)
    assert isinstance(react, AddHandler)
    assert isinstance(now, ChangeStates)
    assert now.matches(start.process)


def test_packages_are_found_at_once() -> None:
    """`find` needs no launch."""
    share = substitutions.FindPackageShare("pytest").find("pytest")
    assert Path(share).is_dir()
    assert Path(substitutions.FindPackagePrefix("pytest").find("pytest")).is_dir()
    with pytest.raises(LaunchError, match="No installed package 'none'"):
        substitutions.FindPackageShare("none").find("none")


def test_a_parameter_of_all_nodes_is_a_text() -> None:
    """Or a default, or an error."""
    here = scope(parameters={"a": '"b"'})
    assert substitutions.Parameter("a").perform(here) == "b"
    assert substitutions.Parameter("c", default="d").perform(here) == "d"
    set_for_all = scope()
    for name, value in (
        ("quoted", 'say "hi"'),
        ("typed", 1.5),
        ("yaml", LaunchConfiguration("x", default="[")),
    ):
        apply_setting(actions.SetParameter(name, value), set_for_all)
    found = [substitutions.Parameter(name).perform(set_for_all) for name in ("quoted", "typed", "yaml")]
    assert found == ['say "hi"', "1.5", "["]
    with pytest.raises(LaunchError, match="No parameter 'c'"):
        substitutions.Parameter("c").perform(here)


@pytest.mark.parametrize("kind", [actions.ComposableNodeContainer, actions.LoadComposableNodes])
def test_components_are_absent(kind: Any) -> None:
    """With what to do instead; in a branch that is not taken they may be there, as in nav2's launch files."""
    node = descriptions.ComposableNode(package="p", plugin="x", name="n", parameters=[], remappings=[])
    load = kind(name="c", target_container="t", composable_node_descriptions=[node])
    assert steps(GroupAction([load], condition=IfCondition("False"))) == []
    assert steps(kind(name="c", condition=IfCondition("False"))) == []
    with pytest.raises(LaunchError, match=r"'c': callboard has no .*C\+\+ libraries; start each node with"):
        steps(load)


def test_sources_are_files() -> None:
    """Whatever their language."""
    for kind in (XMLLaunchDescriptionSource, YAMLLaunchDescriptionSource):
        assert kind(["a", ".launch"]).perform(scope()) == "a.launch"


class RosLibrary(FakeLibrary):
    """Runs programs with --ros."""

    @property
    def run_command(self) -> tuple[str, ...]:
        """As with --ros."""
        return ("callboard", "run", "--ros")


def domains(given: list[Any], library: FakeLibrary) -> list[str]:
    """Return CALLBOARD_DOMAIN of the processes of a plan whose own domain is 3."""
    environment = {"CALLBOARD_DOMAIN": "3", "ROS_DOMAIN_ID": "3"}
    plan = make_plan(
        LaunchDescription(given), library, arguments={}, environment=environment, folder="/files"
    )
    return [step.process.environment["CALLBOARD_DOMAIN"] for step in plan if isinstance(step, Start)]


def test_a_domain_that_a_file_sets_counts_for_its_processes() -> None:
    """In a launch with --ros, whose own domain all other processes have."""
    given = [
        actions.Node(package="p", executable="one"),
        actions.Node(package="p", executable="two", additional_env={"ROS_DOMAIN_ID": "7"}),
        SetEnvironmentVariable("ROS_DOMAIN_ID", "8"),
        actions.Node(package="p", executable="three"),
    ]
    assert domains(given, FakeLibrary()) == ["3", "3", "3"]
    assert domains(given, RosLibrary()) == ["3", "7", "8"]


@pytest.mark.parametrize(("text", "domain"), [("0x10", "16"), ("010", "8"), ("", "0")])
def test_a_domain_is_read_as_rcl_reads_it(text: str, domain: str) -> None:
    """As for a program outside of a launch."""
    node = actions.Node(package="p", executable="one", additional_env={"ROS_DOMAIN_ID": text})
    assert domains([node], RosLibrary()) == [domain]


def test_a_domain_that_is_none_is_an_error_of_the_file() -> None:
    """Which names the variable that the file sets."""
    node = actions.Node(package="p", executable="one", additional_env={"ROS_DOMAIN_ID": "robot"})
    with pytest.raises(LaunchError, match="ROS_DOMAIN_ID must be an integer from 0 to 232, not 'robot'"):
        domains([node], RosLibrary())

"""Arguments of nodes: the node's own command line parses them to the same values."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import pytest

from actors.arguments.ros_arguments import parse_ros_arguments
from actors.interfaces.yaml_writer import flow_text
from actors.launch.description.process_actions import Node, ParameterEntry, ParameterValue
from actors.launch.description.substitutions import LaunchConfiguration, LaunchContext
from actors.launch.errors import LaunchError
from actors.launch.planning.node_arguments import ros_arguments
from proto.errors import InvalidNamespaceError, InvalidNodeNameError
from tests.actors.launch.fake_library import FakeLibrary, scope

if TYPE_CHECKING:
    from pathlib import Path


@pytest.mark.parametrize(
    "value",
    [
        *(True, False, 3, -1, 1.0, 1e22, 1.5e-9, -math.inf, "text", "", "3", "true", "a: b", "é 'x' \"y\"\n"),
        *([1, 2], ["a", "1"], [1.0, 1e30], [True, False], "null", "\\"),
    ],
)
def test_parameters_come_as_they_are(value: Any) -> None:
    """Whatever YAML would make of their text."""
    said = ros_arguments(Node(parameters=[{"p": value}]), scope())
    got = parse_ros_arguments(said).parameters_for("/n")["p"]
    assert (got, type(got)) == (value, type(value))


def test_nan_comes_as_nan() -> None:
    """It is like nothing, so it needs a test of its own."""
    got = parse_ros_arguments(ros_arguments(Node(parameters=[{"p": math.nan}]), scope())).parameters_for("/n")
    assert math.isnan(float(str(got["p"])))


def test_the_text_of_a_substitution_is_read_as_yaml() -> None:
    """So that an argument of the launch can be a number."""
    here = scope(launch_configurations={"speed": "1.5", "none": ""})
    values: dict[str, ParameterEntry] = {
        "a": LaunchConfiguration("speed"),
        "b": [LaunchConfiguration("speed"), "x"],
        "c": LaunchConfiguration("none"),
        "d": {"e": 1},
    }
    got = parse_ros_arguments(ros_arguments(Node(parameters=[values]), here)).parameters_for("/n")
    assert got == {"a": 1.5, "b": "1.5x", "c": "", "d.e": 1}


@pytest.mark.parametrize(
    ("value", "got"),
    [
        (ParameterValue(LaunchConfiguration("speed")), 1.5),
        (ParameterValue(["<a b=", LaunchConfiguration("speed"), ">: x"], value_type=str), "<a b=1.5>: x"),
        (ParameterValue(LaunchConfiguration("speed"), value_type=str), "1.5"),
        (ParameterValue(3, value_type=str), "3"),
        (ParameterValue(3, value_type=float), 3.0),
        (ParameterValue(LaunchConfiguration("speed"), value_type=float), 1.5),
        (ParameterValue("7", value_type=int), 7),
        (ParameterValue("False", value_type=bool), False),
        (ParameterValue("yes", value_type=bool), True),
        (ParameterValue("OFF", value_type=bool), False),
        (ParameterValue(True, value_type=bool), True),
    ],
)
def test_a_parameters_type_can_be_said(value: ParameterValue, got: Any) -> None:
    """So that a description of a robot, which is XML, stays a text."""
    said = ros_arguments(Node(parameters=[{"p": value}]), scope(launch_configurations={"speed": "1.5"}))
    read = parse_ros_arguments(said).parameters_for("/n")["p"]
    assert (read, type(read)) == (got, type(got))


@pytest.mark.parametrize(
    ("value", "error"),
    [
        (ParameterValue("1.5", value_type=int), "Parameter 'p': expected a value of type int, not '1.5'"),
        (ParameterValue("x", value_type=bool), "Parameter 'p': expected a value of type bool, not 'x'"),
        (ParameterValue("x", value_type=dict), "Parameter 'p': value_type can be str, int, "),  # type: ignore[arg-type]
    ],
)
def test_a_value_of_another_type_is_an_error(value: ParameterValue, error: str) -> None:
    """Before anything has been started."""
    with pytest.raises(LaunchError, match=error):
        ros_arguments(Node(parameters=[{"p": value}]), scope())


def test_all_is_reported_in_order() -> None:
    """Name, namespace, parameters and files as they stand, remappings, the rest."""
    node = Node(
        name="n",
        namespace="sub",
        parameters=[{"a": 1}, "file.yaml", {"a": 2}],
        remappings=[("x", LaunchConfiguration("to"))],
        ros_arguments=["--log-level", "DEBUG"],
    )
    here = scope(launch_configurations={"to": "y"}, namespace="/robot")
    assert ros_arguments(node, here) == [
        *("--ros-args", "-r", "__node:=n", "-r", "__ns:=/robot/sub", "-p", "a:=1"),
        *("--params-file", "file.yaml", "-p", "a:=2", "-r", "x:=y", "--log-level", "DEBUG"),
    ]


@pytest.mark.parametrize(
    "name", ["1a", "a.1", "a-b", "a b", "é", "other:p", ".a", "a.", "a..b", "~", "__a", "a.__b", "a, b: c"]
)
def test_a_name_that_no_argument_can_have_is_in_a_file(name: str, tmp_path: Path) -> None:
    """ROS accepts it as a parameter, and refuses `-p 1a:=1`; with a colon that would be another node's."""
    library = FakeLibrary()
    values: dict[str, Any] = {name: ["x, y", "z"], "plain": 2, f"{name} c": 1.5}
    for here, parameters in (
        (LaunchContext(library=library), [values]),
        (
            LaunchContext(
                library=library, parameters={key: flow_text(value) for key, value in values.items()}
            ),
            [],
        ),
    ):
        found = ros_arguments(Node(parameters=parameters), here)
        assert found == ["--ros-args", "-p", "plain:=2", "--params-file", "/temporary/parameters.yaml"]
        file = tmp_path / "parameters.yaml"
        file.write_text(library.temporary_files.pop("parameters.yaml"), encoding="utf-8")
        assert parse_ros_arguments([*found[:-1], str(file)]).parameters_for("/n") == values


def test_what_is_set_for_all_comes_before_what_is_the_nodes_own() -> None:
    """So that its own parameters count; of the rules for one name the first counts, as in ROS 2."""
    node = Node(parameters=[{"a": 1}], remappings=[("x", "own")])
    here = scope(parameters={"a": "2", "b": "3"}, remappings=[("x", "all")])
    said = ros_arguments(node, here)
    assert said[1:] == ["-p", "a:=2", "-p", "b:=3", "-p", "a:=1", "-r", "x:=all", "-r", "x:=own"]
    assert parse_ros_arguments(said).parameters_for("/n") == {"a": 1, "b": 3}


def test_nothing_is_reported_when_there_is_nothing_to_say() -> None:
    """A plain script gets no --ros-args."""
    assert ros_arguments(Node(), scope()) == []
    assert ros_arguments(Node(), scope(namespace="a")) == ["--ros-args", "-r", "__ns:=/a"]


@pytest.mark.parametrize(
    ("node", "error"),
    [
        (Node(name="a b"), InvalidNodeNameError),
        (Node(namespace="a b"), InvalidNamespaceError),
        (Node(parameters=[{"p": None}]), LaunchError),  # type: ignore[dict-item]
        (Node(parameters=[{"": 1}]), LaunchError),
    ],
)
def test_what_cannot_be_is_found_before_the_start(node: Node, error: type[Exception]) -> None:
    """Names and values are checked here."""
    with pytest.raises(error):
        ros_arguments(node, scope())


def test_a_parameter_file_is_seen_from_the_launch_file() -> None:
    """As a script is; one that is not there is an error before anything starts."""
    here = scope(folder="/files")
    assert ros_arguments(Node(parameters=["p.yaml", "/etc/p.yaml"]), here) == [
        *("--ros-args", "--params-file", "/files/p.yaml", "--params-file", "/etc/p.yaml"),
    ]
    with pytest.raises(LaunchError, match=r"No parameter file '/files/missing\.yaml'"):
        ros_arguments(Node(parameters=["missing.yaml"]), here)

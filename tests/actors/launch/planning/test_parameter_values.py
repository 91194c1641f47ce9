"""Values of parameters in launch files: what ROS 2's launch makes of them.

The values are those that launch, launch_ros and the nodes' own parser gave, unless a comment says otherwise.
"""

from __future__ import annotations

import math
from typing import Any

import pytest

from actors.arguments.ros_arguments import parse_ros_arguments
from actors.launch.description.process_actions import Node, ParameterValue
from actors.launch.description.substitutions import LaunchConfiguration
from actors.launch.documents.reading import read_document
from actors.launch.errors import LaunchError
from actors.launch.planning.node_arguments import ros_arguments
from actors.launch.planning.parameter_values import parameter_value, value_from_text
from tests.actors.launch.fake_library import scope

VAR = LaunchConfiguration("x")


@pytest.mark.parametrize(
    ("text", "value"),
    [
        *(("1", 1), ("1e3", 1000.0), ("1e-3", 0.001), ("1_000", 1000), ("0b101", 5), ("0o17", "0o17")),
        *(("010", 8), ("08", 8.0), ("y", True), ("n", False), ("on", True), ("nan", math.nan)),
        *((".inf", math.inf), ("-.5", -0.5), ("99999999999999999999", 1e20), ("'1'", "1"), ("!!str 1", "1")),
        *(("[a, b]", ["a", "b"]), ("[y, n]", [True, False]), ("['1', '2']", ["1", "2"]), ("- 1", [1])),
        *(("[1e3, 1e4]", [1000.0, 10000.0]), ("x #c", "x"), ("", ""), ("[1", "[1"), ("*a", "*a")),
        # ROS 2: 750, an error, an error, an error, True, None.
        *(
            ("12:30", "12:30"),
            ("2020-01-01", "2020-01-01"),
            ("null", "null"),
            ("~", "~"),
            ("'y'", "y"),
            ("[]", []),
        ),
    ],
)
def test_texts(text: str, value: Any) -> None:
    """What attributes in XML and substitutions are: YAML 1.1's values, and strings of it by rcl's rules."""
    assert repr(value_from_text(text)) == repr(value)
    assert repr(parameter_value(VAR, scope(launch_configurations={"x": text}))) == repr(value)


@pytest.mark.parametrize(
    "text", ["[1, 2.0]", "[0, 0.5, 1]", "[1, a]", "[[1], [2]]", "[{a: 1}]", "{a: 1}", "a: b", "#", " ", "-"]
)
def test_texts_that_are_no_values(text: str) -> None:
    """What ROS 2 refuses is an error, and no string."""
    with pytest.raises(
        LaunchError, match=r"of one type, not|no value of a parameter; a string needs the type str"
    ):
        value_from_text(text)


@pytest.mark.parametrize(
    ("value", "found"),
    [
        ([0, 0.5, 1], [0.0, 0.5, 1.0]),
        ((1, 2), [1, 2]),
        (["1", "2"], ["1", "2"]),
        ([math.nan, 1], [math.nan, 1.0]),
        ([["1"], ["2"]], [1, 2]),
        ([VAR, VAR], 11),
        ([[VAR], 2], [1, 2]),
        ([], []),  # ROS 2: an error
        (["y", "n"], ["y", "n"]),  # ROS 2: [True, False]
        ("1e3", "1e3"),  # ROS 2: 1000.0
        (b"ab", b"ab"),  # ROS 2: the string "YWI=\n"
        (ParameterValue("1"), "1"),
        (ParameterValue("[1, 2]", value_type=list[str]), ["1", "2"]),  # ROS 2: an error
        (ParameterValue("[010, 0x10, 0b1, 1_0]", value_type=list[int]), [8, 16, 1, 10]),
        (ParameterValue("[.inf, 1_0.5, 1]", value_type=list[float]), [math.inf, 10.5, 1.0]),
        (ParameterValue(VAR, value_type=list[int]), None),
        (ParameterValue("y", value_type=str), "y"),  # ROS 2: True
    ],
)
def test_values_of_python(value: Any, found: Any) -> None:
    """Strings stay strings, integers beside doubles become doubles; pieces in a list are one text."""
    here = scope(launch_configurations={"x": "1"})
    if found is None:
        with pytest.raises(LaunchError, match="'1' is no list in YAML"):
            parameter_value(value, here)
        return
    assert repr(parameter_value(value, here)) == repr(found)


@pytest.mark.parametrize(
    "value", [[1, "a"], [True, 1], [1, True], [0.5, [VAR]], ["a", [VAR]], [[1, 2], [3]], [None], None]
)
def test_values_that_no_parameter_has(value: Any) -> None:
    """The launch refuses them, with the name of the parameter."""
    with pytest.raises(LaunchError, match="Parameter 'p': "):
        ros_arguments(Node(parameters=[{"p": value}]), scope(launch_configurations={"x": "1"}))


@pytest.mark.parametrize(
    ("value", "found"),
    [
        *(("1e-3", 0.001), ("08", 8.0), ("y", True), ("nan", math.nan), ("12:30", "12:30"), ("text", "text")),
        *(("'y'", "y"), ("'1'", "1"), ("[y, 'n', a]", None), ("[a, y]", None), ("[1e3, 2.0]", [1000.0, 2.0])),
        *(("[0, 0.5]", [0.0, 0.5]), ("$(var x)", 1), ("'[$(var x), 2]'", [1, 2]), ("a$(var x)", "a1")),
    ],
)
def test_values_in_yaml(value: str, found: Any) -> None:
    """In both forms; what has no quotes is read as a node of ROS 2 reads it."""
    for form in (f"parameters: {{p: {value}}}", f"param: [{{name: p, value: {value}}}]"):
        text = f"launch: [{{node: {{script: a.py, {form}}}}}]"
        (node,) = read_document("/files/a.yaml", text.encode()).actions
        assert isinstance(node, Node)
        here = scope(launch_configurations={"x": "1"})
        if found is None:
            with pytest.raises(LaunchError, match="of one type"):
                ros_arguments(node, here)
        else:
            got = parse_ros_arguments(ros_arguments(node, here)).parameters_for("/n")["p"]
            assert repr(got) == repr(found)


@pytest.mark.parametrize(
    ("kind", "value", "found"),
    [
        ("float", "1", 1.0),
        ("int", "1_000", 1000),
        ("str", "y", "y"),
        ("list_of_float", "[1, 2]", [1.0, 2.0]),
        ("list_of_str", "[on, 1]", ["on", "1"]),
    ],
)
def test_types_in_xml(kind: str, value: str, found: Any) -> None:
    """A type, or that of a list's elements, as ROS 2 names them."""
    text = f"<launch><node pkg='p' exec='e'><param name='p' value='{value}' type='{kind}'/></node></launch>"
    (node,) = read_document("/files/a.xml", text.encode()).actions
    assert isinstance(node, Node)
    got = parse_ros_arguments(ros_arguments(node, scope())).parameters_for("/n")["p"]
    assert repr(got) == repr(found)

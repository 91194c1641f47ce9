"""What callboard writes is read equal by ROS 2, and texts are the values that ROS 2's tools make of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from actors.interfaces.yaml_writer import flow_text
from actors.launch.description.conditions import parse_bool
from actors.launch.errors import LaunchError
from actors.launch.planning.parameter_values import value_from_text
from actors.parameters.dumping import parameter_file_text
from actors.parameters.types import Parameter, parameter_value_from_string
from tests.parameter_values import WORDS, parameters, values
from tests.real_ros.differences import agree

if TYPE_CHECKING:
    from tests.real_ros.sides import Side

REFUSED = {"refused": "by both"}

few = settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@few
@given(given=parameters)
def test_a_written_file_is_read_equal_by_rcl(given: dict[str, Any], real: Side) -> None:
    """Any names and values, as `param dump` and launch files write them."""
    text = parameter_file_text("/n", [Parameter(name, value=value) for name, value in given.items()])
    agree("written file", text, real=real.call("written_parameters.of_file", text), callboard=given)


@few
@given(given=st.lists(values, min_size=1, max_size=20))
def test_written_arguments_are_read_equal_by_rcl(given: list[Any], real: Side) -> None:
    """Any values, as launch gives them to a node."""
    written = [flow_text(value) for value in given]
    agree("written -p", str(written), real=real.call("written_parameters.of_rules", written), callboard=given)


def launched(text: str) -> object:
    """Return callboard's value of a text in a launch file."""
    try:
        return value_from_text(text)
    except LaunchError:
        return REFUSED


LAUNCH_TEXTS = (
    *(each for each in WORDS if each.isprintable() and each not in {"`", "999999999999999999999999999999"}),
    *(
        "[a, b]",
        "[1, 2]",
        "[0, 0.5, 1]",
        "[1, a]",
        "[true, off]",
        "['1', '2']",
        "[1e3, 1e4]",
        "[y, n]",
        "[a, y]",
    ),
    *(
        "[]",
        "[[1], [2]]",
        "[{a: 1}]",
        "{a: 1}",
        "[1, ",
        "'1'",
        '"on"',
        "'y'",
        "'1e3'",
        "!!int 1",
        "text # no",
    ),
    *(
        "99999999999999999999",
        "-9223372036854775809",
        "1_000_000_000_000_000_000_000",
        "1.5e+400",
        "0x_",
        "1:30.5",
    ),
)


def test_texts_in_launch_files(real: Side) -> None:
    """What PyYAML, launch_ros and rcl together make of a text."""
    answers = real.call("written_parameters.of_launch", LAUNCH_TEXTS)
    for text, truth in zip(LAUNCH_TEXTS, answers, strict=True):
        agree(
            "launch value", text, real=REFUSED if isinstance(truth, dict) else truth, callboard=launched(text)
        )


LAUNCH_BOOLS = (
    *(
        case(word)
        for word in ("true", "yes", "on", "false", "no", "off")
        for case in (str, str.title, str.upper)
    ),
    *("1", "0", " true ", "tRue", "oN", "y", "n", "2", "1.0", "null", "maybe", "'true'", "[true]", ""),
)


def test_truth_values_in_launch_files(real: Side) -> None:
    """Of options, and of parameters with type="bool"."""
    for text, truth in zip(
        LAUNCH_BOOLS, real.call("written_parameters.of_launch_bool", LAUNCH_BOOLS), strict=True
    ):
        value = parse_bool(text)
        agree(
            "launch bool",
            text,
            real=REFUSED if isinstance(truth, dict) else truth,
            callboard=REFUSED if value is None else value,
        )


def test_texts_of_param_set(real: Side) -> None:
    """What rclpy makes of the text that `ros2 param set` has."""
    answers = real.call("written_parameters.of_param_set", LAUNCH_TEXTS)
    for text, truth in zip(LAUNCH_TEXTS, answers, strict=True):
        agree(
            "param set",
            text,
            real=REFUSED if isinstance(truth, dict) else truth,
            callboard=parameter_value_from_string(text),
        )


@settings(few, max_examples=100)
@given(text=st.text("0179.eExX+-_ynaif", min_size=1, max_size=8))
def test_words_and_numbers(text: str, real: Side) -> None:
    """Whatever looks like a number, in launch files and of `param set`."""
    (truth,) = real.call("written_parameters.of_launch", [text])
    agree("launch value", text, real=REFUSED if isinstance(truth, dict) else truth, callboard=launched(text))
    (truth,) = real.call("written_parameters.of_param_set", [text])
    value = parameter_value_from_string(text)
    # Of the listed kinds `1e3` and `-.5`.
    assume(not (isinstance(truth, str) and isinstance(value, float)))
    agree("param set", text, real=REFUSED if isinstance(truth, dict) else truth, callboard=value)

"""ROS arguments: which flags there are, where the section ends, and what a wrong one says."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from actors.arguments.remapping import RemapRule
from actors.arguments.ros_arguments import InvalidRosArgumentError, RosArguments, parse_ros_arguments
from actors.logging.severity import LoggingSeverity
from proto.errors import CallboardError

if TYPE_CHECKING:
    from pathlib import Path


def ros(*arguments: str) -> RosArguments:
    return parse_ros_arguments(["--ros-args", *arguments])


def test_nothing_for_ros() -> None:
    """Without --ros-args everything is the program's."""
    assert parse_ros_arguments([]) == RosArguments()
    assert parse_ros_arguments(["prog", "-r", "a:=b", "--", "x"]).remaining == (
        "prog",
        "-r",
        "a:=b",
        "--",
        "x",
    )


def test_all_flags(tmp_path: Path) -> None:
    """Every flag of ROS 2 is recognised, long and short."""
    path = tmp_path / "p.yaml"
    path.write_text("/**: {ros__parameters: {c: 3}}")
    parsed = ros(
        *("-r", "a:=b", "--remap", "c:=d", "-p", "a:=1", "--param", "b:=2", "--params-file", str(path)),
        *(
            "--log-level",
            "warn",
            "--log-level",
            "talker:=DEBUG",
            "--log-config-file",
            "f",
            "--log-file-name",
            "g",
        ),
        *("-e", "/enclave", "--disable-rosout-logs", "--disable-stdout-logs", "--disable-external-lib-logs"),
    )
    assert parsed.remap_rules == (RemapRule.parse("a:=b"), RemapRule.parse("c:=d"))
    assert parsed.parameters_for("/any") == {"a": 1, "b": 2, "c": 3}
    assert parsed.log_level is LoggingSeverity.WARN
    assert parsed.logger_levels == (("talker", LoggingSeverity.DEBUG),)
    assert (parsed.log_config_file, parsed.log_file_name, parsed.enclave) == ("f", "g", "/enclave")
    assert (parsed.rosout_logs, parsed.stdout_logs, parsed.external_lib_logs) == (False, False, False)
    assert ros("--enclave", "/e").enclave == "/e"
    assert ros("--disable-stdout-logs", "--enable-stdout-logs").stdout_logs
    assert ros("--enable-rosout-logs", "--enable-external-lib-logs") == RosArguments()


@pytest.mark.parametrize(
    "unknown",
    ["foo:=bar", "--custom", "__node:=n", "file.yaml", "--log", "stdout-logs", "--disable-x-logs", "-x"],
)
def test_unknown_arguments(unknown: str) -> None:
    """What no flag stands before is an error that lists it and says what a right one looks like."""
    with pytest.raises(InvalidRosArgumentError, match="Found unknown ROS arguments") as caught:
        ros("-r", "a:=b", unknown)
    assert f"Failed to parse ROS arguments: '{unknown}'" in str(caught.value)
    assert f"arguments [{unknown!r}]" in str(caught.value)
    assert "needs -r before it" in str(caught.value)


@pytest.mark.parametrize("word", ["UNSET", "DEBUG", "INFO", "WARN", "ERROR", "FATAL", "debug", "Info"])
def test_log_levels(word: str) -> None:
    """Levels are read in any case."""
    assert ros("--log-level", word).log_level is LoggingSeverity[word.upper()]


@pytest.mark.parametrize(
    "arguments",
    [
        *(("--log-level", "foo"), ("--log-level",), ("--log-level", ":=DEBUG"), ("--log-level", "a:=loud")),
        *(("-r",), ("--remap",), ("-r", ":="), ("-r", "foo:="), ("-r", "__ns:=foo"), ("-r", "f oo:=/bar")),
        *(("-p",), ("-p", ":="), ("-p", "foo:="), ("-p", "1:="), ("-p", "__node:="), ("--params-file",)),
        *(("--params-file", "/nonexistent.yaml"), ("-e",), ("--log-config-file",), ("--log-file-name",)),
    ],
)
def test_bad_arguments(arguments: tuple[str, ...]) -> None:
    """The error says that ROS arguments failed to parse and quotes the offending text."""
    with pytest.raises(InvalidRosArgumentError, match="Failed to parse ROS arguments") as caught:
        ros(*arguments)
    assert " ".join(arguments) in str(caught.value)
    assert isinstance(caught.value, ValueError)
    assert isinstance(caught.value, CallboardError)


def test_error_text() -> None:
    """A wrong rule shows the rule, the reason and what would be right."""
    with pytest.raises(InvalidRosArgumentError) as caught:
        ros("-r", "foo\x1b:bar")
    assert str(caught.value).startswith(
        r"Failed to parse ROS arguments: '-r foo\x1b:bar': expected from:=to, such as chatter:=news"
    )
    with pytest.raises(InvalidRosArgumentError) as caught:
        ros("-r", "f oo:=/bar")
    assert str(caught.value).splitlines()[-2:] == ["  'f oo'", "    ^"]


def test_end_of_the_section() -> None:
    """The first -- closes the section, a second one belongs to the program; sections may follow."""
    parsed = parse_ros_arguments(
        ["prog", "-v", "--ros-args", "-r", "a:=b", "--", "-x", "--", "y", "--ros-args", "-p", "c:=1"]
    )
    assert parsed.remaining == ("prog", "-v", "-x", "--", "y")
    assert len(parsed.remap_rules) == 1
    assert parsed.parameters_for("/n") == {"c": 1}
    assert ros("--ros-args", "-r", "a:=b").remaining == ()
    assert ros() == ros("--") == RosArguments()


def test_order_of_parameters(tmp_path: Path) -> None:
    """A file given after a -p wins over it, and one given before does not."""
    path = tmp_path / "p.yaml"
    path.write_text("/ns/node: {ros__parameters: {fizz: file}}")
    file = ("--params-file", str(path))
    assert ros("-p", "fizz:=inline", *file).parameters_for("/ns/node") == {"fizz": "file"}
    assert ros(*file, "-p", "fizz:=inline").parameters_for("/ns/node") == {"fizz": "inline"}
    assert ros("-p", "node:fizz:=1", "-p", "other:fizz:=2").parameters_for("/ns/node") == {"fizz": 1}

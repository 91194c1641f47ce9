"""`callboard launch` as far as it starts nothing: what it says of a file, and of mistakes."""

from __future__ import annotations

import json
import sys
import textwrap
from typing import TYPE_CHECKING, NoReturn

import pytest

from actors.cli.main import main
from actors.launch.errors import LaunchError
from actors.launch.planning.process_spec import STOP_TIMEOUT_SEC
from tests.actors.site_packages import Site

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

FILE = """
    from actors.launch import DeclareLaunchArgument, ExecuteProcess, GroupAction, LaunchConfiguration
    from actors.launch import LaunchDescription, LogInfo, Shutdown, TimerAction

    def generate_launch_description():
        return LaunchDescription([
            DeclareLaunchArgument("speed", default_value="1.5", description="how fast, in m/s"),
            DeclareLaunchArgument("robot", choices=["a", "b"]),
            GroupAction([
                ExecuteProcess(
                    cmd=["echo", "x y", LaunchConfiguration("speed")], additional_env={"ROBOT": "r2"}
                ),
            ]),
            LogInfo(msg="hello"),
            TimerAction(period=2, actions=[Shutdown(reason="enough")]),
        ])
"""


@pytest.fixture
def file(tmp_path: Path) -> str:
    """A launch file."""
    path = tmp_path / "a.launch.py"
    path.write_text(textwrap.dedent(FILE))
    return str(path)


def test_arguments_are_shown(file: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Each with its default, its choices and what it is for, also if a required one is missing."""
    assert main(["launch", file, "--show-args"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "Arguments, as name:=value:",
        "  speed (default: 1.5)",
        "      how fast, in m/s",
        "  robot (required; one of: a, b)",
    ]


@pytest.mark.parametrize(("options", "expected"), [((), STOP_TIMEOUT_SEC), (("--stop-timeout", "7"), 7.0)])
def test_the_time_for_stopping_is_the_launchs_own_unless_given(
    file: str, monkeypatch: pytest.MonkeyPatch, options: tuple[str, ...], expected: float
) -> None:
    """The option's default stands in its help only, and is the constant."""
    made: list[float] = []

    def launch(*args: object, stop_timeout_sec: float, **given: object) -> NoReturn:
        made.append(stop_timeout_sec)
        raise LaunchError("enough")

    monkeypatch.setattr("actors.cli.commands.launch.execution.Launch", launch)
    assert main(["launch", file, *options]) == 1
    assert made == [expected]


def test_the_help_says_how_long_stopping_may_take(capsys: pytest.CaptureFixture[str]) -> None:
    """It does so without reading the constant, which would take time."""
    assert main(["launch", "--help"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert f"what a process gets after SIGINT, and again after SIGTERM; default: {STOP_TIMEOUT_SEC:g}" in said


def test_arguments_of_included_files_are_shown_too(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Each line of what they are for is indented, and a default is shown as it would be given."""
    (tmp_path / "inner.launch.yaml").write_text("launch: [{arg: {name: inner, default: $(var outer)}}]")
    path = tmp_path / "a.launch.py"
    source = """
        from actors.launch import DeclareLaunchArgument as Arg, IncludeLaunchDescription as Include
        from actors.launch import LaunchConfiguration, LaunchDescription, TextSubstitution

        def generate_launch_description():
            return LaunchDescription([
                Arg("outer", default_value=TextSubstitution(text="20"), description="one\\ntwo"),
                Arg("empty", default_value=""),
                Include(["inner", LaunchConfiguration("what", default=".launch.yaml")]),
            ])
    """
    path.write_text(textwrap.dedent(source))
    assert main(["launch", str(path), "-s"]) == 0
    assert capsys.readouterr().out.splitlines()[1:] == [
        "  outer (default: 20)",
        "      one",
        "      two",
        "  empty (default: '')",
        "  inner (default: LaunchConfiguration('outer'))",
    ]


@pytest.mark.parametrize(
    ("line", "error"),
    [
        ((), "the following arguments are required: FILE"),
        (("f.py", "--typo", "need:=1"), "unrecognized arguments: --typo"),
    ],
)
def test_only_what_is_wrong_is_reported_of_a_command_line(
    capsys: pytest.CaptureFixture[str], line: tuple[str, ...], error: str
) -> None:
    """Neither arguments that need not be there, nor those behind an option that nobody knows."""
    assert main(["launch", *line]) == 2
    assert capsys.readouterr().err == f"callboard launch: {error}; see callboard launch --help\n"


def test_a_file_without_arguments_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Rather than nothing."""
    path = tmp_path / "a.py"
    path.write_text("import actors.launch\ngenerate_launch_description = actors.launch.LaunchDescription")
    assert main(["launch", str(path), "-s"]) == 0
    assert capsys.readouterr().out == "The file has no arguments.\n"


def test_the_description_is_printed(file: str, capsys: pytest.CaptureFixture[str]) -> None:
    """An action a line, with what differs from its defaults; what it contains stands below it."""
    assert main(["launch", file, "-p"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("DeclareLaunchArgument(name='speed', default_value='1.5'")
    assert lines[2] == "GroupAction()"
    assert lines[3].startswith(
        "    ExecuteProcess(additional_env={'ROBOT': 'r2'}, cmd=['echo', 'x y', Launch"
    )
    assert lines[-1] == "    Shutdown(reason='enough')"


def test_the_page_is_one_more_process(file: str, capsys: pytest.CaptureFixture[str]) -> None:
    """It is started like those of the file, with their environment and labels."""
    assert main(["launch", file, "robot:=a", "speed:=2", "--dry-run", "--web"]) == 0
    assert "actors web --no-browser --listen 127.0.0.1:7412" in capsys.readouterr().out


def test_a_dry_run_prints_what_it_would_do(file: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Commands as they would be typed, and what comes later."""
    assert main(["launch", file, "robot:=a", "speed:=2", "--dry-run"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "[echo-1] ROBOT=r2 echo 'x y' 2",
        "say: hello",
        "after 2 s: end: enough",
    ]


@pytest.mark.parametrize(
    ("arguments", "code", "error"),
    [
        ((), 1, "{file}: Launch argument 'robot' is required: give robot:=…"),
        (("robot:=c",), 1, "{file}: Launch argument 'robot' must be one of a, b, not 'c'"),
        (("robot:=a", "sped:=1"), 2, "No launch argument 'sped'; did you mean 'speed'?"),
        (("robot:=a", "zzz:=1"), 2, "No launch argument 'zzz'; see --show-args"),
        (("robot",), 2, "Malformed launch argument 'robot': expected name:=value"),
        ((":=a",), 2, "Malformed launch argument ':=a': expected name:=value"),
    ],
)
def test_wrong_arguments_are_one_line(
    file: str, capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], code: int, error: str
) -> None:
    """Which says what would be right."""
    assert main(["launch", file, *arguments]) == code
    assert capsys.readouterr() == ("", f"{error.format(file=file)}\n")


@pytest.mark.parametrize(
    ("source", "error"),
    [
        (None, "No launch file '{file}': No such file or directory"),
        ("x = 1", "{file} has no function generate_launch_description()"),
        ("def generate_launch_description(): return [1]", "must return a LaunchDescription, not [1]"),
        (
            "def generate_launch_description():\n  return 1 / 0",
            "{file}, line 2: ZeroDivisionError: division by",
        ),
        ("\ndef f(:", "{file}, line 2: SyntaxError: invalid syntax"),
        ("import nothing_like_it", "{file}, line 1: ModuleNotFoundError: No module named 'nothing_like_it'"),
        ("import sys\n\nsys.exit(3)", "{file}, line 3: SystemExit: 3"),
        (
            "from actors.launch.description.substitutions import Command",
            "); all names of launch files are in actors.launch",
        ),
        (
            "from launch import LaunchDescription",
            "{file}, line 1: ModuleNotFoundError: No module named 'launch'; here it is: from",
        ),
        (
            "from actors.launch import LaunchDescription\n\nLaunchDescription([1])",
            "{file}, line 3: A launch description has actions in it, such as Node(…), not 1",
        ),
    ],
)
def test_a_wrong_file_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], source: str | None, error: str
) -> None:
    """Which says where in the file."""
    path = tmp_path / "wrong.py"
    if source is not None:
        path.write_text(source)
    assert main(["launch", str(path)]) == 1
    out, text = capsys.readouterr()
    assert out == ""
    assert error.format(file=path) in text
    assert text.count("\n") == 1


def test_a_launch_file_of_a_package_is_found(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """In its launch folder; a name that is nearly right is answered with the right one."""
    site = Site(tmp_path / "environment")
    site.install("launchable_robot")
    folder = site.path / "launchable_robot" / "launch"
    folder.mkdir(parents=True)
    (folder.parent / "__init__.py").touch()
    (folder / "all.launch.py").write_text(textwrap.dedent(FILE))
    monkeypatch.syspath_prepend(site.path)
    assert main(["launch", "launchable_robot", "all.launch.py", "robot:=a", "--dry-run"]) == 0
    assert "echo 'x y' 1.5" in capsys.readouterr().out
    assert main(["launch", "launchable_robot", "al.launch.py"]) == 1
    assert capsys.readouterr().err == (
        "No launch file 'al.launch.py' in package 'launchable_robot'; did you mean 'all.launch.py'?\n"
    )
    (folder / "less.launch.yaml").write_text("launch: [{log: {message: less}}]")
    (folder / "notes.txt").touch()
    assert main(["launch", "launchable_robot", "less.launch.yaml", "--dry-run"]) == 0
    assert capsys.readouterr().out == "say: less\n"
    assert main(["launch", "launchable_robot", "x"]) == 1
    assert capsys.readouterr().err.endswith("; there is: all.launch.py, less.launch.yaml\n")
    assert main(["launch", "launchable_robot"]) == 1
    assert "for a package write: callboard launch PACKAGE FILE" in capsys.readouterr().err
    assert main(["launch", "no_such_package", "x.py"]) == 1
    assert capsys.readouterr().err == "No launch file and no installed package 'no_such_package'\n"


def test_the_schema_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    """Without a file."""
    assert main(["launch", "--schema"]) == 0
    assert json.loads(capsys.readouterr().out)["required"] == ["launch"]


def test_another_machines_broker_is_not_made_here(
    file: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """A launch whose broker is elsewhere and does not answer says so and starts nothing."""
    assert main(["launch", file, "robot:=a", "--url", "callboard://broker.invalid:7411"]) == 3
    out, text = capfd.readouterr()
    assert out == ""
    assert text.startswith("No broker at callboard://broker.invalid:7411. Start one there with: ")


ROS_FILE = """
    from launch import LaunchDescription
    from launch_ros.actions import Node

    def generate_launch_description():
        return LaunchDescription([Node(package="ros_robot", executable="talker", namespace="ns1")])
"""


@pytest.fixture
def ros_robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The folder of data of a package of ROS 2; ROS 2's names are forgotten afterwards."""
    share = tmp_path / "share" / "ros_robot"
    (share / "launch").mkdir(parents=True)
    (share / "package.xml").write_text("<package/>")
    (share / "launch" / "robot_launch.py").write_text(textwrap.dedent(ROS_FILE))
    (share / "launch" / "robot.launch.xml").write_text(
        "<launch><node pkg='ros_robot' exec='talker' namespace='ns1'/></launch>"
    )
    (tmp_path / "lib" / "ros_robot").mkdir(parents=True)
    (tmp_path / "lib" / "ros_robot" / "talker").write_text("#!/usr/bin/python3\n")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    monkeypatch.setattr(sys, "meta_path", [*sys.meta_path])
    before = set(sys.modules)
    yield share
    for name in set(sys.modules) - before:
        if name.partition(".")[0] in {"launch", "launch_ros"}:
            del sys.modules[name]


@pytest.mark.parametrize("file", ["robot_launch.py", "robot.launch.xml"])
def test_a_file_written_for_ros_2_is_launched(
    ros_robot: Path, capsys: pytest.CaptureFixture[str], file: str
) -> None:
    """It imports ROS 2's names, and so do its programs; a package's files are found below its data."""
    assert main(["launch", "--ros", "ros_robot", file, "--dry-run"]) == 0
    shown = capsys.readouterr().out
    assert shown == "[talker-1] callboard run --ros ros_robot talker --ros-args -r __ns:=/ns1\n"
    assert main(["launch", "--ros", str(ros_robot / "launch" / file), "--dry-run"]) == 0
    assert main(["launch", "ros_robot", "x"]) == 1
    assert capsys.readouterr().err.endswith("there is: robot.launch.xml, robot_launch.py\n")


def test_an_installed_rclpy_is_not_hidden(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, ros_robot: Path
) -> None:
    """Unless that is forced."""
    (tmp_path / "rclpy.py").touch()
    monkeypatch.syspath_prepend(tmp_path)
    file = str(ros_robot / "launch" / "robot_launch.py")
    assert main(["launch", "--ros", file, "--dry-run"]) == 2
    assert "ROS 2's own rclpy is installed here" in capsys.readouterr().err
    assert main(["launch", "--ros", "--force", file, "--dry-run"]) == 0


@pytest.mark.parametrize(("option", "warned"), [("-n", True), ("--noninteractive", False)])
def test_n_is_noninteractive_as_in_ros_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], *, option: str, warned: bool
) -> None:
    """It was the dry run, so it says what it means now."""
    path = tmp_path / "a.launch.yaml"
    path.write_text("launch: [{log: {message: hello}}]")
    assert main(["launch", str(path), option, "--dry-run"]) == 0
    said = capsys.readouterr()
    assert said.out == "say: hello\n"
    assert ("-n means --noninteractive, as in ROS 2; the dry run is --dry-run" in said.err) is warned


@pytest.mark.parametrize(
    ("options", "prefixes"),
    [
        ((), ["", "nice"]),
        (("--launch-prefix", "gdb --args"), ["gdb --args", "nice"]),
        (("--launch-prefix", "gdb", "--launch-prefix-filter", "ec"), ["gdb", "nice"]),
        (("--launch-prefix", "gdb", "--launch-prefix-filter", "cho"), ["", "nice"]),
    ],
)
def test_a_prefix_is_for_processes_without_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], options: tuple[str, ...], prefixes: list[str]
) -> None:
    """If the filter matches the beginning of the program's name."""
    path = tmp_path / "a.launch.xml"
    path.write_text(
        "<launch><executable cmd='/bin/echo a'/><executable cmd='/bin/echo b' launch-prefix='nice'/></launch>"
    )
    assert main(["launch", str(path), "--dry-run", *options]) == 0
    lines = [line.partition("] ")[2] for line in capsys.readouterr().out.splitlines()]
    assert lines == [
        f"{prefix} /bin/echo {word}".strip() for prefix, word in zip(prefixes, "ab", strict=True)
    ]


@pytest.mark.parametrize(
    ("options", "code", "error"),
    [
        (("--launch-prefix-filter", "a"), 2, "--launch-prefix-filter needs --launch-prefix"),
        (
            ("--launch-prefix", "a", "--launch-prefix-filter", "("),
            1,
            "launch-prefix-filter '(' is no pattern",
        ),
        (("-a", "--output", "log"), 2, "not allowed with argument"),
    ],
)
def test_options_that_make_no_sense_are_errors(
    file: str, capsys: pytest.CaptureFixture[str], options: tuple[str, ...], code: int, error: str
) -> None:
    """Before anything is started."""
    assert main(["launch", file, "robot:=a", "--dry-run", *options]) == code
    assert error in capsys.readouterr().err


def test_debug_shows_where_an_error_was_raised(file: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Beside the line that says what is wrong."""
    assert main(["launch", file, "robot:=c", "--debug"]) == 1
    error = capsys.readouterr().err
    assert "Traceback (most recent call last)" in error
    assert "Launch argument 'robot' must be one of a, b, not 'c'" in error.splitlines()[-1]


@pytest.mark.parametrize("option", ["-s", "--show-args", "--show-arguments"])
def test_options_have_the_names_of_ros_2(file: str, capsys: pytest.CaptureFixture[str], option: str) -> None:
    """All of them."""
    assert main(["launch", file, option]) == 0
    assert capsys.readouterr().out.startswith("Arguments")
    for each in ("-p", "--print", "--print-description"):
        assert main(["launch", file, each]) == 0
        assert capsys.readouterr().out.startswith("DeclareLaunchArgument")

"""What is wrong is said with where it is, whichever way it comes to light."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

import pytest

from actors.launch.errors import LaunchError, LaunchFileError
from actors.launch.planning.events import ShuttingDown
from actors.launch.planning.plan import make_plan
from actors.launch.planning.steps import AddHandler, Call
from actors.launch.resources.files import Files

if TYPE_CHECKING:
    from pathlib import Path

    from actors.launch.planning.steps import Step

PYTHON = """\
from actors.launch import (
    DeclareLaunchArgument, ExecuteProcess, GroupAction, IfCondition, IncludeLaunchDescription,
    LaunchConfiguration, LaunchDescription, LogInfo, Node, OnNodeUp, OnShutdown, OpaqueFunction,
    PushNamespace, RegisterEventHandler, SetEnvironmentVariable, Shutdown, TimerAction,
)
def fail(*_):
    return 1 / 0
def wrong(*_):
    return 7
def later(*_):
    return [Node(script="none.py")]
def refuse(context):
    context.perform_substitution(LaunchConfiguration("x"))
def generate_launch_description():
    return LaunchDescription([LINE])
"""


def plan(path: Path, line: str) -> list[Step]:
    """Return the plan of a launch file with an action."""
    path.write_text(PYTHON.replace("LINE", line))
    return planned(path)


def planned(path: Path) -> list[Step]:
    """Return the plan of a launch file."""
    files = Files()
    description = files.description(str(path))
    return make_plan(description, files, arguments={}, environment={}, folder=str(path.parent))


@pytest.mark.parametrize(
    ("line", "error"),
    [
        ("Node(script='none.py')", "{file}: Node 'none.py': No script '{folder}/none.py'"),
        (
            "GroupAction([Node(script='s', respawn_delay='soon')])",
            "{file}: Node 's': respawn_delay must be a number of seconds, 0 or more, not 'soon'",
        ),
        (
            "TimerAction(period=1, actions=[ExecuteProcess(cmd=['/bin/echo', 'x'], respawn='yess')])",
            "{file}: ExecuteProcess '/bin/echo': Expected true or false, got 'yess'",
        ),
        (
            "LogInfo(msg='x', condition=IfCondition(LaunchConfiguration('x')))",
            "{file}: LogInfo: Launch argument 'x' is used, but not declared before that",
        ),
        ("DeclareLaunchArgument('x')", "{file}: Launch argument 'x' is required: give x:=…"),
        (
            "Node(script='s', name='a b')",
            "{file}: Node 'a b': 'a b' cannot be a node name: node name must not contain",
        ),
        (
            "RegisterEventHandler(OnNodeUp(node='/a b', on_up=Shutdown()))",
            "{file}: RegisterEventHandler 'OnNodeUp': '/a b' cannot be a topic name: topic name must",
        ),
        ("PushNamespace('a b')", "{file}: PushNamespace: '/a b' cannot be a namespace: namespace must not"),
        ("SetEnvironmentVariable('A=B', 'c')", "There can be no environment variable 'A=B=c'"),
        ("ExecuteProcess(cmd=['a'], env={'': 'c'})", "There can be no environment variable '=c'"),
        ("OpaqueFunction(function=fail)", "{file}, line 7: fail(): ZeroDivisionError: division by zero"),
        ("OpaqueFunction(function=wrong)", "{file}, line 8: wrong() must return actions or None, not 7"),
        ("OpaqueFunction(function=later)", "{file}: Node 'none.py': No script"),
        (
            "OpaqueFunction(function=refuse)",
            "{file}, line 13: refuse(): Launch argument 'x' is used, but not declared before that",
        ),
        (
            "IncludeLaunchDescription('none.py')",
            "{file}: IncludeLaunchDescription 'none.py': No launch file '{folder}/none.py': No such file",
        ),
        (
            "Node(script='s.py', parameters=['p.yaml'])",
            "{file}: Node 's.py': No parameter file '{folder}/p.yaml'",
        ),
        ("Node(script='s.py', parameters=['s.py'])", "{file}: Node 's.py': Parameter file '{folder}/s.py'"),
    ],
)
def test_a_mistake_is_reported_with_its_file_and_action(tmp_path: Path, line: str, error: str) -> None:
    """In one line: the file, what the action is known by, and what is wrong."""
    (tmp_path / "s.py").write_text("no parameters")
    (tmp_path / "s").touch()
    path = tmp_path / "a.launch.py"
    with pytest.raises(LaunchError) as caught:
        plan(path, line)
    assert str(caught.value).startswith(error.format(file=path, folder=tmp_path)) or (
        str(caught.value).startswith(str(path)) and error in str(caught.value)
    )
    assert "\n" not in str(caught.value)


def test_it_is_the_included_file_that_is_named(tmp_path: Path) -> None:
    """Once, and not those around it, too."""
    inner = tmp_path / "inner.launch.py"
    inner.write_text(PYTHON.replace("LINE", "Node(script='none.py')"))
    with pytest.raises(LaunchError) as caught:
        plan(tmp_path / "a.launch.py", "GroupAction([IncludeLaunchDescription('inner.launch.py')])")
    assert str(caught.value) == f"{inner}: Node 'none.py': No script '{tmp_path}/none.py'"
    inner.write_text("1 / 0")
    with pytest.raises(LaunchFileError) as failed:
        plan(tmp_path / "a.launch.py", "IncludeLaunchDescription('inner.launch.py')")
    assert str(failed.value) == f"{inner}, line 1: ZeroDivisionError: division by zero"


@pytest.mark.parametrize(
    ("suffix", "source", "error"),
    [
        (
            "yaml",
            """
            launch:
              - group:
                  - log: {message: hello}
                  - node:
                      script: none.py
            """,
            ", line 5: launch[0].group[1].node: No script",
        ),
        (
            "yaml",
            "launch: [{on_shutdown: {do: [{log: {msg: $(var x)}}]}}]",
            ", line 1: launch[0].on_shutdown.do[0]",
        ),
        ("toml", "[[launch]]\n[launch.node]\nscript = 'none.py'", ": launch[0].node: No script"),
        ("yaml", "launch: [{node: {script: a, param: [{from: p.yaml}]}}]", ".node: No parameter file"),
        (
            "yaml",
            "launch: [{node: {script: a, respawn_max_retries: $(eval 1.5)}}]",
            "respawn_max_retries must be",
        ),
    ],
)
def test_a_document_names_the_line(tmp_path: Path, suffix: str, source: str, error: str) -> None:
    """Of the element, also for what is found only when it is planned."""
    path = tmp_path / f"a.{suffix}"
    (tmp_path / "a").touch()
    path.write_text(textwrap.dedent(source))
    with pytest.raises(LaunchError) as caught:
        planned(path)
    assert str(caught.value).startswith(str(path))
    assert error in str(caught.value)


def test_what_comes_to_light_later_has_its_line_too(tmp_path: Path) -> None:
    """Functions in handlers and timers, and what they return."""
    path = tmp_path / "a.launch.py"
    (react,) = plan(path, "RegisterEventHandler(OnShutdown(on_shutdown=fail))")
    assert isinstance(react, AddHandler)
    with pytest.raises(LaunchError) as caught:
        react.steps(ShuttingDown("over"))
    assert str(caught.value) == f"{path}, line 7: fail(): ZeroDivisionError: division by zero"
    (call,) = plan(path, "TimerAction(period=1, actions=[OpaqueFunction(function=later)])")
    assert isinstance(call, Call)
    with pytest.raises(LaunchError) as caught:
        call.steps()
    assert str(caught.value) == f"{path}: Node 'none.py': No script '{tmp_path}/none.py'"

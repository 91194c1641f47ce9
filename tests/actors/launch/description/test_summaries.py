"""Summaries of actions for people."""

from __future__ import annotations

from pathlib import PurePath
from typing import TYPE_CHECKING

import pytest

from actors.launch.description.actions import (
    DeclareLaunchArgument,
    LogInfo,
    OpaqueFunction,
    RegisterEventHandler,
    SetParameter,
    Shutdown,
)
from actors.launch.description.conditions import IfCondition
from actors.launch.description.description import format_actions
from actors.launch.description.event_handlers import OnProcessExit
from actors.launch.description.process_actions import ExecuteProcess, Node
from actors.launch.description.substitutions import LaunchConfiguration, TextSubstitution
from actors.launch.description.summaries import action_label, static_text

if TYPE_CHECKING:
    from actors.launch.description.action import Action
    from actors.launch.description.substitutions import Text


def make() -> None:
    """A function."""


@pytest.mark.parametrize(
    ("action", "word"),
    [
        (Node(package="p", executable="talker", name="t"), "Node 't'"),
        (Node(package="p", executable="talker", name=LaunchConfiguration("n")), "Node 'talker'"),
        (Node(node="robot:Arm"), "Node 'robot:Arm'"),
        (ExecuteProcess(cmd=["echo", "x"]), "ExecuteProcess 'echo'"),
        (OpaqueFunction(function=make), "OpaqueFunction 'make()'"),
        (RegisterEventHandler(OnProcessExit(on_exit=[])), "RegisterEventHandler 'OnProcessExit'"),
        (LogInfo(msg="x"), "LogInfo"),
        (SetParameter("speed", 1), "SetParameter 'speed'"),
    ],
)
def test_an_action_is_known_by_its_name(action: Action, word: str) -> None:
    """Or its program, or whatever is known before anything is resolved."""
    assert action_label(action) == word


@pytest.mark.parametrize(
    ("text", "plain"),
    [
        ("a", "a"),
        (PurePath("a/b"), "a/b"),
        (TextSubstitution("20"), "20"),
        (["a", TextSubstitution("b")], "ab"),
        (["a", LaunchConfiguration("b")], None),
        ([], ""),
    ],
)
def test_a_plain_text_is_the_same_everywhere(text: Text, plain: str | None) -> None:
    """One with an argument in it is not plain."""
    assert static_text(text) == plain


def test_a_description_is_shown_without_what_goes_without_saying() -> None:
    """Defaults are left out, targets have names, and what a handler does stands below it alone."""
    talker = Node(
        script="talker.py",
        parameters=[{"speed": LaunchConfiguration("speed")}],
        respawn=True,
        remappings=[("a", "b")],
    )
    bye = RegisterEventHandler(OnProcessExit(target_action=talker, on_exit=[Shutdown(reason="bye")]))
    call = RegisterEventHandler(OnProcessExit(on_exit=make, handle_once=True))
    declare = DeclareLaunchArgument("speed", default_value="")
    node = "respawn=True, script='talker.py', parameters=[{'speed': LaunchConfiguration('speed')}]"
    lines = list(format_actions([declare, talker, bye, call, LogInfo(msg="x", condition=IfCondition("1"))]))
    assert lines == [
        "DeclareLaunchArgument(name='speed', default_value='')",
        f"Node({node}, remappings=[('a', 'b')])",
        "RegisterEventHandler(event_handler=OnProcessExit(target_action=Node 'talker.py'))",
        "    Shutdown(reason='bye')",
        "RegisterEventHandler(event_handler=OnProcessExit(handle_once=True, on_exit=make()))",
        "LogInfo(condition=IfCondition('1'), msg='x')",
    ]

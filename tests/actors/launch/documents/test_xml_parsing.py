"""XML launch files: the same actions as those of YAML, and nothing that makes a small file large."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from actors.launch.description.actions import (
    COMPONENTS,
    DeclareLaunchArgument,
    GroupAction,
    IncludeLaunchDescription,
    LogInfo,
    PushNamespace,
    RegisterEventHandler,
    ResetLaunchConfigurations,
    SetEnvironmentVariable,
    SetParameter,
    Shutdown,
    TimerAction,
    UnsupportedAction,
)
from actors.launch.description.conditions import IfCondition, UnlessCondition
from actors.launch.description.event_handlers import OnProcessExit
from actors.launch.description.library_substitutions import LaunchLogDir, Parameter
from actors.launch.description.process_actions import ExecuteProcess, Node, ParameterValue
from actors.launch.description.substitutions import LaunchConfiguration
from actors.launch.description.templates import ParameterFile
from actors.launch.documents.reading import read_document
from actors.launch.errors import LaunchFileError

if TYPE_CHECKING:
    from actors.launch.description.action import Action

VAR = LaunchConfiguration("x")

PARAMETERS = """<node pkg='p' exec='e'>
    <param name='a' value='1.5'/><param name='b' value='[1, 2]'/>
    <param name='c' value='08'/><param name='d' value='$(var x)'/><param from='p.yaml'/>
    <param name='e'><param name='f' value='true'/></param><param name='g' value='1' type='str'/>
    <param name='h' value='1;2' value-sep=';'/><param name='i' value='1;2' value-sep=';' type='str'/>
</node>"""


def described(text: str) -> tuple[Action, ...]:
    """Return what a file describes."""
    return tuple(read_document("/files/a.launch.xml", text.encode()).actions)


@pytest.mark.parametrize(
    ("text", "action"),
    [
        ("<log message='a $(var x)'/>", LogInfo(msg=("a ", VAR))),
        (
            "<arg name='a' default='1' description='why'><choice value='1'/><choice value='2'/></arg>",
            DeclareLaunchArgument("a", default_value="1", description="why", choices=("1", "2")),
        ),
        (
            "<node pkg='p' exec='e' name='n' namespace='ns' args='-v 1' respawn='true' if='$(var x)'/>",
            Node(
                package="p",
                executable="e",
                name="n",
                namespace="ns",
                arguments=("-v", "1"),
                respawn="true",
                condition=IfCondition(VAR),
            ),
        ),
        (
            "<node pkg='p' exec='e'><remap from='a' to='b'/><env name='A' value='1'/></node>",
            Node(package="p", executable="e", remappings=(("a", "b"),), additional_env={"A": "1"}),
        ),
        (
            PARAMETERS,
            Node(
                package="p",
                executable="e",
                parameters=(
                    {"a": 1.5},
                    {"b": [1, 2]},
                    {"c": 8.0},
                    {"d": VAR},
                    "p.yaml",
                    {"e.f": True},
                    {"g": ParameterValue("1", value_type=str)},
                    {"h": [1, 2]},
                    {"i": ParameterValue(["1", "2"], value_type=list[str])},
                ),
            ),
        ),
        (
            "<group scoped='false'><push-ros-namespace namespace='a'/></group>",
            GroupAction((PushNamespace("a"),), scoped=False),
        ),
        (
            "<group forwarding='false'><keep name='a' value='1'/></group>",
            GroupAction((), forwarding=False, launch_configurations={"a": "1"}),
        ),
        (
            "<include file='b.launch.py'><arg name='a' value='1'/></include>",
            IncludeLaunchDescription("b.launch.py", launch_arguments={"a": "1"}, scoped=False),
        ),
        (
            "<include file='b' scoped='true'><let name='a' value='1'/></include>",
            IncludeLaunchDescription("b", launch_arguments={"a": "1"}),
        ),
        (
            "<node pkg='p' exec='e'><param from='p.yaml' allow_substs='$(var x)'/></node>",
            Node(package="p", executable="e", parameters=(ParameterFile("p.yaml", allow_substs=VAR),)),
        ),
        (
            "<timer period='2' cancel_on_shutdown='false'/>",
            TimerAction(period="2", actions=(), cancel_on_shutdown="false"),
        ),
        ("<log message='$(param a) $(log_dir)'/>", LogInfo(msg=(Parameter("a"), " ", LaunchLogDir()))),
        ("<node exec='/bin/talker'/>", Node(executable="/bin/talker")),
        (
            (
                "<node_container pkg='c' exec='e' name='n' unless='$(var x)'>"
                "<composable_node><param name='a'/><remap from='b'/></composable_node></node_container>"
            ),
            UnsupportedAction(
                action_type="node_container", remedy=COMPONENTS, condition=UnlessCondition(VAR)
            ),
        ),
        ("<group scoped='0'/>", GroupAction((), scoped=False)),
        ("<group scoped='Off'/>", GroupAction((), scoped=False)),
        ("<executable cmd='ls -l' output='screen'/>", ExecuteProcess(cmd=("ls", "-l"), output="screen")),
        (
            "<timer period='2'><shutdown reason='enough'/></timer>",
            TimerAction(period="2", actions=(Shutdown(reason="enough"),)),
        ),
        ("<ros_timer period='2'/>", TimerAction(period="2", actions=())),
        ("<set_parameter name='a' value='3'/>", SetParameter("a", 3)),
        ("<set_parameter name='a' value='a: ['/>", SetParameter("a", "a: [")),
        ("<set_use_sim_time value='true'/>", SetParameter("use_sim_time", True)),
        ("<set_ros_log_dir new_log_dir='/log'/>", SetEnvironmentVariable("ROS_LOG_DIR", "/log")),
        ("<reset><keep name='a' value='1'/></reset>", ResetLaunchConfigurations({"a": "1"})),
        (
            "<on_process_exit target='talker' once='true'><log message='bye'/></on_process_exit>",
            RegisterEventHandler(
                OnProcessExit(target_action="talker", handle_once=True, on_exit=(LogInfo(msg="bye"),))
            ),
        ),
    ],
)
def test_an_element_is_the_action_that_ros_2_has(text: str, action: Action) -> None:
    """With its attributes, and what is in it."""
    assert described(f"<launch version='0.1.0'>{text}</launch>") == (action,)


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("<launch>", "line 1: it is not XML: no element found"),
        ("", "it is not XML: no element found"),
        ("<robot/>", "line 1: a launch file begins with <launch>"),
        ("<launch x='1'/>", "line 1: <launch> has no attribute 'x'; there is deprecated, version"),
        ("<launch>\n<nod/></launch>", "line 2: launch[0].nod: no such element; did you mean 'node'?"),
        ("<launch>\n<log mesage='a'/></launch>", "line 2: launch[0].log.mesage: no such key; did you mean"),
        (
            "<launch>\n<node pkg='p'\nexec='e'>\n<param nam='a'/></node></launch>",
            "line 4: launch[0].node.param[0]",
        ),
        (
            "<launch>\n<node pkg='p' exec='e'><param name='a'>\n<param/>\n<x/></param></node></launch>",
            "line 4: launch[0].node.param[0]: <param> and <x> cannot both be in <param>",
        ),
        (
            "<launch>\n<node pkg='p' exec='e'>\n<param name='a' value='[1, 2.0]'/></node></launch>",
            "line 3: launch[0].node.param[0].value: the values of a list must be of one type, not [1, 2.0]",
        ),
        (
            "<launch>\n<node pkg='p' exec='e'>\n<param name='a' value='x: y'/></node></launch>",
            "line 3: launch[0].node.param[0].value: 'x: y' is a mapping in YAML, no value of a",
        ),
        (
            "<launch>\n<node pkg='p' exec='e'><param from='a' value-sep=';'/></node></launch>",
            "line 2: launch[0].node.param[0].value-sep: no such key",
        ),
        ("<launch>\n<node pkg='p' exec='e'><x/></node></launch>", "line 2: launch[0].node.x: no such key"),
        (
            "<launch>\n<node pkg='p' exec='e' param='1'>\n<param/></node></launch>",
            "line 3: launch[0].node: 'param'",
        ),
        (
            "<launch>\n<group scoped='perhaps'/></launch>",
            "line 2: launch[0].group.scoped: expected true or false",
        ),
        ("<launch>\nhello</launch>", "text outside of attributes: 'hello'"),
        ("<launch>" + "<group>" * 60 + "</group>" * 60 + "</launch>", "it is nested deeper than 50"),
    ],
)
def test_a_mistake_is_named_with_its_line(text: str, error: str) -> None:
    """And with its place."""
    with pytest.raises(LaunchFileError) as caught:
        described(text)
    assert error in str(caught.value)


@pytest.mark.parametrize(
    "text",
    [
        "<!DOCTYPE launch [<!ENTITY a 'aaaa'><!ENTITY b '&a;&a;&a;'>]><launch><log message='&b;'/></launch>",
        "<!DOCTYPE launch SYSTEM 'file:///etc/passwd'><launch/>",
        "<!DOCTYPE launch [<!ENTITY f SYSTEM 'file:///etc/passwd'>]><launch><log message='&f;'/></launch>",
    ],
)
def test_entities_cannot_be_declared(text: str) -> None:
    """They would make a small file large, or read others."""
    with pytest.raises(LaunchFileError, match="document types and entities cannot be declared"):
        described(text)


def test_an_empty_file_describes_nothing() -> None:
    """It is a launch file nevertheless."""
    found: Any = described("<?xml version='1.0'?>\n<!-- nothing -->\n<launch/>")
    assert found == ()

"""What cannot be an argument is found where it is said."""

from __future__ import annotations

import importlib
import re
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, Any

import pytest

from actors.launch.description.actions import (
    DeclareLaunchArgument,
    EmitEvent,
    GroupAction,
    IncludeLaunchDescription,
    LogInfo,
    OpaqueFunction,
    RegisterEventHandler,
    TimerAction,
)
from actors.launch.description.event_handlers import OnNodeUp, OnProcessExit, OnStateTransition
from actors.launch.description.lifecycle import ChangeState, LifecycleTransition, matches_action
from actors.launch.description.process_actions import ExecuteProcess, Node
from actors.launch.description.substitutions import LaunchConfiguration, PathJoinSubstitution
from actors.launch.description.validation import ARGUMENT_TYPES, MAX_SHOWN, Entity, excerpt
from actors.launch.errors import LaunchError

if TYPE_CHECKING:
    from collections.abc import Iterator

FREE = {"Factory | str | None", "ParameterEntry", "tuple[Truth, ...]"}
"""What is looked at when it is used."""
MODULES = (
    "action",
    "actions",
    "conditions",
    "event_handlers",
    "library_substitutions",
    "lifecycle",
    "logic",
    "process_actions",
)


def entities() -> Iterator[type]:
    """Yield all entities that a description can have."""
    for name in (*MODULES, "description_source", "python_expression", "substitutions"):
        module = importlib.import_module(f"actors.launch.description.{name}")
        for value in vars(module).values():
            if isinstance(value, type) and issubclass(value, Entity) and is_dataclass(value):
                yield value


def test_each_argument_of_each_entity_is_checked() -> None:
    """So that a new one is not forgotten, and none is left over."""
    said = {str(each.type) for entity in entities() for each in fields(entity)}
    assert said - set(ARGUMENT_TYPES) == FREE
    assert set(ARGUMENT_TYPES) <= said


@pytest.mark.parametrize(
    ("part", "wrong", "wanted"),
    [
        (
            ExecuteProcess,
            {"cmd": "echo hello"},
            "cmd must be a list of strings, such as ['echo', 'hello'], not",
        ),
        (ExecuteProcess, {"cmd": LaunchConfiguration("a")}, "cmd must be a list"),
        (EmitEvent, {"event": LogInfo(msg="a")}, "event must be Shutdown() or ChangeState(…), not"),
        (matches_action, {"action": LogInfo(msg="a")}, "action must be a Node or an ExecuteProcess, not"),
        (
            OnStateTransition,
            {"entities": (), "target_lifecycle_node": Node(script="a.py")},
            "target_lifecycle_node must be a LifecycleNode, the name of one, or None, not",
        ),
        (
            LifecycleTransition,
            {"lifecycle_node_names": ["a"], "transition_ids": 1},
            "transition_ids must be a list of numbers and strings, not 1",
        ),
        (
            ChangeState,
            {"lifecycle_node_matcher": "a", "transition_id": 1},
            "lifecycle_node_matcher must be matches_action(…), matches_node_name(…) or a function, not 'a'",
        ),
        (ExecuteProcess, {"cmd": [None]}, "cmd must be a list"),
        (ExecuteProcess, {"cmd": None}, "cmd must be a list"),
        (Node, {"arguments": "--x"}, "arguments must be a list of strings"),
        (Node, {"parameters": {"a": 1}}, "parameters must be a list of mappings"),
        (Node, {"parameters": "p.yaml"}, "parameters must be a list of mappings"),
        (Node, {"parameters": [None]}, "parameters must be a list of mappings"),
        (
            Node,
            {"remappings": {"a": "b"}},
            "remappings must be a list of pairs, such as [('chatter', 'news')]",
        ),
        (Node, {"remappings": ("a", "b")}, "remappings must be a list of pairs"),
        (Node, {"remappings": ["a:=b"]}, "remappings must be a list of pairs"),
        (Node, {"additional_env": [("A", "b")]}, "additional_env must be a mapping of names to strings"),
        (Node, {"env": {"A": 1}}, "env must be a mapping of names to strings"),
        (Node, {"depends_on": 3}, "depends_on must be a Node, a string such as 'topic chatter'"),
        (Node, {"depends_on": [None]}, "depends_on must be a Node"),
        (Node, {"on_exit": "x"}, "on_exit must be an action such as LogInfo(…)"),
        (Node, {"on_exit": [None]}, "on_exit must be an action"),
        (Node, {"condition": True}, "condition must be a condition, such as IfCondition('true')"),
        (Node, {"condition": "true"}, "condition must be a condition"),
        (Node, {"respawn": 1}, "respawn must be True or False"),
        (Node, {"respawn_max_retries": True}, "respawn_max_retries must be a number, or a string"),
        (Node, {"name": 3}, "name must be a string or a substitution, or None, not 3"),
        (DeclareLaunchArgument, {"name": "a", "choices": [1, 2]}, "choices must be a list of strings"),
        (DeclareLaunchArgument, {"name": "a", "choices": "ab"}, "choices must be a list of strings"),
        (
            IncludeLaunchDescription,
            {"launch_arguments": ["a"]},
            "launch_arguments must be a mapping of names",
        ),
        (
            IncludeLaunchDescription,
            {"launch_arguments": [(["a"], "1")]},
            "launch_arguments must be a mapping of names",
        ),
        (GroupAction, {"actions": ["talker"]}, "actions must be a list of actions"),
        (GroupAction, {"actions": LogInfo(msg="a")}, "actions must be a list of actions"),
        (TimerAction, {"period": None, "actions": []}, "period must be a number"),
        (OpaqueFunction, {"function": "x"}, "function must be a function, not 'x'"),
        (OpaqueFunction, {"function": print, "args": 3}, "args must be a list"),
        (RegisterEventHandler, {"event_handler": LogInfo(msg="a")}, "event_handler must be an event handler"),
        (OnProcessExit, {"on_exit": [3]}, "on_exit must be an action"),
        (
            OnProcessExit,
            {"target_action": 7, "on_exit": []},
            "target_action must be a Node, an ExecuteProcess",
        ),
        (OnNodeUp, {"node": 3, "on_up": []}, "node must be a string or a Node"),
        (PathJoinSubstitution, {"substitutions": 3}, "substitutions must be a list of strings"),
    ],
)
def test_what_is_wrong_is_reported_with_what_is_wanted(
    part: type, wrong: dict[str, Any], wanted: str
) -> None:
    """A text where a list belongs among it, which would be taken letter by letter."""
    if part is IncludeLaunchDescription:
        wrong = {"launch_description_source": "a", **wrong}
    with pytest.raises(LaunchError, match=re.escape(f"{part.__name__}: {wanted}")):
        part(**wrong)


def test_none_is_the_default_of_an_argument_that_has_one() -> None:
    """As in ROS 2's launch files."""
    node = Node(script="a.py", parameters=None, prefix=None, additional_env=None)  # type: ignore[arg-type]
    assert node == Node(script="a.py")


def test_a_text_that_contains_itself_is_none() -> None:
    """Rather than the end of the stack."""
    endless: list[Any] = []
    endless.append(endless)
    with pytest.raises(LaunchError, match="msg must be a string"):
        LogInfo(msg=endless)


def test_what_is_shown_has_a_limit() -> None:
    """And no line ends."""
    assert excerpt("a\nb") == "'a\\nb'"
    assert len(excerpt("a" * 1000)) == MAX_SHOWN + 1

"""Actions for nodes. Where ROS 2's have other arguments or defaults than callboard's, they are subclasses."""

from __future__ import annotations

from pathlib import PurePath
from typing import TYPE_CHECKING, Any

from actors.launch import (
    LifecycleNode as CallboardLifecycleNode,
    LifecycleTransition as LifecycleTransition,
    Node as CallboardNode,
    PushRosNamespace as PushRosNamespace,
    SetEnvironmentVariable,
    SetParameter as SetParameter,
    SetParametersFromFile as SetParametersFromFile,
    SetRemap as SetRemap,
)
from actors.launch.description.actions import COMPONENTS
from actors.ros.launch.unsupported import unsupported_action
from actors.ros.launch.actions import TimerAction, process_options

if TYPE_CHECKING:
    from actors.launch.description.conditions import Condition
    from actors.launch.description.substitutions import Substitution, Text

ComposableNodeContainer = unsupported_action("ComposableNodeContainer", COMPONENTS)
LoadComposableNodes = unsupported_action("LoadComposableNodes", COMPONENTS)
PushROSNamespace = PushRosNamespace
RosTimer = TimerAction
"""Of real time, also if nodes use simulated time."""
ROSTimer = TimerAction


class Node(CallboardNode):
    """A program with a node in it.

    Args:
        given: The arguments of ROS 2's action. As there, the program's name labels its lines, and its stdout
            goes to the log file alone, unless `output` says otherwise.
    """

    def __init__(self, **given: Any) -> None:
        super().__init__(**_node_options(given))


class LifecycleNode(CallboardLifecycleNode):
    """A program with a lifecycle node in it.

    Args:
        given: The arguments of ROS 2's action.
    """

    def __init__(self, **given: Any) -> None:
        super().__init__(**_node_options(given))


def _node_options(given: dict[str, Any]) -> dict[str, Any]:
    options = process_options(given)
    executable = options.get("executable")
    if options.get("exec_name") is None and executable is not None:
        # Without a package it is a path, of which the label has the last part.
        path = options.get("package") is None and isinstance(executable, str)
        options["exec_name"] = PurePath(executable).name if path else executable
    return options


class SetUseSimTime(SetParameter):
    """Let nodes use simulated time, or not.

    Args:
        value: Whether they do.
        condition: When to carry it out; None: always.
    """

    def __init__(self, value: bool | str | Substitution, *, condition: Condition | None = None) -> None:
        super().__init__("use_sim_time", value, condition=condition)


class SetROSLogDir(SetEnvironmentVariable):
    """Set ROS_LOG_DIR for programs.

    Args:
        new_log_dir: The folder.
        condition: When to carry it out; None: always.
    """

    def __init__(self, new_log_dir: Text, *, condition: Condition | None = None) -> None:
        super().__init__("ROS_LOG_DIR", new_log_dir, condition=condition)

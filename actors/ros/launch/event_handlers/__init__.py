"""Event handlers. Where ROS 2's have other arguments than callboard's, they are subclasses."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actors.launch import (
    OnProcessExit as OnProcessExit,
    OnProcessIO as CallboardIO,
    OnProcessStart as OnProcessStart,
    OnShutdown as OnShutdown,
)
from actors.ros.launch.unsupported import unsupported

if TYPE_CHECKING:
    from actors.launch.description.event_handlers import Reaction, Target

OnIncludeLaunchDescription = unsupported("OnIncludeLaunchDescription", "put the actions behind the include")


class OnProcessIO(CallboardIO):
    """React to lines that a process has written.

    Args:
        on_stdin: Ignored: the stdin of processes is empty.
        given: The arguments of callboard's handler.
    """

    def __init__(self, *, on_stdin: Reaction | None = None, **given: Any) -> None:
        super().__init__(**given)


class OnExecutionComplete(OnProcessExit):
    """React to the end of a process; ROS 2 also has the ends of other actions.

    Args:
        on_completion: What to do.
        target_action: The action that has started the process.
        given: Further arguments of callboard's handler.
    """

    def __init__(self, *, on_completion: Reaction, target_action: Target = None, **given: Any) -> None:
        super().__init__(on_exit=on_completion, target_action=target_action, **given)

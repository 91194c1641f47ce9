"""Event handlers. Where ROS 2's have other arguments than callboard's, they are subclasses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from actors.launch import (
    OnProcessExit as OnProcessExit,
    OnProcessIO as CallboardIO,
    OnProcessStart as OnProcessStart,
    OnShutdown as OnShutdown,
)
from actors.launch.description.action import EventHandler as CallboardHandler
from actors.ros.launch.unsupported import unsupported

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.launch.description.action import Reaction
    from actors.launch.description.event_handlers import Target


@dataclass(frozen=True, kw_only=True)
class EventHandler(CallboardHandler):
    """React to events that a function chooses.

    Attributes:
        matcher: Called with each event; returns whether it is meant.
        entities: An action, a list of actions, or a function that is called with the event and the
            `LaunchContext`.
        handle_once: Whether to react only the first time.
    """

    matcher: Callable[..., Any]
    entities: Reaction = ()


OnIncludeLaunchDescription = unsupported("OnIncludeLaunchDescription", "put the actions after the include")


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

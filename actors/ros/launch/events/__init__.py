"""Events."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.launch import (
    matches_action as matches_action,
    Shutdown as ShutdownAction,
)
from actors.launch.planning.events import ProcessExited
from actors.ros.launch.events import process as process

if TYPE_CHECKING:
    from actors.launch.description.substitutions import Text


ExecutionComplete = ProcessExited


class Shutdown(ShutdownAction):
    """The end of the launch, for `EmitEvent`.

    Args:
        reason: The reason to show.
        due_to_sigint: Ignored.
    """

    def __init__(self, *, reason: Text = "reason not given", due_to_sigint: bool = False) -> None:
        super().__init__(reason=reason)

"""The callbacks of an action server, their answers, and their defaults."""

from __future__ import annotations

import inspect
from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.actions.server_goal import ServerGoalHandle


class GoalResponse(IntEnum):
    """The answers of a goal callback."""

    REJECT = 1
    ACCEPT = 2


class CancelResponse(IntEnum):
    """The answers of a cancel callback."""

    REJECT = 1
    ACCEPT = 2


def accept_goal(request: object) -> GoalResponse:
    """Accept every goal."""
    del request
    return GoalResponse.ACCEPT


def reject_cancel(goal: object) -> CancelResponse:
    """Reject every cancellation."""
    del goal
    # rclpy's default. A callback that does not look at `is_cancel_requested` could not be cancelled anyway.
    return CancelResponse.REJECT


def execute_at_once(goal: ServerGoalHandle[Any, Any, Any]) -> None:
    """Execute a goal as soon as it is accepted."""
    goal.execute()


@dataclass(frozen=True, kw_only=True)
class ServerCallbacks:
    """The callbacks of an action server; `Node.create_action_server` describes them."""

    execute: Callable[..., Any]
    goal: Callable[..., Any]
    cancel: Callable[..., Any]
    handle_accepted: Callable[..., Any]


async def awaited(result: Any) -> Any:
    """Return the result of a callback that may be `def` or `async def`."""
    return await result if inspect.isawaitable(result) else result

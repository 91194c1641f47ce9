"""What calls in both directions share: limits, QoS, the names of an action's services."""

from __future__ import annotations

from typing import Final

from actors.qos.profile import QoSProfile

CALL_LIMIT_SEC: Final = 3600.0
"""Longest time for a call without a shorter deadline; work that takes longer is for an action. Every call
needs a limit, because ROS 2 may lose a request or a response."""
SERVICE_QOS: Final = QoSProfile(depth=500)
"""The QoS of services and clients in ROS 2: so many requests and responses can wait there for the loop.
ROS 2's default of 10 loses others without a word."""
FEEDBACK_SEC: Final = 3.0
"""How long a goal waits until the feedback subscription of its client has crossed. That takes 0.1 s, or more
on a busy machine. Action clients always have one, but a raw `send_goal` may come without."""
FEEDBACK_POLL_SEC: Final = 0.02
"""Delay between two checks whether it has."""

RESULT: Final = "/_action/get_result"
GOAL: Final = "/_action/send_goal"
CANCEL: Final = "/_action/cancel_goal"
"""The ends of the names of an action's services."""


def feedback_of(name: str, service_type: str) -> tuple[str, str]:
    """Return the name and the type of an action's feedback topic.

    Args:
        name: The full name of one of the action's services.
        service_type: The type of that service.
    """
    return f"{name.rpartition('/')[0]}/feedback", f"{service_type.rpartition('_')[0]}_FeedbackMessage"

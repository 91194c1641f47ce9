"""What both directions of calls have in common: limits, QoS, the parts of actions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.interfaces.message import type_name
from actors.qos.profile import QoSProfile

if TYPE_CHECKING:
    from actors.bridges.ros2.types import ServiceTypes

CALL_LIMIT_SEC: Final = 3600.0
"""How long a call may take, if its caller waits as long: what takes longer is an action. ROS 2 may lose a
request or a response, so that each call needs a limit."""
SERVICE_DEPTH: Final = 500
"""Requests and responses that have arrived in ROS 2 and wait for the loop; ROS 2's default of 10 loses others
without a word. From 100 on it costs 40 KiB more for each service or client."""
FEEDBACK_SEC: Final = 3.0
"""How long a goal waits until its client's subscription to the feedback, which began before, has crossed. It
takes 0.1 s, or more on a busy machine; action clients always have one."""
FEEDBACK_POLL_SEC: Final = 0.02
"""Between two looks whether it has."""

RESULT: Final = "/_action/get_result"
GOAL: Final = "/_action/send_goal"
CANCEL: Final = "/_action/cancel_goal"
"""What the names of the services of an action end with."""

_STANDARD: Final = ("rcl_interfaces/", "type_description_interfaces/", "lifecycle_msgs/")
"""What the types of services begin with that most nodes have and few call: they have ROS 2's default."""


def feedback_of(name: str, service_type: str) -> tuple[str, str]:
    """Return name and type of the topic with the feedback of an action.

    Args:
        name: The name of one of its services.
        service_type: The type of that service.
    """
    return f"{name.rpartition('/')[0]}/feedback", f"{service_type.rpartition('_')[0]}_FeedbackMessage"


def ros_qos(types: ServiceTypes) -> QoSProfile | None:
    """Return the QoS of a service or client in ROS 2; None for its default."""
    return None if type_name(types.ours).startswith(_STANDARD) else QoSProfile(depth=SERVICE_DEPTH)

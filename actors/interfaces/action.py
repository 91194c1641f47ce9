"""The services and the message of an action, with ROS's names.

An action `Fibonacci` uses two services, `Fibonacci_SendGoal` and `Fibonacci_GetResult`, and a topic
of `Fibonacci_FeedbackMessage`, beside the common `action_msgs/srv/CancelGoal` and
`action_msgs/msg/GoalStatusArray`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any, cast

from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.message import Action, Message, Service, message_class, type_name
from actors.interfaces.types import int8
from actors.interfaces.unique_identifier_msgs.msg import UUID


@dataclass(frozen=True)
class ActionTypes:
    """The types derived from an action.

    Attributes:
        send_goal: Service: Request(goal_id, goal), Response(accepted, stamp).
        get_result: Service: Request(goal_id), Response(status, result).
        feedback_message: Message: goal_id, feedback.
    """

    send_goal: type[Service]
    get_result: type[Service]
    feedback_message: type[Message]


@dataclass(frozen=True)
class ActionImpl:
    """The services and messages that carry an action, by the names that ROS's classes have for them.

    Attributes:
        SendGoalService: Service: Request(goal_id, goal), Response(accepted, stamp).
        GetResultService: Service: Request(goal_id), Response(status, result).
        FeedbackMessage: Message: goal_id, feedback.
        CancelGoalService: Service: `action_msgs/srv/CancelGoal`.
        GoalStatusMessage: Message: `action_msgs/msg/GoalStatusArray`.
    """

    SendGoalService: type[Service]
    GetResultService: type[Service]
    FeedbackMessage: type[Message]
    CancelGoalService: type[Service]
    GoalStatusMessage: type[Message]


def _service(
    owner: type[Action], name: str, request: dict[str, Any], response: dict[str, Any]
) -> type[Service]:
    namespace = {
        "__module__": owner.__module__,
        "Request": message_class(owner, f"{name}_Request", request),
        "Response": message_class(owner, f"{name}_Response", response),
    }
    # The class is made by its metaclass, as a `class` statement would: `__init_subclass__` gives names to
    # the parts.
    make: Any = type(Service)
    made: type[Service] = make(name.rpartition("/")[2], (Service,), namespace, type_name=name)
    return made


def is_action_type(cls: object) -> bool:
    """Return whether `cls` is an action class."""
    return isinstance(cls, type) and issubclass(cls, Action) and cls is not Action


def require_action(action: object) -> type[Action]:
    """Return an action class.

    Raises:
        TypeError: It is something else.
    """
    if not is_action_type(action):
        raise TypeError(
            f"Expected an action class, such as example_interfaces.action.Fibonacci; got {action!r}"
        )
    return cast("type[Action]", action)


@cache
def action_types(action: type[Action]) -> ActionTypes:
    """Return the types derived from an action; they are made once.

    Raises:
        TypeError: `action` is not an action class.
    """
    parts: Any = require_action(action)
    name = type_name(action)
    goal_id = {"goal_id": (UUID, UUID)}
    return ActionTypes(
        send_goal=_service(
            action,
            f"{name}_SendGoal",
            {**goal_id, "goal": (parts.Goal, parts.Goal)},
            {"accepted": (bool, False), "stamp": (Time, Time)},
        ),
        get_result=_service(
            action,
            f"{name}_GetResult",
            goal_id,
            {"status": (int8, 0), "result": (parts.Result, parts.Result)},
        ),
        feedback_message=message_class(
            action,
            f"{name}_FeedbackMessage",
            {**goal_id, "feedback": (parts.Feedback, parts.Feedback)},
        ),
    )


@cache
def action_impl(action: Any) -> ActionImpl:
    """Return the services and messages that carry an action, by ROS's names.

    Raises:
        TypeError: `action` is not an action class.
    """
    from actors.interfaces.action_msgs.msg import GoalStatusArray  # noqa: PLC0415 - seldom needed
    from actors.interfaces.action_msgs.srv import CancelGoal  # noqa: PLC0415 - seldom needed

    types = action_types(action)
    return ActionImpl(types.send_goal, types.get_result, types.feedback_message, CancelGoal, GoalStatusArray)

"""The types that an action implies."""

from __future__ import annotations

from typing import Any

import pytest

from actors.interfaces.action import action_types
from actors.interfaces.codec import codec_for
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.message import Action, type_hash, type_name
from actors.interfaces.std_msgs.msg import String


def test_names_and_hashes_are_ros_2s() -> None:
    """As ROS 2 generates them for the same action."""
    types = action_types(Fibonacci)
    send_goal: Any = types.send_goal
    assert type_name(types.send_goal) == "example_interfaces/action/Fibonacci_SendGoal"
    assert type_name(types.get_result) == "example_interfaces/action/Fibonacci_GetResult"
    assert [
        type_hash(each)[7:15] for each in (types.send_goal, send_goal.Request, types.feedback_message)
    ] == [
        "d1a57fb2",
        "3d088942",
        "c1de71af",
    ]


def test_messages_travel() -> None:
    """Defaults, assignment, round trip."""
    types: Any = action_types(Fibonacci)
    assert action_types(Fibonacci) is action_types(Fibonacci)
    request = types.send_goal.Request(goal=Fibonacci.Goal(order=5))
    codec: Any = codec_for(types.send_goal.Request)
    assert codec.decode(codec.encode(request)) == request
    assert types.get_result.Response().status == 0
    assert types.send_goal.Request().goal is not types.send_goal.Request().goal


@pytest.mark.parametrize("wrong", [Action, AddTwoInts, String, "Fibonacci"])
def test_only_actions(wrong: Any) -> None:
    """Anything else is told what to pass."""
    with pytest.raises(TypeError, match="Expected an action class"):
        action_types(wrong)


def test_an_action_has_what_carries_it() -> None:
    """`Impl` has ROS 2's names; it is made once."""
    types = action_types(Fibonacci)
    impl = Fibonacci.Impl
    assert impl is Fibonacci.Impl
    assert (impl.SendGoalService, impl.GetResultService, impl.FeedbackMessage) == (
        types.send_goal,
        types.get_result,
        types.feedback_message,
    )
    assert type_name(impl.CancelGoalService) == "action_msgs/srv/CancelGoal"
    assert type_name(impl.GoalStatusMessage) == "action_msgs/msg/GoalStatusArray"

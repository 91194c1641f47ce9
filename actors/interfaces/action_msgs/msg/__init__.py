"""Messages of action_msgs."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.action_msgs.msg._goal_info import GoalInfo
    from actors.interfaces.action_msgs.msg._goal_status import GoalStatus
    from actors.interfaces.action_msgs.msg._goal_status_array import GoalStatusArray

__all__ = [
    "GoalInfo",
    "GoalStatus",
    "GoalStatusArray",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "GoalInfo": "_goal_info",
            "GoalStatus": "_goal_status",
            "GoalStatusArray": "_goal_status_array",
        },
    )

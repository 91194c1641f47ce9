"""Services of action_msgs."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.action_msgs.srv._cancel_goal import CancelGoal

__all__ = [
    "CancelGoal",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "CancelGoal": "_cancel_goal",
        },
    )

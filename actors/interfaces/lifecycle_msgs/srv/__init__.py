"""Services of lifecycle_msgs."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.lifecycle_msgs.srv._change_state import ChangeState
    from actors.interfaces.lifecycle_msgs.srv._get_available_states import GetAvailableStates
    from actors.interfaces.lifecycle_msgs.srv._get_available_transitions import GetAvailableTransitions
    from actors.interfaces.lifecycle_msgs.srv._get_state import GetState

__all__ = [
    "ChangeState",
    "GetAvailableStates",
    "GetAvailableTransitions",
    "GetState",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "ChangeState": "_change_state",
            "GetAvailableStates": "_get_available_states",
            "GetAvailableTransitions": "_get_available_transitions",
            "GetState": "_get_state",
        },
    )

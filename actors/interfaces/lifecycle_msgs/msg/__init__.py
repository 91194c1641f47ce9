"""Messages of lifecycle_msgs."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.lifecycle_msgs.msg._state import State
    from actors.interfaces.lifecycle_msgs.msg._transition import Transition
    from actors.interfaces.lifecycle_msgs.msg._transition_description import TransitionDescription
    from actors.interfaces.lifecycle_msgs.msg._transition_event import TransitionEvent

__all__ = [
    "State",
    "Transition",
    "TransitionDescription",
    "TransitionEvent",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "State": "_state",
            "Transition": "_transition",
            "TransitionDescription": "_transition_description",
            "TransitionEvent": "_transition_event",
        },
    )

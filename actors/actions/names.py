"""The names of the services and topics of an action. Pure."""

from __future__ import annotations

from typing import NamedTuple


class ActionNames(NamedTuple):
    """The names of an action's services and topics."""

    send_goal: str
    cancel_goal: str
    get_result: str
    feedback: str
    status: str

    @classmethod
    def of(cls, action: str) -> ActionNames:
        """Return the names for the full name of an action."""
        # ROS 2's hidden names: other tools recognise actions by `/_action/`.
        return cls(*(f"{action}/_action/{field}" for field in cls._fields))

"""The states of a goal and the legal transitions between them, as a table. Pure."""

from __future__ import annotations

from enum import Enum, IntEnum, auto
from typing import Final

from actors.errors import InvalidGoalTransitionError


class GoalState(IntEnum):
    """The state of a goal, with the numbers of action_msgs/msg/GoalStatus."""

    UNKNOWN = 0
    ACCEPTED = 1
    EXECUTING = 2
    CANCELING = 3
    SUCCEEDED = 4
    CANCELED = 5
    ABORTED = 6

    @property
    def is_terminal(self) -> bool:
        """Whether the goal has ended."""
        return self >= GoalState.SUCCEEDED


STATES: Final = frozenset(GoalState)
TERMINAL_STATES: Final = frozenset(state for state in GoalState if state.is_terminal)


class GoalEvent(Enum):
    """The events that change the state of a goal."""

    EXECUTE = auto()
    CANCEL_GOAL = auto()
    SUCCEED = auto()
    ABORT = auto()
    CANCELED = auto()


# A goal that is being cancelled may still succeed or abort: the request may have come too late, and the
# server knows best.
TRANSITIONS: Final = {
    (GoalState.ACCEPTED, GoalEvent.EXECUTE): GoalState.EXECUTING,
    (GoalState.ACCEPTED, GoalEvent.CANCEL_GOAL): GoalState.CANCELING,
    (GoalState.ACCEPTED, GoalEvent.ABORT): GoalState.ABORTED,
    (GoalState.EXECUTING, GoalEvent.CANCEL_GOAL): GoalState.CANCELING,
    (GoalState.EXECUTING, GoalEvent.SUCCEED): GoalState.SUCCEEDED,
    (GoalState.EXECUTING, GoalEvent.ABORT): GoalState.ABORTED,
    (GoalState.CANCELING, GoalEvent.SUCCEED): GoalState.SUCCEEDED,
    (GoalState.CANCELING, GoalEvent.ABORT): GoalState.ABORTED,
    (GoalState.CANCELING, GoalEvent.CANCELED): GoalState.CANCELED,
}
"""ROS's table, and one more: a goal that was accepted but never executed can be aborted."""


def next_state(state: GoalState, event: GoalEvent) -> GoalState:
    """Return the state after an event.

    Raises:
        InvalidGoalTransitionError: The event cannot happen in this state.
    """
    try:
        return TRANSITIONS[state, event]
    except KeyError:
        raise InvalidGoalTransitionError(
            f"{event.name} is not possible for a goal that is {state.name}"
        ) from None

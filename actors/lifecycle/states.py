"""The states of a node, and the transitions between them, with the numbers and labels of rcl_lifecycle.

A node rests in a primary state (unconfigured, inactive, active, finalized). A requested transition leads into
a transition state (such as configuring), in which a callback runs. The callback's result is the transition
out of it: success, failure, or error, after which `on_error` runs in the state errorprocessing.
"""

from __future__ import annotations

import enum
from typing import Final, NamedTuple

from actors.lifecycle.errors import InvalidTransitionError
from proto.untrusted_text import escape


class TransitionCallbackReturn(enum.IntEnum):
    """The result of a transition's callback, with ROS 2's numbers."""

    SUCCESS = 97
    """The transition is done."""
    FAILURE = 98
    """The node stays in the state that it was in; a shutdown goes on all the same."""
    ERROR = 99
    """`on_error` is called, and decides between unconfigured (SUCCESS) and finalized."""

    def to_label(self) -> str:
        """Return the label of the transition that follows.

        Returns:
            "transition_success", "transition_failure" or "transition_error".
        """
        return f"transition_{self.name.lower()}"


class LifecycleState(NamedTuple):
    """A state, as callbacks and `current_state` give it."""

    label: str
    """Such as "inactive"."""
    state_id: int
    """A constant of lifecycle_msgs/msg/State."""


class Transition(NamedTuple):
    """A transition between two states."""

    id: int
    """A constant of lifecycle_msgs/msg/Transition."""
    label: str
    """Such as "configure"."""
    start: LifecycleState
    goal: LifecycleState


UNKNOWN: Final = LifecycleState("unknown", 0)
UNCONFIGURED: Final = LifecycleState("unconfigured", 1)
INACTIVE: Final = LifecycleState("inactive", 2)
ACTIVE: Final = LifecycleState("active", 3)
FINALIZED: Final = LifecycleState("finalized", 4)
CONFIGURING: Final = LifecycleState("configuring", 10)
CLEANINGUP: Final = LifecycleState("cleaningup", 11)
SHUTTINGDOWN: Final = LifecycleState("shuttingdown", 12)
ACTIVATING: Final = LifecycleState("activating", 13)
DEACTIVATING: Final = LifecycleState("deactivating", 14)
ERRORPROCESSING: Final = LifecycleState("errorprocessing", 15)

STATES: Final = (
    UNKNOWN, UNCONFIGURED, INACTIVE, ACTIVE, FINALIZED,
    CONFIGURING, CLEANINGUP, SHUTTINGDOWN, ACTIVATING, DEACTIVATING, ERRORPROCESSING,
)  # fmt: skip

REQUESTS: Final = (
    Transition(1, "configure", UNCONFIGURED, CONFIGURING),
    Transition(2, "cleanup", INACTIVE, CLEANINGUP),
    Transition(3, "activate", INACTIVE, ACTIVATING),
    Transition(4, "deactivate", ACTIVE, DEACTIVATING),
    Transition(5, "shutdown", UNCONFIGURED, SHUTTINGDOWN),
    Transition(6, "shutdown", INACTIVE, SHUTTINGDOWN),
    Transition(7, "shutdown", ACTIVE, SHUTTINGDOWN),
)
"""The transitions that can be requested of a node."""


def _results(first: int, start: LifecycleState, *goals: LifecycleState) -> tuple[Transition, ...]:
    """Return the transitions that follow success, failure and error of the callback of a state."""
    labels = (each.to_label() for each in TransitionCallbackReturn)
    return tuple(
        Transition(number, label, start, goal)
        for number, (label, goal) in enumerate(zip(labels, goals, strict=True), first)
    )


TRANSITIONS: Final = (
    *REQUESTS,
    *_results(10, CONFIGURING, INACTIVE, UNCONFIGURED, ERRORPROCESSING),
    *_results(20, CLEANINGUP, UNCONFIGURED, INACTIVE, ERRORPROCESSING),
    *_results(30, ACTIVATING, ACTIVE, INACTIVE, ERRORPROCESSING),
    *_results(40, DEACTIVATING, INACTIVE, ACTIVE, ERRORPROCESSING),
    *_results(50, SHUTTINGDOWN, FINALIZED, FINALIZED, ERRORPROCESSING),
    *_results(60, ERRORPROCESSING, UNCONFIGURED, FINALIZED, FINALIZED),
)

CALLBACKS: Final = {
    CONFIGURING: "on_configure",
    CLEANINGUP: "on_cleanup",
    SHUTTINGDOWN: "on_shutdown",
    ACTIVATING: "on_activate",
    DEACTIVATING: "on_deactivate",
    ERRORPROCESSING: "on_error",
}
"""The method that runs in each transition state."""


class StateMachine:
    """The state of one node.

    Attributes:
        current: The state.
    """

    def __init__(self) -> None:
        self.current = UNCONFIGURED

    def available(self) -> list[Transition]:
        """Return the transitions that begin in the current state."""
        return [each for each in TRANSITIONS if each.start == self.current]

    def request(self, wanted: int | str) -> Transition:
        """Begin a transition, into a transition state.

        Args:
            wanted: Its number or label.

        Returns:
            The transition.

        Raises:
            InvalidTransitionError: It does not begin in the current state, or another one runs.
        """
        # Not `available()`: what follows a callback cannot be requested from outside.
        possible = [each for each in REQUESTS if each.start == self.current]
        for transition in possible:
            if wanted in {transition.id, transition.label}:
                # Changed before the callback runs: a second request in the meantime is refused.
                self.current = transition.goal
                return transition
        names = ", ".join(each.label for each in possible) or "none"
        raise InvalidTransitionError(
            f"Transition '{escape(str(wanted))}' is not possible in state '{self.current.label}'"
            f" (possible: {names})"
        )

    def finish(self, result: TransitionCallbackReturn) -> Transition:
        """Leave a transition state.

        Args:
            result: The result of the state's callback.

        Returns:
            The transition.
        """
        # By label, which is unique among the transitions of one state.
        (transition,) = (each for each in self.available() if each.label == result.to_label())
        self.current = transition.goal
        return transition

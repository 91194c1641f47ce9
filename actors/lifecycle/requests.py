"""Answers requests of other nodes about a node's states, and describes transitions as messages. No I/O."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actors.interfaces.lifecycle_msgs import msg, srv
from actors.lifecycle.states import STATES, TRANSITIONS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from actors.lifecycle.states import LifecycleState, StateMachine, Transition


class StateRequests:
    """Handles requests about the states of one node.

    Args:
        machine: Its state machine.
    """

    def __init__(self, machine: StateMachine) -> None:
        self._machine = machine

    def handlers(self) -> tuple[tuple[str, Any, Callable[[Any], Any]], ...]:
        """Return the name of each service below the node's, its type, and its handler."""
        return (
            ("get_state", srv.GetState, self._get_state),
            ("get_available_states", srv.GetAvailableStates, self._get_available_states),
            ("get_available_transitions", srv.GetAvailableTransitions, self._get_available_transitions),
            ("get_transition_graph", srv.GetAvailableTransitions, self._get_transition_graph),
        )

    def _get_state(self, request: srv.GetState.Request) -> srv.GetState.Response:
        del request
        return srv.GetState.Response(current_state=_state(self._machine.current))

    def _get_available_states(
        self, request: srv.GetAvailableStates.Request
    ) -> srv.GetAvailableStates.Response:
        del request
        return srv.GetAvailableStates.Response(available_states=[_state(each) for each in STATES])

    def _get_available_transitions(
        self, request: srv.GetAvailableTransitions.Request
    ) -> srv.GetAvailableTransitions.Response:
        del request
        # Includes the outcomes of a running transition, as ROS 2's does; they cannot be requested.
        return _response(self._machine.available())

    def _get_transition_graph(
        self, request: srv.GetAvailableTransitions.Request
    ) -> srv.GetAvailableTransitions.Response:
        del request
        return _response(TRANSITIONS)


def transition_event(transition: Transition, timestamp: int) -> msg.TransitionEvent:
    """Return the message for `~/transition_event`.

    Args:
        transition: The transition.
        timestamp: Its time, in ns since 1970.
    """
    described = _describe(transition)
    return msg.TransitionEvent(
        timestamp=timestamp,
        transition=described.transition,
        start_state=described.start_state,
        goal_state=described.goal_state,
    )


def _response(transitions: Iterable[Transition]) -> srv.GetAvailableTransitions.Response:
    return srv.GetAvailableTransitions.Response(
        available_transitions=[_describe(each) for each in transitions]
    )


def _describe(transition: Transition) -> msg.TransitionDescription:
    return msg.TransitionDescription(
        transition=msg.Transition(id=transition.id, label=transition.label),
        start_state=_state(transition.start),
        goal_state=_state(transition.goal),
    )


def _state(state: LifecycleState) -> msg.State:
    return msg.State(id=state.state_id, label=state.label)

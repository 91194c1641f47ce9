"""Goal states: their numbers, and which transitions are legal."""

from __future__ import annotations

import pytest

import actors
from actors.actions.states import TRANSITIONS, GoalEvent, GoalState, next_state
from actors.interfaces.action_msgs.msg import GoalStatus


def test_the_numbers_are_those_of_ros() -> None:
    """Each state has the number of its constant in action_msgs/msg/GoalStatus."""
    for state in GoalState:
        assert getattr(GoalStatus, f"STATUS_{state.name}") == state


def test_only_the_transitions_of_the_table_are_legal() -> None:
    """Every other pair is an error that names the state, and ended goals never change."""
    for state in GoalState:
        for event in GoalEvent:
            if (state, event) in TRANSITIONS:
                assert not state.is_terminal
                assert next_state(state, event) == TRANSITIONS[state, event]
            else:
                with pytest.raises(actors.InvalidGoalTransitionError, match=state.name):
                    next_state(state, event)

"""The state machine, as data and step by step."""

from __future__ import annotations

import pytest

from actors.interfaces.lifecycle_msgs import msg
from actors.lifecycle.errors import InvalidTransitionError
from actors.lifecycle.states import STATES, TRANSITIONS, StateMachine, TransitionCallbackReturn

SUCCESS, FAILURE, ERROR = TransitionCallbackReturn


def test_numbers_are_those_of_lifecycle_msgs() -> None:
    """Every state has the number of its constant, every transition too."""
    constants = {
        name.split("_STATE_")[1].lower(): value
        for name, value in vars(msg.State).items()
        if "_STATE_" in name
    }
    assert {each.label: each.state_id for each in STATES} == constants
    numbers = {
        value
        for name, value in vars(msg.Transition).items()
        if name.startswith("TRANSITION_") and name not in {"TRANSITION_CREATE", "TRANSITION_DESTROY"}
    }
    assert {each.id for each in TRANSITIONS} | {97, 98, 99} == numbers
    assert list(TransitionCallbackReturn) == [97, 98, 99]
    for each in TRANSITIONS[:7]:
        suffix = f"{each.start.label}_shutdown" if each.label == "shutdown" else each.label
        assert getattr(msg.Transition, f"TRANSITION_{suffix.upper()}") == each.id


@pytest.mark.parametrize(
    ("path", "wanted", "results", "state"),
    [
        ("", "configure", [SUCCESS], "inactive"),
        ("", "configure", [FAILURE], "unconfigured"),
        ("", "configure", [ERROR, SUCCESS], "unconfigured"),
        ("", "configure", [ERROR, FAILURE], "finalized"),
        ("", "configure", [ERROR, ERROR], "finalized"),
        ("configure", "cleanup", [SUCCESS], "unconfigured"),
        ("configure", "cleanup", [FAILURE], "inactive"),
        ("configure", "cleanup", [ERROR, SUCCESS], "unconfigured"),
        ("configure", "activate", [SUCCESS], "active"),
        ("configure", "activate", [FAILURE], "inactive"),
        ("configure", "activate", [ERROR, FAILURE], "finalized"),
        ("configure activate", "deactivate", [SUCCESS], "inactive"),
        ("configure activate", "deactivate", [FAILURE], "active"),
        ("configure activate", "deactivate", [ERROR, SUCCESS], "unconfigured"),
        ("", 5, [SUCCESS], "finalized"),
        ("configure", 6, [SUCCESS], "finalized"),
        ("configure activate", 7, [SUCCESS], "finalized"),
        ("configure activate", "shutdown", [ERROR, ERROR], "finalized"),
        ("configure", "shutdown", [FAILURE], "finalized"),
        ("", "shutdown", [ERROR, SUCCESS], "unconfigured"),
    ],
)
def test_transitions(
    path: str, wanted: int | str, results: list[TransitionCallbackReturn], state: str
) -> None:
    """Where each result of a callback leads to."""
    machine = StateMachine()
    for each in path.split():
        machine.request(each)
        machine.finish(SUCCESS)
    machine.request(wanted)
    for result in results:
        machine.finish(result)
    assert machine.current.label == state


@pytest.mark.parametrize("wanted", ["activate", "transition_success", "", "no\nsuch", 10, 0, 6, 300])
def test_impossible_transitions(wanted: int | str) -> None:
    """The state stays as it is, and the error names what is possible."""
    machine = StateMachine()
    with pytest.raises(InvalidTransitionError, match=r"'unconfigured' \(possible: configure, shutdown\)$"):
        machine.request(wanted)
    assert machine.current.label == "unconfigured"


def test_only_results_leave_a_transition_state() -> None:
    """Neither another transition nor the number of a result can be requested while one runs."""
    machine = StateMachine()
    machine.request("configure")
    for wanted in ("configure", "shutdown", "transition_success", 10):
        with pytest.raises(InvalidTransitionError, match=r"'configuring' \(possible: none\)"):
            machine.request(wanted)
    assert [each.id for each in machine.available()] == [10, 11, 12]

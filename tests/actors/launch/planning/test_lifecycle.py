"""Which transitions of which nodes a description requests, and to which it reacts."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from actors.launch.description.actions import (
    EmitEvent,
    GroupAction,
    LogInfo,
    PushNamespace,
    RegisterEventHandler,
)
from actors.launch.description.description import LaunchDescription
from actors.launch.description.event_handlers import OnStateTransition
from actors.launch.description.lifecycle import (
    ChangeState,
    LifecycleNode,
    LifecycleTransition,
    matches_action,
)
from actors.launch.errors import LaunchError
from actors.launch.planning.events import StateTransition
from actors.launch.planning.plan import make_plan
from actors.launch.planning.process_spec import LifecycleSpec
from actors.launch.planning.steps import AddHandler, ChangeStates, Start, Step
from tests.actors.launch.event_samples import spec, started
from tests.actors.launch.fake_library import FakeLibrary

if TYPE_CHECKING:
    from actors.launch.description.action import Action

CAMERA = LifecycleNode(script="camera.py", name="camera")


def plan(*actions: Action) -> list[Step]:
    """Return what actions come to."""
    return make_plan(LaunchDescription(actions), FakeLibrary(), arguments={}, environment={}, folder="/files")


def test_a_lifecycle_node_is_a_process_with_a_timeout() -> None:
    """With autostart it is configured and activated."""
    auto = LifecycleNode(script="a.py", name="a", namespace="ns", autostart="True", transition_timeout="3")
    first, second = (step.process for step in plan(CAMERA, auto) if isinstance(step, Start))
    assert (first.node, first.lifecycle) == ("/camera", LifecycleSpec(autostart=(), timeout_sec=60))
    assert second.node == "/ns/a"
    assert second.lifecycle == LifecycleSpec(autostart=("configure", "activate"), timeout_sec=3)


def test_an_action_is_matched_by_identity() -> None:
    """`matches_action` chooses the process of this action, not that of an equal one."""
    twin = LifecycleNode(script="camera.py", name="camera")
    event = ChangeState(lifecycle_node_matcher=matches_action(CAMERA), transition_id=1)
    one, other, step = plan(CAMERA, twin, EmitEvent(event=event))[-3:]
    assert isinstance(one, Start)
    assert isinstance(other, Start)
    assert isinstance(step, ChangeStates)
    assert (step.what, step.transitions, step.calls) == ("LifecycleNode 'camera'", (1,), False)
    assert [step.matches(each.process) for each in (one, other)] == [True, False]


def test_a_function_chooses_by_the_action() -> None:
    """It is called later, and an error in it names it."""

    def broken(action: LifecycleNode) -> bool:
        raise OSError(f"no {action.name!s}")

    def chosen(action: LifecycleNode) -> bool:
        return action.name == "camera"

    events = [ChangeState(lifecycle_node_matcher=each, transition_id="shutdown") for each in (chosen, broken)]
    start, good, bad = plan(CAMERA, *(EmitEvent(event=each) for each in events))
    assert isinstance(start, Start)
    assert isinstance(good, ChangeStates)
    assert isinstance(bad, ChangeStates)
    assert (good.what, good.transitions) == ("nodes that chosen() chooses", ("shutdown",))
    assert good.calls
    assert good.matches(start.process)
    with pytest.raises(LaunchError, match=r"broken\(\): OSError: no camera"):
        bad.matches(start.process)


def test_names_are_relative_to_the_namespace() -> None:
    """LifecycleTransition becomes a step for each node, whose name is relative to the namespace."""
    action = LifecycleTransition(lifecycle_node_names=["camera", "/arm"], transition_ids=[1, "3", "cleanup"])
    steps = plan(GroupAction([PushNamespace("ns"), action]))
    assert all(isinstance(each, ChangeStates) for each in steps)
    first, second = (each for each in steps if isinstance(each, ChangeStates))
    assert (first.what, first.transitions) == ("/ns/camera", (1, 3, "cleanup"))
    assert (second.what, second.matches(spec(node="/arm"))) == ("/arm", True)
    assert not second.matches(spec(node="/ns/arm"))


@pytest.mark.parametrize(
    ("names", "transitions", "text"),
    [
        ([], [1], "No lifecycle_node_names provided."),
        (["a"], [], "No transition_ids provided."),
        (["a"], [8], "Given transition_id '8' is invalid."),
        (["a"], ["actvate"], "Given transition_id 'actvate' is invalid; did you mean 'activate'?"),
    ],
)
def test_wrong_transitions_are_mistakes(names: list[str], transitions: list[int | str], text: str) -> None:
    """They are found before anything is started."""
    with pytest.raises(LaunchError) as caught:
        plan(LifecycleTransition(lifecycle_node_names=names, transition_ids=transitions))
    assert str(caught.value) == f"LifecycleTransition: {text}"


def test_a_handler_reacts_to_what_fits() -> None:
    """A handler reacts only if all of its conditions hold."""
    handler = OnStateTransition(
        target_lifecycle_node=CAMERA,
        transition="transition_success",
        start_state="configuring",
        goal_state="inactive",
        entities=[LogInfo(msg="ready")],
    )
    start, react = plan(CAMERA, RegisterEventHandler(handler))
    assert isinstance(start, Start)
    assert isinstance(react, AddHandler)
    assert react.what == (
        "camera changes its state"
        " (transition transition_success, start_state configuring, goal_state inactive)"
    )

    def fits(process: object = start.process, **facts: str) -> bool:
        labels = {"transition": "transition_success", "start_state": "configuring", "goal_state": "inactive"}
        return react.matches(StateTransition(process, 7, **{**labels, **facts}, timestamp=0))  # type: ignore[arg-type]

    assert fits()
    assert not fits(spec())
    assert not fits(transition="transition_failure")
    assert not fits(start_state="activating")
    assert not fits(goal_state="active")
    assert not react.matches(started(start.process))


def test_states_that_do_not_exist_are_mistakes() -> None:
    """A handler for one would never react."""
    handler = OnStateTransition(goal_state="actve", entities=[])
    with pytest.raises(LaunchError, match=r"goal_state: there is no 'actve'; did you mean 'active'\?"):
        plan(RegisterEventHandler(handler))


def test_a_handler_for_an_unknown_name_is_reported() -> None:
    """A handler for a process that does not exist is reported, as other handlers are."""
    first, *_ = plan(
        CAMERA, RegisterEventHandler(OnStateTransition(target_lifecycle_node="arm", entities=[]))
    )
    assert getattr(first, "text", "") == "An event handler is for 'arm', but no process has that name"

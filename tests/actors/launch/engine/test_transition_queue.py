"""Which transitions of lifecycle nodes a launch requests, and when."""

from __future__ import annotations

from typing import Any

from actors.launch.engine.effects import CancelTransition, RequestTransition
from actors.launch.engine.transition_queue import MAX_WAITING
from actors.launch.errors import LaunchError
from actors.launch.planning.events import ProcessStarted, ShuttingDown, StateTransition
from actors.launch.planning.process_spec import LifecycleSpec, ProcessSpec
from actors.launch.planning.steps import ChangeStates, LogText, Start
from tests.actors.launch.engine.test_machine import Play, process, start, whenever

FAILED = "Failed to make transition 'configure' for LifecycleNode '/a'"


def node(name: str = "a", *autostart: str, **options: Any) -> Start:
    """Return the step that starts a lifecycle node."""
    lifecycle = LifecycleSpec(autostart=autostart, timeout_sec=5)
    return start(name, node=f"/{name}", lifecycle=lifecycle, **options)


def change(*transitions: str, name: str = "a", **options: Any) -> ChangeStates:
    """Return the step that requests transitions of a node."""
    return ChangeStates(
        what=f"/{name}", matches=lambda spec: spec.name == name, transitions=transitions, **options
    )


def requests(play: Play) -> list[RequestTransition]:
    """Return what has been requested."""
    return [each for each in play.effects if isinstance(each, RequestTransition)]


def wanted(play: Play) -> list[Any]:
    """Return the transitions that have been requested."""
    return [each.transition for each in requests(play)]


def answer(play: Play, failure: str | None = None) -> None:
    """Answer the last request."""
    play.does(play.machine.transition_ended, requests(play)[-1], failure)


def test_a_sequence_is_requested_one_by_one() -> None:
    """From the start of the process on, each when the one before is done."""
    play = Play(node(), change("configure", "activate"), change("deactivate"))
    assert not requests(play)
    play.up()
    (first,) = requests(play)
    assert (first.label, first.node, first.transition, first.timeout_sec) == ("a-1", "/a", "configure", 5)
    answer(play)
    assert wanted(play) == ["configure", "activate"]
    answer(play)
    answer(play)
    assert wanted(play) == ["configure", "activate", "deactivate"]
    assert not play.said


def test_autostart_comes_first_and_again_after_a_respawn() -> None:
    """Before what was requested while the process did not run yet."""
    play = Play(node("a", "configure", "activate", respawn=True), change("deactivate"))
    play.up()
    for _ in range(3):
        answer(play)
    assert wanted(play) == ["configure", "activate", "deactivate"]
    play.ends(code=1)
    play.waits(1)
    play.up()
    assert wanted(play)[3:] == ["configure"]
    assert not play.said


def test_a_failure_is_logged_and_ends_its_sequence() -> None:
    """The rest of a failed sequence is not requested, and the next sequence is."""
    play = Play(node(), change("configure", "activate"), change("shutdown"))
    play.up()
    answer(play, "")
    assert play.said == [f"ERROR a-1: {FAILED}; not requested: activate"]
    assert wanted(play) == ["configure", "shutdown"]
    answer(play, "the broker is gone")
    assert play.said[1:] == [
        "ERROR a-1: Failed to make transition 'shutdown' for LifecycleNode '/a': the broker is gone"
    ]
    assert play.machine.succeeded


def test_the_end_of_the_process_gives_up() -> None:
    """The answer that arrives later is ignored; what does not wait for the node is said nothing of."""
    play = Play(node(), node("b"), change("configure"))
    play.up()
    play.up("b-1")
    play.ends(code=1)
    assert play.said == [f"ERROR a-1: {FAILED}: its process has ended"]
    (request,) = requests(play)
    assert CancelTransition(request) in play.effects
    answer(play, "late")
    play.ends("b-1")
    assert len(play.said) == 1


def test_a_node_that_never_starts_fails() -> None:
    """Its process could not be run, or waited for too long."""
    play = Play(node(), change("configure"))
    play.ends(code=127)
    assert play.said == [f"ERROR a-1: {FAILED}: its process has ended"]
    assert not requests(play)


def test_the_end_of_the_launch_abandons_transitions() -> None:
    """Those under way, and those that are requested then."""
    play = Play(
        node(), node("b"), whenever(ShuttingDown, change("shutdown")), change("configure", "activate")
    )
    play.up()
    play.up("b-1")
    effects = play.does(play.machine.stop, "enough")
    (request,) = requests(play)
    assert CancelTransition(request) in effects
    said = "WARN a-1: Abandoning wait for the '/a/change_state' service, due to shutdown."
    assert play.said == [said, said]
    play.ends()
    play.ends("b-1")
    assert play.machine.finished


def test_a_transition_of_nothing_is_reported() -> None:
    """A process without a lifecycle, and one that has ended, are nothing."""
    play = Play(start("plain"), node("b"), change("configure", name="plain"), change("configure"))
    assert play.said == [
        "WARN launch: no transition is requested: /plain does not run",
        "WARN launch: no transition is requested: /a does not run",
    ]


def test_a_function_chooses_nodes_when_it_has_returned() -> None:
    """A matcher function chooses nodes when it has returned; its error is one of the launch file."""
    play = Play(node(), node("b"), change("configure", name="b", calls=True))
    play.up("b-1")
    assert [each.node for each in requests(play)] == ["/b"]

    def fail(spec: ProcessSpec) -> bool:
        raise LaunchError(f"{spec.name} is wrong")

    play = Play(node(), ChangeStates(what="x", matches=fail, transitions=(1,), calls=True))
    assert play.machine.error == "a is wrong"


def test_too_many_sequences_are_refused() -> None:
    """A node's waiting sequences are limited, since handlers may request them in a circle."""
    play = Play(node(), *(change("configure") for _ in range(MAX_WAITING + 1)))
    assert play.said == [f"ERROR a-1: {FAILED}: {MAX_WAITING} others wait already"]


def test_handlers_react_to_state_transitions() -> None:
    """A handler's event has the process whose node has changed its state."""
    play = Play(node(), whenever(StateTransition, LogText(text="changed")))
    event = StateTransition(process(), 7, "configure", "unconfigured", "configuring", 0)
    play.does(play.machine.state_changed, event)
    assert play.told(StateTransition) == [event]
    assert play.said == ["INFO launch: changed"]


def test_a_handler_of_the_start_comes_after_autostart() -> None:
    """It is registered for the start, and autostart begins with that."""
    play = Play(node("a", "configure"), whenever(ProcessStarted, change("activate")))
    play.up()
    answer(play)
    assert wanted(play) == ["configure", "activate"]

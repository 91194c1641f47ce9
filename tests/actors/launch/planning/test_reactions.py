"""Event handlers and functions of a description: which events they are for, and what they give."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

import pytest

from actors.launch.description.actions import (
    DeclareLaunchArgument,
    GroupAction,
    LogInfo,
    OpaqueFunction,
    PushNamespace,
    RegisterEventHandler,
    Shutdown,
    TimerAction,
)
from actors.launch.description.description import LaunchDescription, format_actions
from actors.launch.description.event_handlers import (
    OnNodeUp,
    OnProcessExit,
    OnProcessIO,
    OnProcessStart,
    OnServiceAvailable,
    OnShutdown,
    OnTopicPublished,
)
from actors.launch.description.process_actions import ExecuteProcess, Node
from actors.launch.description.substitutions import LaunchConfiguration, LaunchContext
from actors.launch.errors import LaunchError
from actors.launch.planning.events import (
    Appeared,
    Event,
    ProcessExited,
    ProcessIO,
    ProcessStarted,
    ShuttingDown,
    Stream,
)
from actors.launch.planning.plan import make_plan
from actors.launch.planning.presence import Presence, PresenceKind
from actors.launch.planning.steps import AddHandler, Call, End, LogText, Start, Step
from actors.processes.outcome import outcome_of_exit
from tests.actors.launch.fake_library import FakeLibrary

if TYPE_CHECKING:
    from collections.abc import Sequence

    from actors.launch.description.action import Action, EventHandler

TALKER = ExecuteProcess(cmd=["talker"])
BYE = LogInfo(msg="bye")


def plan(*actions: Action) -> list[Step]:
    """Return what actions come to."""
    return make_plan(LaunchDescription(actions), FakeLibrary(), arguments={}, environment={}, folder="/files")


def only_react(*actions: Action) -> AddHandler:
    """Return the one reaction among what actions come to."""
    (react,) = (step for step in plan(*actions) if isinstance(step, AddHandler))
    return react


def handled(handler: EventHandler, *before: Action) -> AddHandler:
    """Return the reaction that a handler comes to, behind other actions."""
    return only_react(*before, RegisterEventHandler(handler))


def texts(steps: Sequence[Step]) -> list[str]:
    """Return what is reported, and the labels of what is started."""
    return [
        step.text if isinstance(step, LogText) else step.process.label
        for step in steps
        if isinstance(step, LogText | Start)
    ]


def events(*actions: Action) -> dict[str, list[Event]]:
    """Return events of each kind, of the processes that actions come to and of what is there."""
    specs = [step.process for step in plan(*actions) if isinstance(step, Start)]
    return {
        "start": [ProcessStarted(each, 1) for each in specs],
        "exit": [ProcessExited(each, 1, outcome_of_exit(3)) for each in specs],
        "io": [ProcessIO(each, 1, stream, (b"x",)) for each in specs for stream in Stream],
        "rest": [
            ShuttingDown("x"),
            *(Appeared(Presence(kind, "/ns/x")) for kind in PresenceKind),
            *(Appeared(Presence(kind, "/x")) for kind in PresenceKind),
        ],
    }


@pytest.mark.parametrize(
    ("handler", "kind", "what"),
    [
        (OnProcessStart(target_action=TALKER, on_start=BYE), ProcessStarted, "that ExecuteProcess starts"),
        (OnProcessExit(target_action=TALKER, on_exit=[BYE]), ProcessExited, "that ExecuteProcess exits"),
        (OnProcessExit(target_action="talker", on_exit=(BYE,)), ProcessExited, "talker exits"),
        (OnProcessExit(target_action="talker-1", on_exit=BYE), ProcessExited, "talker-1 exits"),
        (OnProcessIO(target_action=TALKER, on_output=BYE), ProcessIO, "that ExecuteProcess writes"),
    ],
)
def test_a_handler_is_for_events_of_one_process(handler: EventHandler, kind: type[Event], what: str) -> None:
    """By its action or its name; others of the same program do not count."""
    other = ExecuteProcess(cmd=["other"], name="talker-2")
    react = handled(handler, TALKER, other)
    found = [event for listed in events(TALKER, other).values() for event in listed if react.matches(event)]
    assert react.what == what
    assert found
    for event in found:
        assert isinstance(event, kind)
        assert event.process_name == "talker-1"  # type: ignore[attr-defined]
    assert texts(react.steps(found[0])) == texts(react.preview) == ["bye"]


def test_a_handler_without_a_target_is_for_all() -> None:
    """Any process will do."""
    react = handled(OnProcessExit(on_exit=BYE), TALKER, Node(script="a.py"))
    assert all(map(react.matches, events(TALKER, Node(script="a.py"))["exit"]))


@pytest.mark.parametrize(
    ("handler", "streams"),
    [
        (OnProcessIO(on_output=BYE), set(Stream)),
        (OnProcessIO(on_stdout=BYE), {Stream.STDOUT}),
        (OnProcessIO(on_stderr=BYE), {Stream.STDERR}),
    ],
)
def test_streams_are_told_apart_if_need_be(handler: EventHandler, streams: set[Stream]) -> None:
    """A handler for one of them says so; one for any does not."""
    react = handled(handler, TALKER)
    assert {each.stream for each in events(TALKER)["io"] if react.matches(each)} == streams  # type: ignore[attr-defined]
    assert react.split is (len(streams) == 1)


@pytest.mark.parametrize(
    ("handler", "awaited"),
    [
        (OnNodeUp(node="x", on_up=BYE), "node /ns/x"),
        (OnServiceAvailable(service="/x", on_available=BYE), "service /x"),
        (OnTopicPublished(topic=["x", ""], on_published=BYE), "topic /ns/x"),
        (OnNodeUp(node=Node(script="a.py", name="x", namespace="ns"), on_up=BYE), "node /ns/x"),
    ],
)
def test_handlers_for_what_is_there(handler: EventHandler, awaited: str) -> None:
    """Their names are seen from the namespace; a node may be given as its action."""
    before = [handler.node] if isinstance(handler, OnNodeUp) and isinstance(handler.node, Node) else []
    react = only_react(*before, GroupAction([PushNamespace("ns"), RegisterEventHandler(handler)]))
    found = [event for event in events()["rest"] if react.matches(event)]
    assert [str(each.presence) for each in found if isinstance(each, Appeared)] == [awaited]
    assert str(react.presence) == awaited


def test_the_end_can_be_reacted_to_once() -> None:
    """Once is for each handler to say."""
    react = handled(OnShutdown(on_shutdown=BYE, handle_once=True))
    assert [event for event in events()["rest"] if react.matches(event)] == [ShuttingDown("x")]
    assert react.once


def test_functions_react_with_what_they_take() -> None:
    """The event, or the event and the context; what they return is planned then, with labels of its own."""

    def with_context(event: ProcessExited, context: LaunchContext) -> list[Action]:
        return [LogInfo(msg=[f"{event.returncode} ", LaunchConfiguration("word")]), TALKER]

    word = DeclareLaunchArgument("word", default_value="hello")
    exited = events(TALKER)["exit"][0]
    react = handled(OnProcessExit(on_exit=with_context), word, TALKER)
    assert react.preview == ()
    assert texts(react.steps(exited)) == ["3 hello", "talker-2"]
    assert texts(react.steps(exited)) == ["3 hello", "talker-3"]
    short = handled(OnProcessExit(on_exit=lambda event: LogInfo(msg=str(event.returncode))))
    assert texts(short.steps(exited)) == ["3"]
    assert handled(OnProcessExit(on_exit=lambda event: None)).steps(exited) == []


def _raise(*args: object) -> None:
    raise ValueError("no such map")


def _leave(*args: object) -> None:
    raise SystemExit(4)


def _assert(*args: object) -> None:
    pytest.fail("no map")


def _cancel(*args: object) -> None:
    raise asyncio.CancelledError


def _two_lines(*args: object) -> None:
    raise ValueError("no such\nmap")


def _of_nothing() -> None:
    pass


def test_functions_may_be_generators() -> None:
    """What goes wrong in them is as in other functions."""
    exited = events(TALKER)["exit"][0]
    good: Any = lambda event: (BYE for _ in "ab")  # noqa: E731 - as people write it
    bad: Any = lambda event: (1 // 0 for _ in "a")  # noqa: E731
    assert texts(handled(OnProcessExit(on_exit=good)).steps(exited)) == ["bye"] * 2
    with pytest.raises(LaunchError, match="ZeroDivisionError"):
        handled(OnProcessExit(on_exit=bad)).steps(exited)


@pytest.mark.parametrize(
    ("function", "error"),
    [
        (_raise, "_raise(): ValueError: no such map"),
        (_two_lines, "_two_lines(): ValueError: no such map"),
        (_leave, "_leave(): SystemExit: 4"),
        (_assert, "_assert(): Failed: no map"),
        (_cancel, "_cancel(): CancelledError"),
        (_of_nothing, f"{__file__}, line {_of_nothing.__code__.co_firstlineno}: _of_nothing(): TypeError"),
        (lambda event: 7, "must return actions or None, not 7"),
        (lambda event: [7], "must return actions or None, not [7]"),
    ],
)
def test_a_function_that_fails_is_a_mistake_in_the_description(function: Any, error: str) -> None:
    """Whether it is called by a handler or for itself."""
    exited = events(TALKER)["exit"][0]
    with pytest.raises(LaunchError) as caught:
        handled(OnProcessExit(on_exit=function)).steps(exited)
    assert error in str(caught.value)
    with pytest.raises(LaunchError):
        plan(OpaqueFunction(function=function))


def test_functions_are_called_when_they_are_due() -> None:
    """At once where actions are taken at once; in a timer or for an event, then."""
    called: list[str] = []

    def function(context: LaunchContext, word: str, *, end: str) -> list[Action]:
        called.append(word)
        context.launch_configurations["set"] = word + end
        return [LogInfo(msg=[LaunchConfiguration("set")])]

    def opaque(word: str) -> OpaqueFunction:
        return OpaqueFunction(function=function, args=[word], kwargs={"end": "!"})

    first, later = plan(opaque("now"), TimerAction(period=2, actions=[opaque("later")]))
    assert texts([first]) == ["now!"]
    assert called == ["now"]
    assert isinstance(later, Call)
    assert (later.after_sec, later.name.rpartition(".")[2]) == (2, "function()")
    assert texts(later.steps()) == ["later!"]
    react = handled(OnProcessExit(on_exit=opaque("event")))
    (step,) = react.preview
    assert called == ["now", "later"]
    assert isinstance(step, Call)
    assert texts(step.steps()) == ["event!"]


def test_on_exit_belongs_to_its_process() -> None:
    """What is done whenever it ends; but a Shutdown alone makes it required."""
    (start,) = plan(ExecuteProcess(cmd=["a"], on_exit=[BYE, Shutdown(reason="x")]))
    assert isinstance(start, Start)
    assert not start.process.required
    react = start.on_exit
    assert react is not None
    said, end = react.preview
    assert isinstance(said, LogText)
    assert isinstance(end, End)
    (start,) = plan(ExecuteProcess(cmd=["a"], on_exit=[Shutdown()]))
    assert isinstance(start, Start)
    assert start.process.required
    assert start.on_exit is None


def test_what_a_function_makes_is_marked_and_sets_nothing_for_the_next() -> None:
    """Each call begins with what holds where the handler stands, so that nothing piles up."""
    seen: list[str] = []

    def function(event: Event, context: LaunchContext) -> list[Action]:
        seen.append(context.launch_configurations.get("count", "none"))
        context.launch_configurations["count"] = "one"
        return [TALKER]

    react = handled(OnProcessExit(on_exit=function), TALKER)
    exited = events(TALKER)["exit"][0]
    for _ in range(2):
        (start,) = react.steps(exited)
        assert isinstance(start, Start)
        assert start.process.made_later
    assert seen == ["none", "none"]
    (planned,) = (step for step in plan(TALKER) if isinstance(step, Start))
    assert not planned.process.made_later


@pytest.mark.parametrize(
    ("action", "error"),
    [
        (
            RegisterEventHandler(OnNodeUp(node=Node(script="a.py", name="a"), on_up=BYE)),
            "Node 'a' is a dependency, but is not started before that",
        ),
    ],
)
def test_what_is_no_handler_is_an_error(action: Action, error: str) -> None:
    """In one line."""
    with pytest.raises(LaunchError, match=error):
        plan(action)


def test_likely_mistakes_are_warned_of() -> None:
    """Two nodes of one name, and handlers for processes that nobody starts."""
    steps = plan(
        Node(script="a.py", name="a", namespace="ns"),
        Node(script="b.py", name="a", namespace="/ns"),
        Node(script="c.py", name="a"),
        RegisterEventHandler(OnProcessExit(target_action="bb", on_exit=BYE)),
        RegisterEventHandler(OnProcessExit(target_action="a", on_exit=Node(script="a.py", name="a"))),
    )
    assert [step.text for step in steps if isinstance(step, LogText) and step.warning] == [
        "An event handler is for 'bb', but no process has that name",
        "Two nodes have the name /ns/a: a-1 and a-2",
    ]


def test_a_description_shows_what_its_handlers_do() -> None:
    """Below them; what a function will give is not known."""
    lines = list(format_actions([RegisterEventHandler(OnProcessExit(target_action="a", on_exit=[BYE]))]))
    assert len(lines) == 2
    assert lines[1] == "    LogInfo(msg='bye')"

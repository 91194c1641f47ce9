"""The events that a handler reacts to, and the calls of its functions."""

from __future__ import annotations

import inspect
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, TypeAlias, cast

from actors.launch.description import event_handlers
from actors.launch.description.action import Action, EventHandler
from actors.launch.description.process_actions import ProcessAction
from actors.launch.description.summaries import function_name
from actors.launch.description.validation import excerpt
from actors.launch.errors import LaunchError
from actors.launch.planning import events
from actors.launch.planning.dependencies import awaited
from actors.launch.planning.error_location import function_error, result_error
from actors.launch.planning.lifecycle import state_transitions
from actors.launch.planning.presence import Presence, PresenceKind
from actors.launch.planning.steps import AddHandler

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from actors.launch.description.action import Reaction
    from actors.launch.description.substitutions import LaunchContext
    from actors.launch.planning.dependencies import KnownNodes


Trigger: TypeAlias = "tuple[Reaction, AddHandler]"
"""A reaction that is not planned yet, and the step that adds its handler, without steps to carry out."""


def triggers(handler: EventHandler, context: LaunchContext, nodes: KnownNodes) -> list[Trigger]:
    """Return the reactions of a handler, and the events that they react to.

    Raises:
        LaunchError: It is of an unknown class, or waits for a node whose name is not known.
        InvalidNameError: The name that it waits for is not valid.
    """
    match handler:
        case event_handlers.OnProcessStart():
            found = [_of_process(handler.target_action, "starts", events.ProcessStarted, handler.on_start)]
        case event_handlers.OnProcessExit():
            found = [_of_process(handler.target_action, "exits", events.ProcessExited, handler.on_exit)]
        case event_handlers.OnProcessIO():
            found = _of_output(handler)
        case event_handlers.OnStateTransition():
            found = [_of_transition(handler, context)]
        case event_handlers.OnShutdown():
            found = [_trigger(handler.on_shutdown, "the launch ends", _is_shutdown)]
        case event_handlers.OnNodeUp(node=node):
            up = (
                nodes.presence(node)
                if isinstance(node, ProcessAction)
                else awaited(PresenceKind.NODE, node, context)
            )
            found = [_of_presence(handler.on_up, up)]
        case event_handlers.OnServiceAvailable(service=name):
            found = [_of_presence(handler.on_available, awaited(PresenceKind.SERVICE, name, context))]
        case event_handlers.OnTopicPublished(topic=name):
            found = [_of_presence(handler.on_published, awaited(PresenceKind.TOPIC, name, context))]
        case _ if callable(matcher := getattr(handler, "matcher", None)):
            found = [_trigger(getattr(handler, "entities", ()), "an event matches", cast("Any", matcher))]
        case _:
            raise LaunchError(f"{type(handler).__name__} is not an event handler")
    return [(reaction, replace(step, once=handler.handle_once)) for reaction, step in found]


def call_reaction(
    function: Callable[..., Any], event: events.Event, context: LaunchContext
) -> Sequence[Action]:
    """Call the function of a handler with the event, and the context if it has a second parameter.

    In ROS 2 handlers have both; many that were written for callboard need only the event.

    Raises:
        LaunchError: It fails, or returns something else than actions.
    """
    # The signature decides, not a failed call: a TypeError may come from inside of the function.
    try:
        inspect.signature(function).bind(event, context)
    except TypeError:
        return call_function(function, (event,), {}, context.file)
    except ValueError:  # a builtin without a signature
        pass
    return call_function(function, (event, context), {}, context.file)


def call_function(
    function: Callable[..., Any], args: Iterable[Any], kwargs: Mapping[str, Any], file: str | None
) -> Sequence[Action]:
    """Call a function of a description, and return its actions.

    Args:
        function: The function.
        args: Its positional arguments.
        kwargs: Its keyword arguments.
        file: The launch file, whose line an error names; None: the description comes from no file.

    Raises:
        LaunchError: It fails, or returns something else than actions.
    """
    try:
        given = function(*args, **kwargs)
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # also CancelledError, and those of pytest.fail and pytest.skip
        raise function_error(function, error, file) from error
    if given is None:
        return ()  # most functions only do something
    try:
        actions = (given,) if isinstance(given, Action) else tuple(given)
    except TypeError:
        actions = (None,)  # reported below, as other results that are not actions
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # it is a generator
        raise function_error(function, error, file) from error
    if not all(isinstance(each, Action) for each in actions):
        raise result_error(function, f"must return actions or None, not {excerpt(given)}")
    return cast("Sequence[Action]", actions)


def _trigger(
    reaction: Reaction, what: str, matches: Callable[[events.Event], bool], **options: Any
) -> Trigger:
    return reaction, AddHandler(what=what, matches=matches, steps=lambda _event: [], **options)


def _of_process(
    target: event_handlers.Target,
    verb: str,
    kind: type[events.ProcessEvent],
    reaction: Reaction,
    condition: Callable[[Any], bool] | None = None,
    **options: Any,
) -> Trigger:
    def matches(event: events.Event) -> bool:
        if not isinstance(event, kind) or (condition is not None and not condition(event)):
            return False
        process = event.process
        if isinstance(target, str):
            return target in {process.name, process.label}
        if callable(target):
            return process.origin is not None and bool(target(process.origin))
        # By identity: two equal actions start two processes.
        return target is None or process.origin is target

    return _trigger(reaction, f"{_target_name(target)} {verb}", matches, **options)


def _of_output(handler: event_handlers.OnProcessIO) -> list[Trigger]:
    target = handler.target_action
    # A handler for one stream needs them separate; one for both gets them in the order of their lines.
    found: list[Trigger] = []
    if handler.on_output is not None:
        found.append(_of_process(target, "writes", events.ProcessIO, handler.on_output))
    for reaction, stream in (
        (handler.on_stdout, events.Stream.STDOUT),
        (handler.on_stderr, events.Stream.STDERR),
    ):
        if reaction is not None:
            verb, condition = f"writes to {stream.value}", partial(_is_of_stream, stream)
            found.append(_of_process(target, verb, events.ProcessIO, reaction, condition, split=True))
    return found


def _is_of_stream(stream: events.Stream, event: events.ProcessIO) -> bool:
    return event.stream is stream


def _of_transition(handler: event_handlers.OnStateTransition, context: LaunchContext) -> Trigger:
    condition, texts = state_transitions(handler, context)
    verb = "changes its state" + (f" ({', '.join(texts)})" if texts else "")
    return _of_process(
        handler.target_lifecycle_node, verb, events.StateTransition, handler.entities, condition
    )


def _is_shutdown(event: events.Event) -> bool:
    return isinstance(event, events.ShuttingDown)


def _of_presence(reaction: Reaction, awaited: Presence) -> Trigger:
    def matches(event: events.Event) -> bool:
        return isinstance(event, events.Appeared) and event.presence == awaited

    return _trigger(reaction, f"{awaited} is there", matches, presence=awaited)


def _target_name(target: event_handlers.Target) -> str:
    if target is None:
        return "a process"
    if isinstance(target, str):
        return target
    if callable(target):
        return f"a process that {function_name(target)} chooses"
    name = getattr(target, "name", None)
    return name if isinstance(name, str) else f"that {type(target).__name__}"

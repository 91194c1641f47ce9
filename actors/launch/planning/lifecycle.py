"""The transitions of lifecycle nodes that a description requests, and those that it reacts to."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.launch.description.lifecycle import matches_action, matches_node_name
from actors.launch.description.substitutions import resolve
from actors.launch.description.summaries import action_label, function_name
from actors.launch.errors import LaunchError
from actors.launch.planning.dependencies import awaited
from actors.launch.planning.error_location import function_error
from actors.launch.planning.presence import PresenceKind
from actors.launch.planning.steps import ChangeStates
from actors.lifecycle.states import REQUESTS, STATES, TRANSITIONS
from actors.tools.suggestions import did_you_mean
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from actors.launch.description.event_handlers import OnStateTransition
    from actors.launch.description.lifecycle import ChangeState, LifecycleTransition, Matcher
    from actors.launch.description.substitutions import LaunchContext, Text
    from actors.launch.planning.events import StateTransition
    from actors.launch.planning.process_spec import ProcessSpec
    from actors.launch.planning.steps import Step


def change_state(event: ChangeState, context: LaunchContext) -> Step:
    """Return the step that requests the transition of an event.

    Raises:
        LaunchError: There is no such transition.
    """
    matcher: Matcher = event.lifecycle_node_matcher
    transitions = (_transition(event.transition_id, context),)  # now, so that a wrong one is found at once
    if isinstance(matcher, matches_action):
        action = matcher.action
        # By identity: two equal actions start two nodes.
        return ChangeStates(
            what=action_label(action), matches=lambda spec: spec.origin is action, transitions=transitions
        )
    if isinstance(matcher, matches_node_name):
        node = awaited(PresenceKind.NODE, matcher.node_name, context).name
        return ChangeStates(what=node, matches=_has_name(node), transitions=transitions)

    def matches(spec: ProcessSpec) -> bool:
        try:
            return bool(matcher(spec.origin))
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # as of other functions of a description
            raise function_error(matcher, error, context.file) from error

    what = f"nodes that {function_name(matcher)} chooses"
    return ChangeStates(what=what, matches=matches, transitions=transitions, calls=True)


def lifecycle_transition(action: LifecycleTransition, context: LaunchContext) -> list[Step]:
    """Return the steps that request the transitions of an action, one for each node.

    Raises:
        LaunchError: There is no such transition, or no node or transition is given.
        InvalidNameError: No node can have that name.
    """
    transitions = tuple(_transition(each, context) for each in action.transition_ids)
    if not action.lifecycle_node_names:
        raise LaunchError("No lifecycle_node_names provided.")
    if not transitions:
        raise LaunchError("No transition_ids provided.")
    # One step for each node: a transition that fails for one does not keep the others from theirs.
    nodes = [awaited(PresenceKind.NODE, each, context).name for each in action.lifecycle_node_names]
    return [ChangeStates(what=node, matches=_has_name(node), transitions=transitions) for node in nodes]


def state_transitions(
    handler: OnStateTransition, context: LaunchContext
) -> tuple[Callable[[StateTransition], bool], list[str]]:
    """Return a function that matches the state transitions of a handler, and its conditions for messages.

    Raises:
        LaunchError: There is no such state or transition.
    """
    states = {each.label for each in STATES}
    labels = {each.label for each in TRANSITIONS}
    given = {
        "transition": _label("transition", handler.transition, labels, context),
        "start_state": _label("start_state", handler.start_state, states, context),
        "goal_state": _label("goal_state", handler.goal_state, states, context),
    }
    wanted = {name: value for name, value in given.items() if value is not None}

    def matches(event: StateTransition) -> bool:
        return all(getattr(event, name) == value for name, value in wanted.items())

    return matches, [f"{name} {value}" for name, value in wanted.items()]


def transition_label(transition: int | str) -> str:
    """Return the label of a transition that is given by its id or label."""
    return next((each.label for each in REQUESTS if each.id == transition), str(transition))


def _has_name(node: str) -> Callable[[ProcessSpec], bool]:
    return lambda spec: spec.node == node


def _transition(given: int | Text, context: LaunchContext) -> int | str:
    """Return the id or label of a transition that can be requested."""
    # Three transitions have the label "shutdown", so a label is not turned into an id: the node knows its
    # state.
    text = str(given) if isinstance(given, int) else resolve(given, context)
    labels = {each.label for each in REQUESTS}
    if text in labels:
        return text
    if text not in {str(each.id) for each in REQUESTS}:
        raise LaunchError(
            f"Given transition_id '{escape(text)}' is invalid{did_you_mean(text, labels) or '.'}"
        )
    return int(text)


def _label(what: str, given: Text | None, known: Iterable[str], context: LaunchContext) -> str | None:
    text = None if given is None else resolve(given, context)
    if text is not None and text not in known:
        raise LaunchError(f"{what}: there is no '{escape(text)}'{did_you_mean(text, sorted(known))}")
    return text

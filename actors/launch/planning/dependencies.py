"""The nodes, topics and services that a process depends on, by their full names."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, cast

from actors.launch.description.process_actions import Node, ProcessAction
from actors.launch.description.substitutions import Substitution, resolve
from actors.launch.description.summaries import action_label
from actors.launch.errors import LaunchError
from actors.launch.planning.namespaces import prefix_namespace
from actors.launch.planning.presence import Presence, PresenceKind
from proto.untrusted_text import escape
from proto.wire.names import normalize_namespace, validate_full_service_name, validate_full_topic_name

if TYPE_CHECKING:
    from collections.abc import Iterator

    from actors.launch.description.substitutions import LaunchContext, Text

MAX_KNOWN: Final = 10_000
"""Limit of remembered actions. Only a launch whose functions return actions in a loop reaches it."""


class KnownNodes:
    """The names of the nodes that have been planned, by their actions."""

    def __init__(self) -> None:
        # By identity: two equal actions start two nodes. The action is kept, so that its id is not reused.
        self._names: dict[int, tuple[ProcessAction, str | None]] = {}

    def add(self, action: ProcessAction, node: str | None) -> None:
        """Remember the name of the node of an action that has been planned; None: it is not known."""
        self._names[id(action)] = action, node
        if len(self._names) > MAX_KNOWN:
            del self._names[next(iter(self._names))]

    def presence(self, action: Node) -> Presence:
        """Return the presence of the node of an action.

        Raises:
            LaunchError: The action has not been planned, or its node's name is not known.
        """
        if id(action) not in self._names:
            raise LaunchError(f"{action_label(action)} is a dependency, but is not started before that")
        _, name = self._names[id(action)]
        if name is None:
            raise LaunchError(f"{action_label(action)} is a dependency, and needs a name=")
        return Presence(PresenceKind.NODE, name)


def dependencies(
    depends_on: Any, nodes: KnownNodes, context: LaunchContext, namespace: str | None
) -> tuple[Presence, ...]:
    """Return the dependencies of a process, each once.

    Args:
        depends_on: The option of that name.
        nodes: The nodes that have been planned before it.
        context: Where it is evaluated.
        namespace: The namespace that names are relative to; None: the root.

    Raises:
        LaunchError: It is malformed, or an action whose node's name is not known.
        InvalidNameError: A name is not valid.
    """
    listed = [depends_on] if isinstance(depends_on, str | Substitution | Node) else depends_on
    return tuple(dict.fromkeys(_presences(listed, nodes, context, namespace)))


def _presences(
    listed: Any, nodes: KnownNodes, context: LaunchContext, namespace: str | None
) -> Iterator[Presence]:
    for each in listed:
        if isinstance(each, Node):
            yield nodes.presence(each)
            continue
        text = resolve(cast("Text", each), context)
        word, _, name = text.strip().partition(" ")
        try:
            kind = PresenceKind(word)
        except ValueError:
            raise LaunchError(
                f"depends_on: '{escape(text)}' must be 'node NAME', 'topic NAME', 'service NAME' or a Node"
            ) from None
        yield presence(kind, name.strip(), namespace)


def awaited(kind: PresenceKind, name: Text, context: LaunchContext) -> Presence:
    """Return the presence with a name that is relative to the namespace of a context.

    Raises:
        LaunchError: A substitution has no value there.
        InvalidNameError: The name is not valid.
    """
    return presence(kind, resolve(name, context), context.namespace)


def presence(kind: PresenceKind, name: str, namespace: str | None) -> Presence:
    """Return the presence with a name that is relative to a namespace.

    Raises:
        InvalidNameError: The name is not valid.
    """
    # Checked here: a name that cannot exist would be waited for until the time limit.
    full = prefix_namespace(normalize_namespace(namespace or ""), name) or ""
    if kind is PresenceKind.SERVICE:
        validate_full_service_name(full)
    else:  # the rules for names of nodes and topics are the same
        validate_full_topic_name(full)
    return Presence(kind, full)

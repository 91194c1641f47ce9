"""Lifecycle nodes: start them, and request transitions of them. The names are launch_ros's."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, Final, TypeAlias

from actors.launch.description.action import Action
from actors.launch.description.options import option, required
from actors.launch.description.process_actions import Node, ProcessAction
from actors.launch.description.validation import Entity

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from actors.launch.description.substitutions import Text

Matcher: TypeAlias = "Callable[..., bool] | matches_node_name"

TRANSITION_TIMEOUT_SEC: Final = 60.0
"""Long enough for a callback that starts hardware."""


@dataclass(frozen=True, kw_only=True)
class LifecycleNode(Node, element="lifecycle_node"):
    """A program with a lifecycle node in it: its transitions can be requested, and cause events."""

    name: Text = field(metadata=required("The node's name."))
    autostart: bool | Text = option(
        False, "Whether to configure and activate the node each time that it has been started."
    )
    transition_timeout: float | Text = option(
        TRANSITION_TIMEOUT_SEC,
        "Seconds within which each transition must be done, including the time until the node is there.",
        unit="s",
        unlimited=True,
    )


@dataclass(frozen=True)
class matches_action(Entity):  # noqa: N801 - the name in ROS 2
    """Chooses the process that an action has started."""

    kind: ClassVar[str] = "matcher"

    action: ProcessAction = field(metadata=required("The action."))

    def __call__(self, action: ProcessAction) -> bool:
        """Return whether an action is this one.

        Args:
            action: The action to compare.

        Returns:
            True if it is the same object.
        """
        return action is self.action


@dataclass(frozen=True)
class matches_node_name(Entity):  # noqa: N801 - the name in ROS 2
    """Chooses the lifecycle node of a name."""

    kind: ClassVar[str] = "matcher"

    node_name: Text = field(
        metadata=required("The node's full name, or one relative to the current namespace.")
    )


@dataclass(frozen=True, kw_only=True)
class ChangeState(Entity):
    """Request a transition of lifecycle nodes: `EmitEvent(event=ChangeState(…))`.

    The launch requests it of those nodes that it has started, of each after the transitions that were
    requested before. A transition that fails is logged.
    """

    kind: ClassVar[str] = "event"

    lifecycle_node_matcher: Matcher = field(
        metadata=required(
            'Chooses the nodes: `matches_action(node)`, `matches_node_name("/talker")`, or a function'
            " that is called with a `LifecycleNode` action and returns whether it is meant."
        )
    )
    transition_id: int | Text = field(
        metadata=required(
            "A constant of `lifecycle_msgs.msg.Transition`, such as `TRANSITION_CONFIGURE`, or a"
            ' label such as "configure". The label "shutdown" is possible in each state but finalized.'
        )
    )


@dataclass(frozen=True, kw_only=True)
class LifecycleTransition(Action, element="lifecycle_transition"):
    """Request transitions of lifecycle nodes one after the other, as far as they succeed."""

    lifecycle_node_names: Sequence[Text] = field(
        metadata=required("The nodes, relative to the current namespace; the launch must have started them.")
    )
    transition_ids: Sequence[int | Text] = field(
        metadata=required("The numbers of the transitions, or labels such as configure, in their order.")
    )

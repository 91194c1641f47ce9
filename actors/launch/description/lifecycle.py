"""Lifecycle nodes: start them, and request transitions of them. The names are launch_ros's."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, Final, TypeAlias

from actors.launch.description.action import Action
from actors.launch.description.process_actions import Node, ProcessAction
from actors.launch.description.validation import Part

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from actors.launch.description.substitutions import Text

Matcher: TypeAlias = "Callable[..., bool] | matches_node_name"

TRANSITION_TIMEOUT_SEC: Final = 60.0
"""A callback may start hardware."""


@dataclass(frozen=True, kw_only=True)
class LifecycleNode(Node):
    """A program with a lifecycle node in it: its transitions can be requested, and cause events.

    Attributes:
        name: The node's name; required.
        autostart: Whether to configure and activate it each time that it has been started.
        transition_timeout: Seconds within which each transition must be done, including the time until the
            node is there.
        package: The package, with `executable`.
        executable: One of its console scripts; without a package, a program by its path or along PATH.
        script: A Python file instead; a relative path starts at the folder of the launch file.
        node: A node class instead, or a function that returns a new node, or "module:Class". It runs in the
            launch's own process, so it must not block, and shares its working folder.
        exec_name: For the label of its lines; None: the node's name.
        namespace: The node's namespace, within the one that has been pushed.
        parameters: Mappings of parameters, and paths of YAML files, relative to the folder of the launch
            file. The last value of a parameter counts.
        remappings: Pairs of a name and the one to use instead.
        arguments: Arguments for the program itself.
        ros_arguments: Further arguments after `--ros-args`.
        condition: When to carry it out; None: always.
        cwd: The working folder of the process; None: the one of `callboard launch`.
        env: Its whole environment; None: the one that is set at this place of the description.
        additional_env: Variables to add to that.
        prefix: A command to start it with, such as "gdb -ex run --args".
        output: Where its lines go: "screen", "log", "both", "own_log" or "full".
        emulate_tty: Whether its stdout and stderr are a terminal.
        depends_on: What must be in the graph before it is started: a `Node` with a name, or "node NAME",
            "topic NAME" or "service NAME"; one of these, or a list of them. Names are relative to the current
            namespace.
        depends_timeout: Seconds to wait for these. If they do not appear, the process counts as failed.
        respawn: Whether to start it again when it ends, whatever its exit code.
        respawn_delay: Seconds until then, at least `actors.launch.planning.steps.LEAST_RESPAWN_DELAY_SEC`.
        respawn_backoff: Factor by which the delay grows each time. It is reset when the process has run for
            twice `respawn_max_delay`.
        respawn_max_delay: The longest delay, in seconds. A longer `respawn_delay` overrides it.
        respawn_max_retries: How often to start it again; -1: without limit.
        sigterm_timeout: Seconds between SIGINT and SIGTERM; None: as the launch has it.
        sigkill_timeout: Seconds between SIGTERM and SIGKILL; None: as the launch has it.
        required: Whether the launch ends when it ends. The launch fails if it died.
        on_exit: What to do whenever it ends. `Shutdown()` alone is the same as `required=True`, except that
            the first end counts, also with `respawn=True`.
    """

    name: Text = field()
    autostart: bool | Text = False
    transition_timeout: float | Text = TRANSITION_TIMEOUT_SEC


@dataclass(frozen=True)
class matches_action(Part):  # noqa: N801 - the name in ROS 2
    """Chooses the process that an action has started.

    Attributes:
        action: The action.
    """

    noun: ClassVar[str] = "matcher"

    action: ProcessAction

    def __call__(self, action: ProcessAction) -> bool:
        """Return whether an action is this one.

        Args:
            action: The action to compare.

        Returns:
            True if it is the same object.
        """
        return action is self.action


@dataclass(frozen=True)
class matches_node_name(Part):  # noqa: N801 - the name in ROS 2
    """Chooses the lifecycle node of a name.

    Attributes:
        node_name: The node's full name, or one relative to the current namespace.
    """

    noun: ClassVar[str] = "matcher"

    node_name: Text


@dataclass(frozen=True, kw_only=True)
class ChangeState(Part):
    """Request a transition of lifecycle nodes: `EmitEvent(event=ChangeState(…))`.

    The launch requests it of those nodes that it has started, of each after the transitions that were
    requested before. A transition that fails is logged.

    Attributes:
        lifecycle_node_matcher: Chooses the nodes: `matches_action(node)`, `matches_node_name("/talker")`, or
            a function that is called with a `LifecycleNode` action and returns whether it is meant.
        transition_id: A constant of `lifecycle_msgs.msg.Transition`, such as `TRANSITION_CONFIGURE`, or a
            label such as "configure". The label "shutdown" is possible in each state but finalized.
    """

    noun: ClassVar[str] = "event"

    lifecycle_node_matcher: Matcher
    transition_id: int | Text


@dataclass(frozen=True, kw_only=True)
class LifecycleTransition(Action):
    """Request transitions of lifecycle nodes one after the other, as far as they succeed.

    Attributes:
        lifecycle_node_names: The nodes, relative to the current namespace; the launch must have started them.
        transition_ids: The transitions in their order, as `ChangeState` has them.
        condition: When to carry it out; None: always.
    """

    lifecycle_node_names: Sequence[Text]
    transition_ids: Sequence[int | Text]

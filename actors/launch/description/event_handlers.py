"""Event handlers: what to do when something happens, as data. The names are ROS 2's where it has them.

    RegisterEventHandler(OnProcessExit(target_action=talker, on_exit=[LogInfo(msg="bye"), Shutdown()]))

A reaction is an action, a list of actions, or a function. A function is called in a worker thread with the
event and the `LaunchContext`, and returns actions or None.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeAlias

from actors.launch.description.action import EventHandler
from actors.launch.description.options import option, required

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.launch.description.action import Reaction
    from actors.launch.description.lifecycle import LifecycleNode
    from actors.launch.description.process_actions import Node, ProcessAction
    from actors.launch.description.substitutions import Text

Target: TypeAlias = "ProcessAction | str | Callable[[ProcessAction], bool] | None"


@dataclass(frozen=True, kw_only=True)
class ProcessHandler(EventHandler):
    """React to what happens to a process."""

    target_action: Target = option(
        None,
        "The process: its label without the number; in Python also the action that started it, or a"
        " function that is called with an action and returns whether it matches. By default any process.",
        keys="target",
    )


@dataclass(frozen=True, kw_only=True)
class OnProcessStart(ProcessHandler, element="on_process_start"):
    """React to the start of a process."""

    on_start: Reaction = field(metadata=required("What to do.", keys="do"))


@dataclass(frozen=True, kw_only=True)
class OnProcessExit(ProcessHandler, element="on_process_exit"):
    """React to the end of a process, whatever its exit code."""

    on_exit: Reaction = field(metadata=required("What to do.", keys="do"))


@dataclass(frozen=True, kw_only=True)
class OnProcessIO(ProcessHandler, element="on_process_io"):
    """React to lines that a process has written. A function gets them as `event.text`."""

    on_output: Reaction | None = option(None, "What to do with lines of stdout and stderr.", keys="do")
    on_stdout: Reaction | None = option(None, "What to do with lines of stdout.", keys="stdout")
    on_stderr: Reaction | None = option(None, "What to do with lines of stderr.", keys="stderr")


@dataclass(frozen=True, kw_only=True)
class OnStateTransition(EventHandler, element="on_state_transition"):
    """React to a step of a lifecycle node's transition.

    It reacts if all given conditions hold. A function can read `transition`, `start_state` and `goal_state`
    of the event.
    """

    entities: Reaction = field(metadata=required("What to do.", keys="do"))
    target_lifecycle_node: LifecycleNode | str | None = option(
        None,
        "The process of the node: its label without the number; in Python also the action that started"
        " it. By default any.",
        keys="target",
    )
    transition: Text | None = option(
        None, "The label of the transition, such as configure or transition_success."
    )
    start_state: Text | None = option(
        None, "The label of the state that the node was in, such as configuring."
    )
    goal_state: Text | None = option(
        None, "The label of the state that the node is in now, such as inactive."
    )


@dataclass(frozen=True, kw_only=True)
class OnShutdown(EventHandler, element="on_shutdown"):
    """React to the end of the launch. No process is started after it."""

    on_shutdown: Reaction = field(metadata=required("What to do.", keys="do"))


@dataclass(frozen=True, kw_only=True)
class OnNodeUp(EventHandler, element="on_node_up"):
    """React to a node in the graph: at once if it is there already."""

    node: Text | Node = field(
        metadata=required(
            "The name of the node, relative to the current namespace; in Python also an action with a name."
        )
    )
    on_up: Reaction = field(metadata=required("What to do.", keys="do"))


@dataclass(frozen=True, kw_only=True)
class OnServiceAvailable(EventHandler, element="on_service_available"):
    """React to the first server of a service: at once if it has one already."""

    service: Text = field(metadata=required("The name of the service, relative to the current namespace."))
    on_available: Reaction = field(metadata=required("What to do.", keys="do"))


@dataclass(frozen=True, kw_only=True)
class OnTopicPublished(EventHandler, element="on_topic_published"):
    """React to the first publisher of a topic: at once if it has one already."""

    topic: Text = field(metadata=required("The name of the topic, relative to the current namespace."))
    on_published: Reaction = field(metadata=required("What to do.", keys="do"))

"""Event handlers: what to do when something happens, as data. The names are ROS 2's where it has them.

    RegisterEventHandler(OnProcessExit(target_action=talker, on_exit=[LogInfo(msg="bye"), Shutdown()]))

What is done is an action, a list of them, or a function. A function is called with the event and the
`LaunchContext`, in a worker thread, and returns actions or None.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from actors.launch.description.action import EventHandler

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.launch.description.action import Reaction
    from actors.launch.description.lifecycle import LifecycleNode
    from actors.launch.description.process_actions import Node, ProcessAction
    from actors.launch.description.substitutions import Text

Target: TypeAlias = "ProcessAction | str | Callable[[ProcessAction], bool] | None"


@dataclass(frozen=True, kw_only=True)
class ProcessHandler(EventHandler):
    """React to what happens to a process.

    Attributes:
        target_action: The action that started the process, or its name: the label without the number, or a
            function that is called with an action and returns whether it is meant; None: any process.
        handle_once: Whether to react only the first time.
    """

    target_action: Target = None


@dataclass(frozen=True, kw_only=True)
class OnProcessStart(ProcessHandler):
    """React to the start of a process.

    Attributes:
        on_start: An action, a list of actions, or a function that is called with the event and the
            `LaunchContext`.
        target_action: The action that started the process, or its name: the label without the number, or a
            function that is called with an action and returns whether it is meant; None: any process.
        handle_once: Whether to react only the first time.
    """

    on_start: Reaction


@dataclass(frozen=True, kw_only=True)
class OnProcessExit(ProcessHandler):
    """React to the end of a process, whatever its exit code.

    Attributes:
        on_exit: An action, a list of actions, or a function that is called with the event and the
            `LaunchContext`.
        target_action: The action that started the process, or its name: the label without the number, or a
            function that is called with an action and returns whether it is meant; None: any process.
        handle_once: Whether to react only the first time.
    """

    on_exit: Reaction


@dataclass(frozen=True, kw_only=True)
class OnProcessIO(ProcessHandler):
    """React to lines that a process has written. A function gets them as `event.text`.

    Attributes:
        on_output: An action, a list of actions, or a function that is called with the event and the
            `LaunchContext`. For stdout and stderr.
        on_stdout: The same for stdout only.
        on_stderr: The same for stderr only.
        target_action: The action that started the process, or its name: the label without the number, or a
            function that is called with an action and returns whether it is meant; None: any process.
        handle_once: Whether to react only the first time.
    """

    on_output: Reaction | None = None
    on_stdout: Reaction | None = None
    on_stderr: Reaction | None = None


@dataclass(frozen=True, kw_only=True)
class OnStateTransition(EventHandler):
    """React to a step of a lifecycle node's transition.

    It reacts if all given conditions hold. A function can read `transition`, `start_state` and `goal_state`
    of the event.

    Attributes:
        entities: An action, a list of actions, or a function that is called with the event and the
            `LaunchContext`.
        target_lifecycle_node: The action that started the node, or its process's name: the label without the
            number; None: any.
        transition: The label of the transition, such as "configure" or "transition_success".
        start_state: The label of the state that the node was in, such as "configuring".
        goal_state: The label of the state that the node is in now, such as "inactive".
        handle_once: Whether to react only the first time.
    """

    entities: Reaction
    target_lifecycle_node: LifecycleNode | str | None = None
    transition: Text | None = None
    start_state: Text | None = None
    goal_state: Text | None = None


@dataclass(frozen=True, kw_only=True)
class OnShutdown(EventHandler):
    """React to the end of the launch. No process is started after it.

    Attributes:
        on_shutdown: An action, a list of actions, or a function that is called with the event and the
            `LaunchContext`.
        handle_once: Whether to react only the first time.
    """

    on_shutdown: Reaction


@dataclass(frozen=True, kw_only=True)
class OnNodeUp(EventHandler):
    """React to a node in the graph: at once if it is there already.

    Attributes:
        node: Its name, relative to the current namespace, or an action with a name.
        on_up: An action, a list of actions, or a function that is called with the event and the
            `LaunchContext`.
        handle_once: Whether to react only the first time.
    """

    node: Text | Node
    on_up: Reaction


@dataclass(frozen=True, kw_only=True)
class OnServiceAvailable(EventHandler):
    """React to the first server of a service: at once if it has one already.

    Attributes:
        service: Its name, relative to the current namespace.
        on_available: An action, a list of actions, or a function that is called with the event and the
            `LaunchContext`.
        handle_once: Whether to react only the first time.
    """

    service: Text
    on_available: Reaction


@dataclass(frozen=True, kw_only=True)
class OnTopicPublished(EventHandler):
    """React to the first publisher of a topic: at once if it has one already.

    Attributes:
        topic: Its name, relative to the current namespace.
        on_published: An action, a list of actions, or a function that is called with the event and the
            `LaunchContext`.
        handle_once: Whether to react only the first time.
    """

    topic: Text
    on_published: Reaction

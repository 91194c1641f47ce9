"""Event handlers: what to do when something happens, as data. The names are ROS 2's where it has them.

    RegisterEventHandler(OnProcessExit(target_action=talker, on_exit=[LogInfo(msg="bye"), Shutdown()]))

What is done is an action, a list of them, or a function. A function is called with the event and the
`LaunchContext`, in a worker thread, and returns actions or None.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias

from actors.launch.description.actions import Action, Launched, Node
from actors.launch.description.shapes import Part

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from actors.launch.description.substitutions import Text

Actions: TypeAlias = "Action | Sequence[Action]"
Reaction: TypeAlias = "Actions | Callable[..., Actions | None]"


@dataclass(frozen=True, kw_only=True)
class EventHandler(Part):
    """Something that may happen, and what to do then.

    Attributes:
        handle_once: Whether only the first time.

    Raises:
        LaunchError: An argument cannot be what it is meant to be.
    """

    noun: ClassVar[str] = "event handler"

    handle_once: bool = False

    @property
    def actions(self) -> Sequence[Action]:
        """The actions to take, as far as they are known before."""
        reactions = [getattr(self, each.name) for each in fields(self) if each.name.startswith("on_")]
        return [action for each in reactions if each is not None for action in known_actions(each)]


@dataclass(frozen=True, kw_only=True)
class ProcessHandler(EventHandler):
    """Something that may happen to a process.

    Attributes:
        target_action: The action that it comes from, or its name: its label without the number; None: any.
    """

    target_action: Launched | str | None = None


@dataclass(frozen=True, kw_only=True)
class OnProcessStart(ProcessHandler):
    """A process runs."""

    on_start: Reaction


@dataclass(frozen=True, kw_only=True)
class OnProcessExit(ProcessHandler):
    """A process has ended, however that was."""

    on_exit: Reaction


@dataclass(frozen=True, kw_only=True)
class OnProcessIO(ProcessHandler):
    """A process has written whole lines; a function gets them as `event.text`.

    Attributes:
        on_output: What to do, whether it was stdout or stderr.
        on_stdout: What to do if it was stdout.
        on_stderr: What to do if it was stderr.
    """

    on_output: Reaction | None = None
    on_stdout: Reaction | None = None
    on_stderr: Reaction | None = None


@dataclass(frozen=True, kw_only=True)
class OnShutdown(EventHandler):
    """The launch ends. Processes are not started any more then."""

    on_shutdown: Reaction


@dataclass(frozen=True, kw_only=True)
class OnNodeUp(EventHandler):
    """A node is there; if it is there already, at once.

    Attributes:
        node: Its name, seen from the namespace there, or an action that has one.
    """

    node: Text | Node
    on_up: Reaction


@dataclass(frozen=True, kw_only=True)
class OnServiceAvailable(EventHandler):
    """A service has a server; if it has one already, at once.

    Attributes:
        service: Its name, seen from the namespace there.
    """

    service: Text
    on_available: Reaction


@dataclass(frozen=True, kw_only=True)
class OnTopicPublished(EventHandler):
    """A topic has a publisher; if it has one already, at once.

    Attributes:
        topic: Its name, seen from the namespace there.
    """

    topic: Text
    on_published: Reaction


def known_actions(reaction: Any) -> Sequence[Action]:
    """Return the actions of a reaction; none if it is a function."""
    if isinstance(reaction, Action):
        return (reaction,)
    return () if callable(reaction) else tuple(reaction)

"""The steps of a plan, each with the time when it is due. The machine carries them out.

Steps are plain data, so that `--dry-run` can show them and tests can compare them. Functions in them cannot
be called earlier: their results depend on events.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from actors.launch.planning.events import Event
    from actors.launch.planning.presence import Presence
    from actors.launch.planning.process_spec import ProcessSpec


@dataclass(frozen=True, kw_only=True)
class PlannedStep:
    """A step.

    Attributes:
        after_sec: Seconds from the beginning of its plan until it is due.
        cancel_on_shutdown: Whether to forget it if the launch ends before that.
    """

    after_sec: float = 0.0
    cancel_on_shutdown: bool = True


@dataclass(frozen=True, kw_only=True)
class Start(PlannedStep):
    """Start a process when its dependencies are there.

    Attributes:
        process: The process.
        on_exit: What to do whenever it ends, beside what registered handlers do.
    """

    process: ProcessSpec
    on_exit: AddHandler | None = None


@dataclass(frozen=True, kw_only=True)
class LogText(PlannedStep):
    """Show a message, as ROS 2's LogInfo does."""

    text: str
    warning: bool = False


@dataclass(frozen=True, kw_only=True)
class End(PlannedStep):
    """End the launch."""

    reason: str


@dataclass(frozen=True, kw_only=True)
class Call(PlannedStep):
    """Call a function of the description, and carry out the steps that it returns.

    Attributes:
        name: The name of the function, for messages.
        steps: Calls it and plans the actions that it returns; this may block. An exception is an error in
            the description.
    """

    name: str
    steps: Callable[[], list[Step]]


@dataclass(frozen=True, kw_only=True)
class ChangeStates(PlannedStep):
    """Request transitions of lifecycle nodes.

    Attributes:
        what: Describes the nodes in messages.
        matches: Whether a process is meant. An exception is an error in the description.
        transitions: The numbers or labels of the transitions, in their order.
        calls: Whether `matches` calls a function of the description, which may block.
    """

    what: str
    matches: Callable[[ProcessSpec], bool]
    transitions: tuple[int | str, ...]
    calls: bool = False


@dataclass(frozen=True, kw_only=True)
class AddHandler(PlannedStep):
    """Add an event handler.

    Attributes:
        what: Describes the event in messages, such as "talker-1 exits".
        matches: Whether it handles an event.
        steps: Returns the steps to carry out. An exception is an error in the description.
        preview: Those steps as far as they are known before, for `--dry-run`.
        once: Whether to handle only the first event.
        calls: Whether `steps` calls a function of the description, which may block.
        presence: The node, topic or service whose appearance it handles, if any.
        split: Whether stdout and stderr must be separate streams for it.
    """

    what: str
    matches: Callable[[Event], bool]
    steps: Callable[[Event], list[Step]]
    preview: tuple[Step, ...] = ()
    once: bool = False
    calls: bool = False
    presence: Presence | None = None
    split: bool = False


Step: TypeAlias = Start | LogText | End | Call | ChangeStates | AddHandler


def all_steps(steps: Iterable[Step]) -> Iterator[Step]:
    """Yield steps, and those that they may lead to, as far as they are known before."""
    for step in steps:
        yield step
        reaction = step.on_exit if isinstance(step, Start) else step
        if isinstance(reaction, AddHandler):
            if reaction is not step:
                yield reaction
            yield from all_steps(reaction.preview)


def awaits_graph(steps: Iterable[Step]) -> bool:
    """Return whether something in these steps depends on the graph, or may."""
    # Following the graph costs a hidden node and its traffic. A function may return anything.
    return any(
        isinstance(step, Call)
        or (isinstance(step, Start) and bool(step.process.depends_on))
        or (isinstance(step, AddHandler) and (step.presence is not None or not step.preview))
        for step in all_steps(steps)
    )


def splits_streams(steps: Iterable[Step]) -> bool:
    """Return whether a handler in these steps needs stdout and stderr as separate streams."""
    return any(isinstance(step, AddHandler) and step.split for step in all_steps(steps))

"""Steps: what a plan consists of. Each says what to do and when; the machine carries them out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from actors.launch.planning.events import Event
    from actors.launch.planning.presence import Presence
    from actors.launch.planning.process_spec import ProcessSpec


@dataclass(frozen=True, kw_only=True)
class Timed:
    """A step.

    Attributes:
        after_sec: When it is due, counted from the moment that its plan begins.
    """

    after_sec: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Start(Timed):
    """Start a process, when what it depends on is there.

    Attributes:
        process: The process.
        on_exit: What to do whenever it ends, beside what registered handlers do.
    """

    process: ProcessSpec
    on_exit: React | None = None


@dataclass(frozen=True, kw_only=True)
class LogText(Timed):
    """Log a text for people, as ROS 2's LogInfo does."""

    text: str
    warning: bool = False


@dataclass(frozen=True, kw_only=True)
class End(Timed):
    """End the launch."""

    reason: str


@dataclass(frozen=True, kw_only=True)
class Call(Timed):
    """Call a function of the description, and take the steps it gives.

    Attributes:
        name: The function's, for people.
        steps: Calls it and plans what it returns; this may block. What it raises is a mistake in the
            description.
    """

    name: str
    steps: Callable[[], list[Step]]


@dataclass(frozen=True, kw_only=True)
class ChangeStates(Timed):
    """Request transitions of lifecycle nodes.

    Attributes:
        what: Which nodes, for people.
        matches: Whether a process is meant. What it raises is a mistake in the description.
        transitions: The numbers or labels of the transitions, in their order.
        calls: Whether `matches` calls a function of the description, which may block.
    """

    what: str
    matches: Callable[[ProcessSpec], bool]
    transitions: tuple[int | str, ...]
    calls: bool = False


@dataclass(frozen=True, kw_only=True)
class React(Timed):
    """From then on take further steps whenever something happens.

    Attributes:
        what: What that is, for people: "talker-1 exits".
        matches: Whether an event is meant.
        steps: What is to be done then. What it raises is a mistake in the description.
        preview: The same for people, as far as it is known before.
        once: Whether only for the first time.
        calls: Whether `steps` calls a function of the description, which may block.
        presence: What must be there, if the event is that.
        split: Whether it needs to know stdout from stderr.
    """

    what: str
    matches: Callable[[Event], bool]
    steps: Callable[[Event], list[Step]]
    preview: tuple[Step, ...] = ()
    once: bool = False
    calls: bool = False
    presence: Presence | None = None
    split: bool = False


Step: TypeAlias = Start | LogText | End | Call | ChangeStates | React


def all_steps(steps: Iterable[Step]) -> Iterator[Step]:
    """Yield steps, and those that they may lead to, as far as that is known before."""
    for step in steps:
        yield step
        reaction = step.on_exit if isinstance(step, Start) else step
        if isinstance(reaction, React):
            if reaction is not step:
                yield reaction
            yield from all_steps(reaction.preview)


def awaits_graph(steps: Iterable[Step]) -> bool:
    """Return whether something in these steps depends on the graph, or may."""
    return any(
        isinstance(step, Call)
        or (isinstance(step, Start) and bool(step.process.depends_on))
        or (isinstance(step, React) and (step.presence is not None or not step.preview))
        for step in all_steps(steps)
    )


def splits_streams(steps: Iterable[Step]) -> bool:
    """Return whether something in these steps must know stdout from stderr."""
    return any(isinstance(step, React) and step.split for step in all_steps(steps))

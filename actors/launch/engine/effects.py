"""Effects: what the state machine of a launch wants the runner to do, as data.

With effects in place of calls, the machine needs no I/O, and tests compare lists.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from actors.launch.planning.events import Event
    from actors.launch.planning.process_spec import ProcessSpec
    from actors.launch.planning.steps import Step


@dataclass(frozen=True)
class Run:
    """Start a process.

    Attributes:
        process: The process.
        split: Whether stdout and stderr are separate streams.
    """

    process: ProcessSpec
    split: bool


@dataclass(frozen=True)
class Stop:
    """Stop a process.

    Attributes:
        label: Its label.
    """

    label: str


@dataclass(frozen=True)
class StopAll:
    """Stop all processes, at the same time."""


@dataclass(frozen=True)
class ForceStopAll:
    """Kill all processes."""


@dataclass(frozen=True)
class Notify:
    """Pass an event to the listeners."""

    event: Event


@dataclass(frozen=True, eq=False)
class CallFunction:
    """Call a function of the description in a thread, and report `function_returned`.

    Attributes:
        call: Calls the function, and plans the actions that it returns.
    """

    call: Callable[[], Sequence[Step]]


@dataclass(frozen=True, eq=False)
class RequestTransition:
    """Request a transition of a lifecycle node, and call `transition_ended` at its end.

    Attributes:
        label: Its process.
        node: Its full name.
        transition: The transition's number or label.
        timeout_sec: Seconds that it may take, including the time until the node is there.
    """

    label: str
    node: str
    transition: int | str
    timeout_sec: float


@dataclass(frozen=True)
class CancelTransition:
    """Stop waiting for the end of a transition.

    Attributes:
        request: The request.
    """

    request: RequestTransition


Effect: TypeAlias = (
    Run | Stop | StopAll | ForceStopAll | Notify | CallFunction | RequestTransition | CancelTransition
)

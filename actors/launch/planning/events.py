"""Events: what happens in a launch, as data. Reports show them, event handlers react to them."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from typing import TypeAlias

    from actors.launch.description.process_actions import ProcessAction
    from actors.launch.planning.presence import Presence
    from actors.launch.planning.process_spec import ProcessSpec
    from actors.processes.outcome import Outcome

    Listener: TypeAlias = Callable[["Event"], None]
    """Is called with each event when it happens. It must not wait."""


class Stream(Enum):
    """Where a process has written something."""

    STDOUT = "stdout"
    STDERR = "stderr"
    OUTPUT = "output"
    """Either: they are read as one, in their order."""


@dataclass(frozen=True)
class Event:
    """Something has happened."""


@dataclass(frozen=True)
class ProcessEvent(Event):
    """Something has happened to a process; the properties are named as in ROS 2.

    Attributes:
        process: Which one.
        pid: Its number; None if it has none (yet, or because it is a node in this process).
    """

    process: ProcessSpec
    pid: int | None

    @property
    def process_name(self) -> str:
        """Its label: "talker-1"."""
        return self.process.label

    @property
    def action(self) -> ProcessAction | None:
        """The action that it comes from."""
        return self.process.origin

    @property
    def cmd(self) -> tuple[str, ...]:
        """Its command."""
        return self.process.command

    @property
    def cwd(self) -> str | None:
        """Where it runs; None: where the launch does."""
        return self.process.cwd

    @property
    def env(self) -> Mapping[str, str]:
        """Its environment."""
        return self.process.environment


@dataclass(frozen=True)
class ProcessStarted(ProcessEvent):
    """It runs."""


@dataclass(frozen=True)
class ProcessIO(ProcessEvent):
    """It has written whole lines.

    Attributes:
        stream: Where.
        lines: The lines, without their ends. At the end of a process the last one may have had none.
    """

    stream: Stream
    lines: tuple[bytes, ...]

    @property
    def text(self) -> bytes:
        """The lines as they were written."""
        return b"".join(line + b"\n" for line in self.lines)

    @property
    def from_stdout(self) -> bool:
        """Whether they may come from stdout."""
        return self.stream is not Stream.STDERR

    @property
    def from_stderr(self) -> bool:
        """Whether they may come from stderr."""
        return self.stream is not Stream.STDOUT


@dataclass(frozen=True)
class ProcessExited(ProcessEvent):
    """It has ended, or could not be started.

    Attributes:
        outcome: How.
    """

    outcome: Outcome

    @property
    def returncode(self) -> int | None:
        """Its exit code, negative for a signal; None if it never ran, or was a node in this process."""
        return self.outcome.returncode


@dataclass(frozen=True)
class ProcessWaits(ProcessEvent):
    """It is not started yet, or still not, since something is not there.

    Attributes:
        missing: What is not there.
        so_far_sec: How long it has waited.
    """

    missing: tuple[Presence, ...]
    so_far_sec: float


@dataclass(frozen=True)
class ProcessRestarts(ProcessEvent):
    """It will be started again.

    Attributes:
        delay_sec: When.
        reason: Why: "respawn", or what has changed.
    """

    delay_sec: float
    reason: str


@dataclass(frozen=True)
class StateTransition(ProcessEvent):
    """Its lifecycle node has made a step of a transition.

    Attributes:
        transition: The label of the step, such as "configure" or "transition_success".
        start_state: The label of the state that the node was in.
        goal_state: The label of the state that the node is in now.
        timestamp: When, in ns since the epoch, by the node's clock.
    """

    transition: str
    start_state: str
    goal_state: str
    timestamp: int


@dataclass(frozen=True)
class Appeared(Event):
    """A node, a topic or a service is there, and was not before; at first all that is there."""

    presence: Presence


class Level(Enum):
    """How bad a message is."""

    INFO = "INFO"
    WARN = "WARN"
    ERROR = "ERROR"


@dataclass(frozen=True)
class Message(Event):
    """Something is said to people.

    Attributes:
        level: How bad it is.
        text: What it is, in one line; the lines of a traceback may follow.
        about: Whom it is about: a label, or the launch.
    """

    level: Level
    text: str
    about: str = "launch"


@dataclass(frozen=True)
class ShuttingDown(Event):
    """The launch ends: processes are being stopped.

    Attributes:
        reason: Why.
    """

    reason: str

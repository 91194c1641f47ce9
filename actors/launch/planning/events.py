"""What happens in a launch, as data. Reports show events, and event handlers react to them."""

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
    """Called with each event when it happens. It must not block."""


class Stream(Enum):
    """The stream that a process has written to."""

    STDOUT = "stdout"
    STDERR = "stderr"
    OUTPUT = "output"
    """Both, read as one stream, which keeps the order of their lines."""


@dataclass(frozen=True)
class Event:
    """An event of a launch."""


@dataclass(frozen=True)
class ProcessEvent(Event):
    """An event of a process. The names of the properties are ROS 2's.

    Attributes:
        process: The process.
        pid: Its process id; None if it does not run, or is a node in this process.
    """

    process: ProcessSpec
    pid: int | None

    @property
    def process_name(self) -> str:
        """The label of the process, such as "talker-1"."""
        return self.process.label

    @property
    def action(self) -> ProcessAction | None:
        """The action that started the process."""
        return self.process.origin

    @property
    def cmd(self) -> tuple[str, ...]:
        """The command of the process."""
        return self.process.command

    @property
    def cwd(self) -> str | None:
        """The working folder of the process; None: that of the launch."""
        return self.process.cwd

    @property
    def env(self) -> Mapping[str, str]:
        """The environment of the process."""
        return self.process.environment


@dataclass(frozen=True)
class ProcessStarted(ProcessEvent):
    """A process has been started."""


@dataclass(frozen=True)
class ProcessIO(ProcessEvent):
    """A process has written lines.

    Attributes:
        stream: The stream.
        lines: The lines, without their ends. The last line of a process may have had none.
    """

    stream: Stream
    lines: tuple[bytes, ...]

    @property
    def text(self) -> bytes:
        """The lines with their ends."""
        return b"".join(line + b"\n" for line in self.lines)

    @property
    def from_stdout(self) -> bool:
        """Whether the lines may come from stdout."""
        return self.stream is not Stream.STDERR

    @property
    def from_stderr(self) -> bool:
        """Whether the lines may come from stderr."""
        return self.stream is not Stream.STDOUT


@dataclass(frozen=True)
class ProcessExited(ProcessEvent):
    """A process has ended, or could not be started.

    Attributes:
        outcome: How it ended.
    """

    outcome: Outcome

    @property
    def returncode(self) -> int | None:
        """The exit code, negative for a signal; None if it never ran, or was a node in this process."""
        return self.outcome.returncode


@dataclass(frozen=True)
class ProcessWaits(ProcessEvent):
    """A process waits for its dependencies, or still does.

    Attributes:
        missing: The dependencies that are not there.
        so_far_sec: How long it has waited.
    """

    missing: tuple[Presence, ...]
    so_far_sec: float


@dataclass(frozen=True)
class ProcessRestarts(ProcessEvent):
    """A process will be started again.

    Attributes:
        delay_sec: Seconds until then.
        reason: "respawn", or the change that is the reason.
    """

    delay_sec: float
    reason: str


@dataclass(frozen=True)
class StateTransition(ProcessEvent):
    """A lifecycle node has made a step of a transition.

    Attributes:
        transition: The label of the step, such as "configure" or "transition_success".
        start_state: The label of the state that the node was in.
        goal_state: The label of the state that the node is in now.
        timestamp: The time in ns since the epoch, by the node's clock.
    """

    transition: str
    start_state: str
    goal_state: str
    timestamp: int


@dataclass(frozen=True)
class Appeared(Event):
    """A node, topic or service has appeared in the graph. At first, those that are there already."""

    presence: Presence


class Level(Enum):
    """The severity of a message."""

    DEBUG = "DEBUG"
    INFO = "INFO"
    WARN = "WARN"
    ERROR = "ERROR"


@dataclass(frozen=True)
class Message(Event):
    """A message to the user.

    Attributes:
        level: Its severity.
        text: The message in one line; the lines of a traceback may follow.
        about: The label of the process that it is about, or "launch".
    """

    level: Level
    text: str
    about: str = "launch"


@dataclass(frozen=True)
class ShuttingDown(Event):
    """The launch ends, and its processes are being stopped.

    Attributes:
        reason: The reason, for messages.
    """

    reason: str

"""Process specifications: everything that is needed to start, stop and restart a process, as plain data."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from actors.launch.description.process_actions import DEPENDS_TIMEOUT_SEC, OutputMode

if TYPE_CHECKING:
    from collections.abc import Mapping

    from actors.launch.description.process_actions import ProcessAction
    from actors.launch.planning.presence import Presence
    from actors.runtime.programs import Factory

MAX_PROCESSES: Final = 1000
"""Limit of one launch; a description with more is taken for an error."""
LEAST_RESPAWN_DELAY_SEC: Final = 0.1
"""Lower limit, so that a program that dies at once does not keep the machine busy."""
STOP_TIMEOUT_SEC: Final = 5.0
"""Seconds before each stronger signal, as in ROS 2."""


@dataclass(frozen=True, kw_only=True)
class LifecycleSpec:
    """The requests to a lifecycle node.

    Attributes:
        autostart: The transitions to request each time that its process has been started.
        timeout_sec: The limit of each transition.
    """

    autostart: tuple[int | str, ...]
    timeout_sec: float


@dataclass(frozen=True, kw_only=True)
class ProcessSpec:
    """A process to start, or with `program` a node to run in this process.

    Fields that are named like an option of `ProcessAction` have its value. None stands for the stop timeouts
    and the working folder of the launch.

    Attributes:
        label: The prefix of its lines, such as "talker-1"; unique in the launch.
        name: The label without its number.
        node: The full name of its node; None: the program chooses it.
        lifecycle: The requests to its lifecycle node; None if the node has no lifecycle.
        command: The program and its arguments; for a node in this process, the arguments.
        program: Creates the node that runs in this process; None for a separate process.
        shown: The command as users would type it.
        environment: The whole environment.
        own_environment: The variables that the description adds for this process only, for `--dry-run`.
        origin: The action that it comes from.
        end_reason: The reason to show when the launch ends with it; empty: it is required.
        made_later: Whether a function returned its action while the launch ran.
        sources: Folders and files whose changes restart it with `--watch`.
    """

    label: str
    name: str
    node: str | None = None
    lifecycle: LifecycleSpec | None = None
    command: tuple[str, ...]
    program: Factory | None = None
    shown: str
    cwd: str | None = None
    environment: Mapping[str, str] = field(default_factory=dict[str, str])
    own_environment: Mapping[str, str] = field(default_factory=dict[str, str])
    origin: ProcessAction | None = field(default=None, repr=False, compare=False)
    output: OutputMode = OutputMode.SCREEN
    emulate_tty: bool = False
    depends_on: tuple[Presence, ...] = ()
    depends_timeout_sec: float = DEPENDS_TIMEOUT_SEC
    respawn: bool = False
    respawn_delay_sec: float = LEAST_RESPAWN_DELAY_SEC
    respawn_backoff: float = 1.0
    respawn_max_delay_sec: float = LEAST_RESPAWN_DELAY_SEC
    respawn_max_retries: int = -1
    sigterm_timeout_sec: float | None = None
    sigkill_timeout_sec: float | None = None
    required: bool = False
    end_reason: str = ""
    made_later: bool = False
    sources: tuple[str, ...] = ()

    def stop_step_timeouts_sec(self) -> dict[int, float]:
        """Return its own time limits of step 0 (SIGINT) and 1 (SIGTERM) of stopping it."""
        limits = {0: self.sigterm_timeout_sec, 1: self.sigkill_timeout_sec}
        return {step: limit for step, limit in limits.items() if limit is not None}

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
    """A process to start; or, with `program`, a node in this process.

    Fields that are named like an option of `ProcessAction` have its value. Without a value of its own a
    process is stopped with the timeouts of the launch, and gets the working folder of the launch.

    Attributes:
        label: What its lines begin with, such as "talker-1"; unique in the launch.
        name: The label without its number.
        node: The full name of its node; None: the program chooses it.
        lifecycle: What is requested of its lifecycle node; None if its node has no states.
        command: The program and its arguments. Of a node in this process: the arguments.
        program: Makes the node that runs in this process; None for a process of its own.
        shown: The command as users would type it.
        environment: All of it.
        own_environment: What the description adds for this process alone, to be shown.
        origin: The action that it comes from.
        end_reason: Why the launch ends with it, to be shown; empty: because it is required.
        made_later: Whether a function has made it while the launch ran.
        sources: Folders and files that it is made of.
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

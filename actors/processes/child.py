"""The children of a supervisor, and which of them are restarted after one has ended."""

from __future__ import annotations

import math
import sys
from dataclasses import KW_ONLY, dataclass, field
from enum import Enum
from typing import TYPE_CHECKING, Final

from actors.runtime.programs import is_instance

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from actors.runtime.programs import Factory

MAX_NAME_CHARACTERS: Final = 255

STOP_TIMEOUT_SEC: Final = 5.0
"""The time that ROS 2's launch gives a process before each stronger signal."""


class Strategy(Enum):
    """Which children are started again when one of them has died."""

    ONE_FOR_ONE = "one_for_one"
    """That child alone."""
    ONE_FOR_ALL = "one_for_all"
    """All: the others are stopped, last first, and then all are started, in order."""
    REST_FOR_ONE = "rest_for_one"
    """That child and those after it in the list."""


class Restart(Enum):
    """Which ends of a child are deaths, after which it is started again."""

    PERMANENT = "permanent"
    """Every end."""
    TRANSIENT = "transient"
    """An abnormal one: an exception, an exit code other than 0, a signal."""
    TEMPORARY = "temporary"
    """None. When the strategy stops it for another's sake, that is its end, too."""


@dataclass(frozen=True)
class Child:
    """One child of a supervisor: a name, what it runs, and when it is started again.

    Exactly one of `node`, `script` and `command` says what it runs.

    Args:
        name: Its name in events, logs and errors; unique in its supervisor.
        node: Runs in this process: a node class, a function that returns a new node or a new supervisor, or a
            coroutine function. Each start calls it.
        script: A Python file, run by this interpreter in a process of its own.
        command: A program and its arguments, run in a process of its own; no shell is involved.
        args: Arguments for the script.
        env: Environment variables for the process, beside this process's.
        cwd: Where the process runs; None: here.
        restart: Which ends are deaths.
        stop_timeout_sec: Time limit of each step to stop it, in seconds. A process gets SIGINT, then SIGTERM,
            then SIGKILL, each for its whole group; something in this process is cancelled, and cancelled
            again. A child that is a supervisor needs more than the sum of what its own children may take.

    Raises:
        TypeError: `node` is a node or supervisor that exists already: it could not be started a second time.
        ValueError: None or several of the three are given, an option does not fit the one given, or the name
            or the timeout is out of range.
    """

    name: str
    _: KW_ONLY
    node: Factory | None = None
    script: str | Path | None = None
    command: Sequence[str | Path] | None = None
    args: Sequence[str] = ()
    env: Mapping[str, str] = field(default_factory=dict[str, str])
    cwd: str | Path | None = None
    restart: Restart = Restart.PERMANENT
    stop_timeout_sec: float = STOP_TIMEOUT_SEC

    def __post_init__(self) -> None:
        if not 0 < len(self.name) <= MAX_NAME_CHARACTERS or not self.name.isprintable():
            raise ValueError(f"A child's name has 1 to {MAX_NAME_CHARACTERS} printable characters")
        if sum(way is not None for way in (self.node, self.script, self.command)) != 1:
            raise ValueError(f"Child '{self.name}' needs one of node=, script= and command=")
        if is_instance(self.node):
            raise TypeError(
                f"Child '{self.name}' needs a class or a function that returns a new node for each start, "
                f"not a {type(self.node).__name__} that exists already"
            )
        if self.node is not None and not callable(self.node):
            raise TypeError(f"Child '{self.name}': node= needs something to call, not {self.node!r}")
        if self.script is None and self.args:
            raise ValueError(f"Child '{self.name}': args= goes with script= only")
        if self.node is not None and (self.env or self.cwd is not None):
            raise ValueError(f"Child '{self.name}': env= and cwd= go with script= and command= only")
        if self.command is not None and (isinstance(self.command, str) or not self.command):
            raise ValueError(f"Child '{self.name}': command= is a list of a program and its arguments")
        if not 0 <= self.stop_timeout_sec < math.inf:
            raise ValueError(f"Child '{self.name}': stop_timeout_sec must be 0 or more, and finite")

    @property
    def argv(self) -> list[str]:
        """The command of a child that is a process; empty for others."""
        if self.command is not None:
            return [str(word) for word in self.command]
        if self.script is not None:
            # -u: Python would buffer what it prints into a pipe, and a crash would lose it.
            return [sys.executable, "-u", str(self.script), *self.args]
        return []

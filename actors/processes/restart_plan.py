"""The plan: which children to start and to stop next. No tasks, no processes, no clock: time is an argument.

The supervisor reports what has happened (`started`, `ended`, `tick`, `stop`) and carries out the steps that
it gets back. A child is in one of these states:

    WAITING ─ Start → STARTING ─ started → RUNNING
       ↑                 │                   │        ─ Stop → STOPPING
       └──── back-off ───┴─────── dies ──────┘                    │
             ENDED ←── for good ──────────────────────────────────┘

Two marks decide what comes next. A child that is *condemned* is to be stopped; these go one at a time, the
last one first, and nothing is started before they are gone. A child that waits is started when its back-off
is over and, but for restarts of ONE_FOR_ONE, after all children before it. The end of a condemned child,
even if it has not been stopped yet, is not counted as a death.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Final, NamedTuple

from actors.processes.backoff import Backoff
from actors.processes.child import Restart, Strategy

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence


class ChildState(Enum):
    """Where a child is in its life."""

    WAITING = "waiting"
    """It will be started, after other children or after its back-off."""
    STARTING = "starting"
    RUNNING = "running"
    STOPPING = "stopping"
    ENDED = "ended"
    """It will not be started again, unless the strategy restarts it with another child."""


_ALIVE: Final = frozenset({ChildState.STARTING, ChildState.RUNNING, ChildState.STOPPING})


@dataclass(frozen=True, kw_only=True)
class Policy:
    """How a supervisor restarts.

    Attributes:
        strategy: Which children go with one that dies.
        max_restarts: Restarts that may be due within `restart_window_sec`; one more, and the supervisor gives
            up.
        restart_window_sec: Length of that window, in seconds.
        first_backoff_sec: Pause before a child's first restart; it doubles with each further one.
        max_backoff_sec: The longest pause.

    Raises:
        ValueError: A number is out of range.
    """

    strategy: Strategy = Strategy.ONE_FOR_ONE
    max_restarts: int = 3
    restart_window_sec: float = 5.0
    first_backoff_sec: float = 0.1
    max_backoff_sec: float = 5.0

    def __post_init__(self) -> None:
        if self.max_restarts < 0:
            raise ValueError("max_restarts must be 0 or more")
        if not self.restart_window_sec > 0:
            raise ValueError("restart_window_sec must be more than 0")
        if not 0 <= self.first_backoff_sec <= self.max_backoff_sec:
            raise ValueError("back-offs must be 0 or more, and the first one at most the longest")


class Start(NamedTuple):
    """Start this child; then report `started` or `ended`."""

    child: int


class Stop(NamedTuple):
    """Stop this child, which is starting or running; then report `ended`."""

    child: int


class WillRestart(NamedTuple):
    """A child has died and will be started again after so many seconds, or later if others must stop."""

    child: int
    delay_sec: float


class GaveUp(NamedTuple):
    """With this child's death too many restarts were due; all children are being stopped."""

    child: int


Step = Start | Stop | WillRestart | GaveUp


class _Slot:
    """The state of one child."""

    __slots__ = ("backoff", "began", "condemned", "due", "in_order", "restart", "starts", "state")

    def __init__(self, restart: Restart, policy: Policy) -> None:
        self.restart = restart
        self.state = ChildState.WAITING
        self.condemned = False
        self.due = 0.0
        self.in_order = True
        """Whether it is started only after the children before it that are started in order, too."""
        self.starts = 0
        self.began = 0.0
        self.backoff = Backoff(policy.first_backoff_sec, policy.max_backoff_sec)

    @property
    def alive(self) -> bool:
        return self.state in _ALIVE


class RestartPlan:
    """The state of a supervisor's children.

    Args:
        restarts: When each child is restarted, in start order.
        policy: How to restart.
        jitter: Gives a factor from 0 to 1; back-offs are between half and the whole of their length.
    """

    def __init__(self, restarts: Iterable[Restart], policy: Policy, jitter: Callable[[], float]) -> None:
        self._slots = [_Slot(restart, policy) for restart in restarts]
        self._policy = policy
        self._jitter = jitter
        self._restarts: deque[float] = deque(maxlen=policy.max_restarts + 1)
        self._stopping = False
        self._now = -math.inf

    @property
    def finished(self) -> bool:
        """Whether all children have ended for good."""
        return all(slot.state is ChildState.ENDED for slot in self._slots)

    def state(self, child: int) -> ChildState:
        """Return where a child is in its life."""
        return self._slots[child].state

    def restarts(self, child: int) -> int:
        """Return how often a child has been started again."""
        return max(0, self._slots[child].starts - 1)

    @property
    def wake_at(self) -> float | None:
        """When to call `tick` unless something happens before; None if only events matter."""
        waiting = (slot.due for slot in self._slots if slot.state is ChildState.WAITING)
        return min((due for due in waiting if due > self._now), default=None)

    def begin(self, now: float) -> list[Step]:
        """Start everything, in order."""
        return self._advance(now)

    def tick(self, now: float) -> list[Step]:
        """Time has passed."""
        return self._advance(now)

    def started(self, child: int, now: float) -> list[Step]:
        """A child that was to start runs now."""
        slot = self._slots[child]
        if slot.state is ChildState.STARTING:
            slot.state = ChildState.RUNNING
        return self._advance(now)

    def ended(self, child: int, now: float, *, normal: bool) -> list[Step]:
        """A child has ended: by itself, or because it was stopped."""
        slot = self._slots[child]
        steps: list[Step] = []
        if slot.condemned:
            slot.condemned = False
            again = not self._stopping and slot.restart is not Restart.TEMPORARY
            slot.state = ChildState.WAITING if again else ChildState.ENDED
        elif _is_death(slot.restart, normal=normal):
            steps.append(self._restart(child, now))
        else:
            slot.state = ChildState.ENDED
        return steps + self._advance(now)

    def stop(self, now: float) -> list[Step]:
        """Stop everything, for good."""
        self._condemn_all()
        return self._advance(now)

    def force_stop(self) -> list[Step]:
        """Stop everything at once, whatever the order."""
        self._condemn_all()
        return [self._stop_child(child) for child in self._condemned() if not self._is_stopping(child)]

    def _restart(self, child: int, now: float) -> Step:
        self._restarts.append(now)
        slot = self._slots[child]
        full = len(self._restarts) > self._policy.max_restarts
        if full and now - self._restarts[0] <= self._policy.restart_window_sec:
            slot.state = ChildState.ENDED
            self._condemn_all()
            return GaveUp(child)
        slot.state = ChildState.WAITING
        delay = slot.backoff.next(now - slot.began) * (0.5 + 0.5 * self._jitter())
        alone = self._policy.strategy is Strategy.ONE_FOR_ONE
        for each in self._concerned(child):
            other = self._slots[each]
            if other.alive:
                other.condemned = True
            elif other.restart is not Restart.TEMPORARY:
                other.state = ChildState.WAITING
            # The later of two: children that die one after the other must not shorten each other's back-off.
            other.due = max(other.due, now + delay)
            other.in_order = not alone
        return WillRestart(child, delay)

    def _concerned(self, child: int) -> Sequence[int]:
        match self._policy.strategy:
            case Strategy.ONE_FOR_ONE:
                return (child,)
            case Strategy.ONE_FOR_ALL:
                return range(len(self._slots))
            case Strategy.REST_FOR_ONE:
                return range(child, len(self._slots))

    def _condemn_all(self) -> None:
        self._stopping = True
        for slot in self._slots:
            if slot.alive:
                slot.condemned = True
            else:
                slot.state = ChildState.ENDED

    def _advance(self, now: float) -> list[Step]:
        """Return the steps that are possible now, and count them as done."""
        self._now = now
        condemned = self._condemned()
        if condemned:
            # One at a time, the last first: a child may need those before it until it has ended.
            waits = any(self._is_stopping(child) for child in condemned)
            return [] if waits else [self._stop_child(condemned[-1])]
        steps: list[Step] = []
        before_all_run = True
        for child, slot in enumerate(self._slots):
            waiting = slot.state is ChildState.WAITING
            if waiting and slot.due <= now and (before_all_run or not slot.in_order):
                slot.state = ChildState.STARTING
                slot.began = now
                slot.starts += 1
                steps.append(Start(child))
            if slot.in_order and slot.state in (ChildState.WAITING, ChildState.STARTING):
                before_all_run = False
        return steps

    def _condemned(self) -> list[int]:
        return [child for child, slot in enumerate(self._slots) if slot.condemned]

    def _is_stopping(self, child: int) -> bool:
        return self._slots[child].state is ChildState.STOPPING

    def _stop_child(self, child: int) -> Step:
        self._slots[child].state = ChildState.STOPPING
        return Stop(child)


def _is_death(restart: Restart, *, normal: bool) -> bool:
    return restart is Restart.PERMANENT or (restart is Restart.TRANSIENT and not normal)

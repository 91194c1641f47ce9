"""Events: what happens to a supervisor's children, for watchers in this process and in others."""

# ruff: noqa: TC001 - a message's annotations are read at run time

from __future__ import annotations

import asyncio
from collections import deque
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Final

from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.message import Message
from actors.interfaces.types import int32, uint32

if TYPE_CHECKING:
    from actors.processes.outcome import Outcome

WATCHER_EVENTS: Final = 1000
"""Limit for the events of one watcher; beyond it the oldest are dropped, and counted."""

_NS_PER_SEC: Final = 1_000_000_000


class ChildEventKind(Enum):
    """The kind of an event of a child."""

    STARTED = "started"
    ENDED = "ended"
    RESTARTING = "restarting"
    """It has died and will be started again."""
    GIVEN_UP = "given up"
    """It has died too often; its supervisor stops all children and ends with SupervisorGaveUp."""


@dataclass(frozen=True, kw_only=True)
class ChildEvent:
    """Something that happened to a child.

    Attributes:
        supervisor: The supervisor's name.
        child: The child's name.
        kind: What happened.
        stamp_ns: When, in ns since the epoch.
        restarts: How often the child has been started again so far.
        pid: Of a child that is a process; None for others.
        outcome: How the child ended; None for STARTED.
        delay_sec: RESTARTING: how long at least until it is started again; else 0.
    """

    supervisor: str
    child: str
    kind: ChildEventKind
    stamp_ns: int
    restarts: int
    pid: int | None = None
    outcome: Outcome | None = None
    delay_sec: float = 0.0

    @property
    def reason(self) -> str:
        """Why the child ended, in a few words; empty for STARTED."""
        return "" if self.outcome is None else self.outcome.reason


class ChildEventMessage(Message, type_name="callboard_msgs/msg/ChildEvent"):
    """A `ChildEvent` on a topic.

    Attributes:
        stamp: When it happened.
        supervisor: The supervisor's name.
        child: The child's name.
        kind: "started", "ended", "restarting" or "given up".
        reason: Why the child ended; empty for "started".
        restarts: How often the child has been started again so far.
        pid: Of a child that is a process; 0 for others.
        exit_code: Of a process that exited; also 0 for others: see `reason`.
        signal_name: Of the signal that killed a process; empty for others.
        delay_sec: "restarting": how long at least until the child is started again.
    """

    stamp: Time = Time()
    supervisor: str = ""
    child: str = ""
    kind: str = ""
    reason: str = ""
    restarts: uint32 = 0
    pid: int32 = 0
    exit_code: int32 = 0
    signal_name: str = ""
    delay_sec: float = 0.0


def message_of(event: ChildEvent) -> ChildEventMessage:
    """Return the message that says what an event says."""
    sec, nanosec = divmod(event.stamp_ns, _NS_PER_SEC)
    outcome = event.outcome
    return ChildEventMessage(
        stamp=Time(sec=sec, nanosec=nanosec),
        supervisor=event.supervisor,
        child=event.child,
        kind=event.kind.value,
        reason=event.reason,
        restarts=event.restarts,
        pid=event.pid or 0,
        exit_code=(outcome and outcome.exit_code) or 0,
        signal_name=(outcome and outcome.signal_name) or "",
        delay_sec=event.delay_sec,
    )


class ChildEvents:
    """A watcher: `async for event in supervisor.events()`. It ends with the supervisor.

    It has the events after it was made. One task at a time may iterate.

    Args:
        ended: Whether the supervisor has ended already.

    Attributes:
        dropped: Events dropped because it was too slow.
    """

    def __init__(self, *, ended: bool = False) -> None:
        self.dropped = 0
        self._events: deque[ChildEvent] = deque(maxlen=WATCHER_EVENTS)
        self._more = asyncio.Event()
        self._ended = ended

    def put(self, event: ChildEvent) -> None:
        """Add an event; called by the supervisor.

        Args:
            event: The event.
        """
        self.dropped += len(self._events) == WATCHER_EVENTS
        self._events.append(event)
        self._more.set()

    def end(self) -> None:
        """End the iteration after the events that wait."""
        self._ended = True
        self._more.set()

    def __aiter__(self) -> ChildEvents:
        return self

    async def __anext__(self) -> ChildEvent:
        while not self._events:
            if self._ended:
                raise StopAsyncIteration
            self._more.clear()
            await self._more.wait()
        return self._events.popleft()

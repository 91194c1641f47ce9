"""An event loop whose clock is virtual: when nothing is ready, time jumps to the next timer.

Nothing in it depends on the machine: the same program gives the same history. A program in which no event is
pending raises `Stuck` instead of hanging.
"""

from __future__ import annotations

import asyncio
import heapq
from asyncio.base_events import BaseEventLoop
from itertools import count
from typing import TYPE_CHECKING, Any
from unittest.mock import patch

from actors.callbacks.budget import CallbackBudget
from proto.aio import local_socket
from tests.seams.loops import context_in, run_handle
from tests.simulation.network import Network, host_in

if TYPE_CHECKING:
    from collections import deque
    from collections.abc import Callable, Coroutine
    from contextvars import Context
    from typing import TypeVar

    T = TypeVar("T")

MAX_TURNS = 2_000_000
"""Turns of a loop before it is taken for one that spins without time going on."""

MAX_SECONDS = 5000.0
"""Virtual time after which somebody is taken to wait for ever, while others keep the loop busy."""


class Stuck(Exception):  # noqa: N818 - it is a verdict, not an error of the loop
    """No callback is ready or scheduled although a task still waits, or the loop spins."""


class SimulatedLoop(BaseEventLoop):
    """A loop with a virtual clock, over the in-memory network of one seed.

    What runs belongs to the host in its context. A *frozen* host (a process that got SIGSTOP) runs nothing:
    what is due for it waits until it is thawed, and then comes all at once and late.

    Attributes:
        network: Serves create_connection, create_server and their unix twins.
        turns: Times the loop has gone round.
        errors: What reached the exception handler: an exception nobody took.
        after_turn: Called after each turn of the loop.
        turns: Turns so far.
    """

    _ready: deque[asyncio.Handle]
    _stopping: bool

    def __init__(self, seed: int = 0) -> None:
        super().__init__()
        self._now = 0.0
        self.turns = 0
        self._timers: list[tuple[float, int, asyncio.TimerHandle]] = []
        self._timer_numbers = count()
        self._frozen: dict[str, list[asyncio.Handle]] = {}
        """Frozen hosts, and the callbacks that wait for them."""
        self.after_turn: Callable[[], None] | None = None
        self.ticks = Ticks(0.0)
        """The clock of the brokers' read budgets."""
        self.network = Network(self, seed)
        self.errors: list[dict[str, Any]] = []
        self.set_exception_handler(lambda _, context: self.errors.append(context))

    def time(self) -> float:
        """Return the virtual time in seconds; 0 at the start."""
        return self._now

    def call_at(  # type: ignore[override]
        self, when: float, callback: Callable[..., object], *args: Any, context: Context | None = None
    ) -> asyncio.TimerHandle:
        """Part of BaseEventLoop. Timers of the same time fire in order of creation."""
        timer = asyncio.TimerHandle(when, callback, args, self, context)
        heapq.heappush(self._timers, (when, next(self._timer_numbers), timer))
        return timer

    def _run_once(self) -> None:
        """Part of BaseEventLoop: one turn."""
        ready, timers = self._ready, self._timers
        if not ready and not self._stopping:
            self._jump()
        while timers and (timers[0][0] <= self._now or timers[0][2].cancelled()):
            ready.append(heapq.heappop(timers)[2])
        for _ in range(len(ready)):
            handle = ready.popleft()
            if handle.cancelled():
                continue
            if self._frozen and (held := self._frozen.get(host_in(context_in(handle)))) is not None:
                held.append(handle)
            else:
                run_handle(handle)
        self.turns += 1
        if self.turns == MAX_TURNS:  # not again while the rest is cancelled
            raise Stuck(f"{MAX_TURNS} turns of the loop, now at {self._now:.6f} s")
        if self.after_turn is not None:
            self.after_turn()

    def _jump(self) -> None:
        """Advance the clock to the next timer, as nothing is ready."""
        timers = self._timers
        while timers and timers[0][2].cancelled():
            heapq.heappop(timers)
        if not timers:
            raise Stuck(f"nothing can ever happen again, at {self._now:.6f} s")
        self._now = max(self._now, timers[0][0])
        if self._now > MAX_SECONDS:
            waiting = sorted(f"{task.get_name()}: {task.get_stack()}" for task in asyncio.all_tasks(self))
            raise Stuck(f"at {self._now:.6f} s there still run {waiting}")

    def stall(self, seconds: float) -> None:
        """Advance the clock without running anything, so that timers are late."""
        self._now += seconds

    def freeze(self, host: str) -> None:
        """Freeze a host: it neither reads nor writes, and its timers do not fire. Its kernel continues."""
        self._frozen.setdefault(host, [])

    def thaw(self, host: str) -> None:
        """Continue a host; everything that has become due meanwhile runs."""
        self._ready.extend(self._frozen.pop(host, ()))

    def thaw_all(self) -> None:
        """Continue every host."""
        for host in tuple(self._frozen):
            self.thaw(host)

    def _write_to_self(self) -> None:
        """Part of BaseEventLoop: there is no other thread."""

    async def create_connection(
        self, protocol_factory: Any, host: Any = None, port: Any = None, **_: Any
    ) -> Any:
        """Connect over the network."""
        return await self.network.connect(protocol_factory, f"{host}:{port}")

    async def create_unix_connection(self, protocol_factory: Any, path: Any = None, **_: Any) -> Any:
        """Connect to a path over the network."""
        return await self.network.connect(protocol_factory, str(path))

    async def create_server(self, protocol_factory: Any, host: Any = None, port: Any = None, **_: Any) -> Any:
        """Listen on the network. Port 0 picks one."""
        return self.network.listen(protocol_factory, host, port)

    async def create_unix_server(self, protocol_factory: Any, path: Any = None, **_: Any) -> Any:
        """Listen on a path of the network."""
        return self.network.listen(protocol_factory, str(path), None)


class Ticks:
    """A clock for budgets that advances with each reading, the same in each run of a program."""

    def __init__(self, clock_step_sec: float) -> None:
        self._now = 0.0
        self._clock_step_sec = clock_step_sec

    def __call__(self) -> float:
        self._now += self._clock_step_sec
        return self._now


def simulate(
    main: Callable[[SimulatedLoop], Coroutine[Any, Any, T]], seed: int = 0, *, clock_step_sec: float = 0.0
) -> T:
    """Run a coroutine function on a loop of its own, to its end in virtual time.

    Each node has a callback budget of its own, because nodes are processes here. Brokers should get the
    loop's `ticks` as their clock.

    Args:
        main: The coroutine function.
        seed: The network's.
        clock_step_sec: Seconds that seem to pass between two readings of the clock of a budget.

    Raises:
        Stuck: It waits for something that cannot come.
        ExceptionGroup: Exceptions that nobody took.
    """
    loop = SimulatedLoop(seed)
    loop.ticks = Ticks(clock_step_sec)

    def budget(_: asyncio.AbstractEventLoop) -> CallbackBudget:
        return CallbackBudget(Ticks(clock_step_sec))

    try:
        asyncio.set_event_loop(loop)
        try:
            # A socket beside the port would be a real one.
            with patch.object(CallbackBudget, "of", budget), patch.dict(local_socket.HOSTS, clear=True):
                result = loop.run_until_complete(main(loop))
        finally:
            _cancel_all(loop)
        if loop.errors:
            raise ExceptionGroup(
                "exceptions that nobody took",
                [context.get("exception") or RuntimeError(context["message"]) for context in loop.errors],
            )
        return result
    finally:
        asyncio.set_event_loop(None)
        loop.close()


def _cancel_all(loop: SimulatedLoop) -> None:
    """Cancel the remaining tasks after a failure, so that none is destroyed pending."""
    loop.thaw_all()
    left = asyncio.all_tasks(loop)
    for task in left:
        task.cancel()
    if left:
        loop.run_until_complete(asyncio.gather(*left, return_exceptions=True))
    loop.run_until_complete(loop.shutdown_asyncgens())

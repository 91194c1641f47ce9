"""An event loop whose clock is virtual: when nothing is ready, time jumps to the next timer.

Nothing in it depends on the machine: the same program gives the same history. A program in which nothing can
ever happen again raises `Stuck` instead of hanging.
"""

from __future__ import annotations

import asyncio
from asyncio.base_events import BaseEventLoop
from typing import TYPE_CHECKING, Any

from tests.simulation.network import Network

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine
    from typing import TypeVar

    T = TypeVar("T")

MAX_TURNS = 2_000_000
"""Turns of a loop before it is taken for one that spins without time going on."""

MAX_SECONDS = 5000.0
"""Virtual time after which somebody is taken to wait for ever, while others keep the loop busy."""


class Stuck(Exception):  # noqa: N818 - it is a verdict, not an error of the loop
    """Nothing is ready, nothing is scheduled, and somebody still waits; or the loop spins."""


class _Selector:
    """Stands where BaseEventLoop expects to wait for sockets: moves the clock instead."""

    def __init__(self, loop: SimulatedLoop) -> None:
        self._loop = loop

    def select(self, timeout: float | None) -> list[Any]:
        self._loop.idle(timeout)
        return []


class SimulatedLoop(BaseEventLoop):
    """A loop with a virtual clock, over the in-memory network of one seed.

    Attributes:
        network: Serves create_connection, create_server and their unix twins.
        errors: What reached the exception handler: an exception nobody took.
    """

    _scheduled: list[asyncio.TimerHandle]

    def __init__(self, seed: int = 0) -> None:
        super().__init__()
        self._now = 0.0
        self._clock_resolution = 1e-9
        self._selector = _Selector(self)
        self._turns = 0
        self.network = Network(self, seed)
        self.errors: list[dict[str, Any]] = []
        self.set_exception_handler(lambda _, context: self.errors.append(context))

    def time(self) -> float:
        """Return the virtual time in seconds; 0 at the start."""
        return self._now

    def idle(self, timeout: float | None) -> None:
        """Called once a turn: the loop would sleep this long now (None: for ever)."""
        self._turns += 1
        if self._turns > MAX_TURNS:
            raise Stuck(f"{MAX_TURNS} turns of the loop, now at {self._now:.6f} s")
        if self._now > MAX_SECONDS:
            waiting = sorted(f"{task.get_name()}: {task.get_stack()}" for task in asyncio.all_tasks(self))
            raise Stuck(f"at {self._now:.6f} s there still run {waiting}")
        if timeout is None:
            raise Stuck(f"nothing can ever happen again, at {self._now:.6f} s")
        if timeout > 0:
            self._now = max(self._now, self._scheduled[0].when())

    def stall(self, seconds: float) -> None:
        """Let time pass in which nobody in the process runs: every timer comes late."""
        self._now += seconds

    def _process_events(self, event_list: list[Any]) -> None:
        """Part of BaseEventLoop: there are no events."""

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


def simulate(main: Callable[[SimulatedLoop], Coroutine[Any, Any, T]], seed: int = 0) -> T:
    """Run a coroutine function on a loop of its own, to its end in virtual time.

    Raises:
        Stuck: It waits for something that cannot come.
        ExceptionGroup: Exceptions that nobody took.
    """
    loop = SimulatedLoop(seed)
    try:
        asyncio.set_event_loop(loop)
        try:
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
    """After a failure: end what is left, so that nothing is destroyed pending."""
    left = asyncio.all_tasks(loop)
    for task in left:
        task.cancel()
    if left:
        loop.run_until_complete(asyncio.gather(*left, return_exceptions=True))
    loop.run_until_complete(loop.shutdown_asyncgens())

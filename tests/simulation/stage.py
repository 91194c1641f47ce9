"""A stage for one scenario: a broker and named nodes, each on its own host, for tests of one situation."""

from __future__ import annotations

import asyncio
import random
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING, Any, TypeVar

import actors
from broker.options import BrokerOptions
from broker.server import Broker
from tests.actors.meeting import BARE
from tests.simulation.loop import SimulatedLoop, simulate
from tests.simulation.network import BROKER, on_host

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine

N = TypeVar("N", bound=actors.Node)


class Stage:
    """The scene that is being played."""

    def __init__(self, loop: SimulatedLoop, stack: AsyncExitStack, options: BrokerOptions) -> None:
        self.loop = loop
        self.options = options
        self.network = loop.network
        self.broker: Broker
        self._stack = stack
        self._broker_task: asyncio.Task[None] | None = None
        self._broker_stop = asyncio.Event()

    async def enter(
        self, name: str, *, host: str | None = None, url: str | None = None, **options: Any
    ) -> actors.Node:
        """Bring up a node on a host of its own (by default its name), without standard endpoints."""
        return await self.enter_as(actors.Node, name, host=host, url=url, **options)

    async def enter_as(
        self,
        node_type: Callable[..., N],
        name: str,
        *,
        host: str | None = None,
        url: str | None = None,
        **options: Any,
    ) -> N:
        """Bring up a node of another class."""
        with on_host(host or name):
            node = node_type(name, url=url, use_global_arguments=False, **{**BARE, **options})
            await self._stack.enter_async_context(node)
        await self.until(lambda: node.connected)
        return node

    async def start_broker(self) -> None:
        """Bring up a broker."""
        ready = asyncio.Event()
        self._broker_stop = asyncio.Event()

        async def run() -> None:
            async with Broker(self.options, clock=self.loop.ticks) as self.broker:
                ready.set()
                await self._broker_stop.wait()

        with on_host(BROKER):
            self._broker_task = asyncio.create_task(run())
        await ready.wait()

    async def stop_broker(self) -> None:
        """Let the broker end in order."""
        if self._broker_task is not None:
            self._broker_stop.set()
            await self._broker_task

    async def crash_broker(self) -> None:
        """Kill the broker."""
        assert self._broker_task is not None
        self.network.crash(BROKER)
        self._broker_task.cancel()
        await asyncio.wait({self._broker_task})

    async def until(
        self, condition: Callable[[], bool], limit: float = 10.0, *, step: float = 0.001
    ) -> float:
        """Wait until something holds, looking again after each step; return how long it took."""
        began = self.loop.time()
        while not condition():
            assert self.loop.time() < began + limit, "it never comes true"
            await asyncio.sleep(step)
        return self.loop.time() - began


def play(
    scene: Callable[[Stage], Coroutine[Any, Any, None]],
    seed: int = 0,
    *,
    options: BrokerOptions | None = None,
) -> None:
    """Run a scene with a broker; nothing may be left of it at the end."""

    async def main(loop: SimulatedLoop) -> None:
        async with AsyncExitStack() as stack:
            stage = Stage(loop, stack, options or BrokerOptions())
            await stage.start_broker()
            await scene(stage)
            stage.network.heal()
        await stage.stop_broker()
        await asyncio.sleep(5)
        assert not loop.network.open
        assert asyncio.all_tasks() == {asyncio.current_task()}

    state = random.getstate()
    random.seed(seed)  # of connectors: how long they wait
    try:
        simulate(main, seed)
    finally:
        random.setstate(state)

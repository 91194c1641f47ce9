"""A simulated broker process: it starts, drains, stops, crashes, and restarts at its address."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from broker.options import BrokerOptions
from broker.server import Broker
from tests.seams.brokers import dispatcher_of
from tests.simulation.mesh_network import SimulatedEngine
from tests.simulation.network import on_host

if TYPE_CHECKING:
    from collections.abc import Callable

    from broker.mesh.engine.engine import Engine, Host
    from broker.routing.router import Router
    from tests.simulation.mesh_network import MeshNetwork
    from tests.simulation.world import World

STALL_SEC: Final = 2.0
"""How long a reader may stall; members ask for much more, as they are slow without faults."""

STOP_SEC: Final = 15.0
"""A broker drains and stops within this."""


class BrokerProcess:
    """A host that runs a broker, most of the time.

    Attributes:
        broker: The latest one; None before the first.
    """

    def __init__(self, world: World, host: str, port: int, mesh: MeshNetwork | None = None) -> None:
        self.host = host
        self.url = f"callboard://127.0.0.1:{port}"
        self.broker: Broker | None = None
        self._world = world
        self._port = port
        self._mesh = mesh
        self._task: asyncio.Task[None] | None = None
        self._stop = asyncio.Event()
        self._up = asyncio.Event()

    @property
    def alive(self) -> bool:
        """Whether the process runs."""
        return self._task is not None and not self._task.done()

    def routers(self) -> list[Router]:
        """Return its graphs."""
        return [] if self.broker is None else list(dispatcher_of(self.broker).joined)

    async def start(self) -> None:
        """Start a broker and wait until it listens."""
        self._world.record(f"start {self.host}")
        self._stop, self._up = asyncio.Event(), asyncio.Event()
        with on_host(self.host):
            self._task = asyncio.create_task(self._run(), name=self.host)
        up = asyncio.create_task(self._up.wait())
        await asyncio.wait({up, self._task}, return_when=asyncio.FIRST_COMPLETED)
        up.cancel()
        if self._task.done():
            await self._task

    async def _run(self) -> None:
        options = BrokerOptions(
            port=self._port,
            max_link_bytes=self._world.max_link_bytes,
            keep_all_stall_sec=STALL_SEC,
            mesh_name=self.host,
        )
        self.broker = Broker(options, clock=self._world.loop.ticks, mesh_engine=self._make_engine)
        async with self.broker:
            self._up.set()
            await self._stop.wait()

    def raise_ceiling(self) -> None:
        """Reload the broker with what usually may wait for a link."""
        assert self.broker is not None
        options = self.broker.options
        self.broker.reconfigure(replace(options, max_link_bytes=BrokerOptions().max_link_bytes))

    @property
    def _make_engine(self) -> Callable[[int, Host], Engine] | None:
        mesh = self._mesh
        return None if mesh is None else lambda number, host: SimulatedEngine(mesh, number, host)

    async def stop(self) -> None:
        """Let the broker drain and end."""
        assert self._task is not None
        self._world.record(f"stop {self.host}")
        self._world.thaw(self.host)
        began, lost = self._world.loop.time(), self._world.lost_time(self.host)
        self._stop.set()
        await self._task
        took = self._world.loop.time() - began - (self._world.lost_time(self.host) - lost)
        if took > STOP_SEC:
            self._world.complain(f"the broker took {took:.3f} s to stop")

    async def crash(self, *, silent: bool) -> None:
        """End the broker as a dead process, or a machine without power, ends."""
        assert self._task is not None
        self._world.record(f"crash {self.host}, silent: {silent}")
        self._world.network.crash(self.host, silent=silent)
        if self._mesh is not None:
            self._mesh.kill(self.host, silent=silent)
        self._world.thaw(self.host)
        self._task.cancel()
        await asyncio.wait({self._task})

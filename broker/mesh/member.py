"""A broker's part in a mesh: one engine for all its graphs."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Final

from broker.mesh.channel import MeshChannel
from broker.mesh.mesh import Mesh
from proto.aio.tasks import cancel_and_wait, keep_running

if TYPE_CHECKING:
    from collections.abc import Callable

    from broker.deliveries import Delivery
    from broker.dispatcher import Dispatcher
    from broker.mesh.engine import Engine, Host
    from broker.router import Router

HEARTBEAT_SEC: Final = 1.0


class MeshMember:
    """A broker in a mesh (`engine.Host`).

    Args:
        number: The broker's number in the mesh, 1 to 2^31 - 1.
        dispatcher: The broker's links.
        make_engine: Returns an engine for a broker's number and host.

    Attributes:
        number: As given.
    """

    def __init__(
        self, number: int, dispatcher: Dispatcher, make_engine: Callable[[int, Host], Engine]
    ) -> None:
        self.number = number
        self._dispatcher = dispatcher
        self._engine = make_engine(number, self)
        self._meshes: dict[int, Mesh] = {}
        self._heartbeat: asyncio.Task[None] | None = None

    async def start(self) -> None:
        """Connect to other brokers."""
        await self._engine.start()
        beats = keep_running("The mesh's heartbeat", self._beat)
        self._heartbeat = asyncio.get_running_loop().create_task(beats)

    async def stop(self) -> None:
        """Disconnect."""
        if self._heartbeat is not None:
            await cancel_and_wait(self._heartbeat)
        await self._engine.stop()

    async def _beat(self) -> None:
        while True:
            await asyncio.sleep(HEARTBEAT_SEC)
            for mesh in self._meshes.values():
                mesh.beat()
            self.flush()

    def add(self, router: Router) -> MeshChannel:
        """Join the graph of a router; return the channel for its peer."""
        domain = router.domain

        def deliver(deliveries: list[Delivery]) -> None:
            self._dispatcher.deliver(router, deliveries)
            self._dispatcher.reports.report_soon()

        most = self._dispatcher.options.max_mesh_endpoints
        mesh = self._meshes[domain] = Mesh(self.number, router, deliver, self._warn, max_endpoints=most)
        self._engine.join(domain)
        return MeshChannel(mesh, self._engine, domain)

    def _warn(self, what: str, broker: int, text: str) -> None:
        self._dispatcher.warnings.warn(what, "Mesh: %s: %08x: %s", what, broker, text)

    def mesh(self, domain: int) -> Mesh:
        """Return the mesh of a domain, in which this broker takes part from now on."""
        if domain not in self._meshes:
            self._dispatcher.router(domain)
        return self._meshes[domain]

    def flush(self) -> None:
        """Send what the routers have returned."""
        self._dispatcher.flush()

"""A broker's part in a mesh: one session for all its graphs."""

from __future__ import annotations

import asyncio
import secrets
from typing import TYPE_CHECKING

from broker.mesh.channel import MeshChannel
from broker.mesh.mesh import Mesh
from broker.mesh.zenoh_engine import ZenohEngine, config_for

if TYPE_CHECKING:
    from broker.dispatcher import Dispatcher
    from broker.router import Router


class MeshMember:
    """A broker in a mesh.

    Args:
        dispatcher: The broker's links.
        listen, connect: Zenoh endpoints such as "tcp/0.0.0.0:7447"; None for none.

    Attributes:
        number: The broker's number in the mesh.
    """

    def __init__(self, dispatcher: Dispatcher, listen: str | None, connect: str | None) -> None:
        self.number = 1 + secrets.randbelow(2**31 - 1)
        self._dispatcher = dispatcher
        self._engine = ZenohEngine(self.number, asyncio.get_running_loop(), self)
        self._endpoints = listen, connect
        self._meshes: dict[int, Mesh] = {}

    async def start(self) -> None:
        """Open the session."""
        await asyncio.to_thread(self._engine.open, config_for(*self._endpoints))

    async def stop(self) -> None:
        """Close it."""
        await asyncio.to_thread(self._engine.close)

    def add(self, router: Router) -> MeshChannel:
        """Join the graph of a router; return the channel for its peer."""
        domain = router.domain

        def deliver(deliveries: list[object]) -> None:
            self._dispatcher.deliver(router, deliveries)  # type: ignore[arg-type]
            self._dispatcher.reports.report_soon()

        mesh = self._meshes[domain] = Mesh(router, deliver)  # type: ignore[arg-type]
        self._engine.join(domain)
        return MeshChannel(mesh, self._engine, domain)

    def mesh(self, domain: int) -> Mesh:
        """Return the mesh of a domain, in which this broker takes part from now on."""
        if domain not in self._meshes:
            self._dispatcher.router(domain)
        return self._meshes[domain]

    def flush(self) -> None:
        """Send what the routers have returned."""
        self._dispatcher.flush()

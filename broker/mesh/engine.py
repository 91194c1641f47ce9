"""What carries messages between brokers, and what it calls; Zenoh is one such engine."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from broker.mesh.mesh import Mesh
    from broker.mesh.messages import Message


class Engine(Protocol):
    """Carries messages between brokers. It calls its host in the event loop."""

    @property
    def full(self) -> bool:
        """Whether so much waits that nothing else should be given to it; `Host.flush` follows."""
        ...

    async def start(self) -> None:
        """Connect to other brokers."""
        ...

    def join(self, domain: int) -> None:
        """Take part in the graph of a domain."""
        ...

    def send(self, domain: int, messages: list[Message]) -> None:
        """Send messages about one graph, in order."""
        ...

    async def stop(self) -> None:
        """Send what waits, and disconnect."""
        ...


class Host(Protocol):
    """The broker that uses an engine."""

    def mesh(self, domain: int) -> Mesh:
        """Return the mesh of a domain, in which this broker takes part from now on.

        The engine calls its `add_broker`, `remove_broker`, `take_snapshot`, `take_heartbeat` and `receive`,
        and answers other brokers with its `snapshot`.
        """
        ...

    def flush(self) -> None:
        """Send what the router has returned; to be called after those."""
        ...

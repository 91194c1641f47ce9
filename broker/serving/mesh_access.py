"""What the broker's shell knows of a mesh: protocols that `broker.mesh.engine` fulfils.

The shell works without a mesh and loads nothing of it; `broker/server.py` lets a broker join one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from broker.routing.deliveries import Recipient

if TYPE_CHECKING:
    from broker.access.rules import AccessRules
    from broker.routing.router import Router
    from proto.wire.stats import MeshBrokerStats, MeshStats


class MeshOutbox(Recipient, Protocol):
    """What waits for other brokers in one graph; counts as a link does in the broker's memory."""

    held_bytes: int
    """As counted last."""

    @property
    def peer(self) -> int:
        """The peer that stands for all other brokers at the graph's router."""
        ...

    @property
    def has_unsent(self) -> bool:
        """Whether anything waits for the engine."""
        ...

    def flush(self) -> None:
        """Send what waits until the engine is full."""
        ...

    def drop_all(self, reason: str) -> None:
        """Drop all that waits; the reason is for the log."""
        ...


class MeshMembership(Protocol):
    """A broker's part in a mesh, for all its graphs."""

    number: int
    """The broker's number in the mesh."""

    def add(self, router: Router) -> MeshOutbox:
        """Join the graph of a router."""
        ...

    def apply(self, rules: AccessRules) -> None:
        """Apply changed access rules."""
        ...

    def brokers(self, domain: int) -> tuple[MeshBrokerStats, ...]:
        """Return the brokers in a domain, this one first."""
        ...

    def totals(self) -> MeshStats:
        """Return the numbers of all domains together."""
        ...

    async def stop(self) -> None:
        """Disconnect when the others have received what was sent."""
        ...

"""What learns which endpoints of this broker's own nodes are added to the graph and removed from it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from broker.routing.records import Endpoint, ServiceRecord


class ExportListener(Protocol):
    """Learns which endpoints of this broker are in the graph, to tell other brokers."""

    def allows(self, endpoint: Endpoint) -> bool:
        """Return whether other brokers may know an endpoint."""
        ...

    def joined(self, endpoint: Endpoint) -> None:
        """Note an endpoint that is new or back."""
        ...

    def left(self, endpoint: Endpoint) -> None:
        """Note an endpoint that is gone or suspended."""
        ...

    def retired(self, server: ServiceRecord) -> None:
        """Note a server that gets no more requests and may answer those that it has."""
        ...

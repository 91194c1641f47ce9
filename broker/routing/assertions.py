"""ASSERT frames: publishers' signs of liveliness, forwarded to their readers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from broker.routing.deliveries import Send
from proto.wire.frames import Assert

if TYPE_CHECKING:
    from collections.abc import Callable

    from broker.routing.deliveries import Delivery
    from broker.routing.records import Peer, PublisherRecord
    from broker.routing.routes import Routes


class Assertions:
    """The ASSERTs that have not been forwarded yet.

    Args:
        emit: Takes each delivery.
        routes: Knows the publishers.
    """

    def __init__(self, emit: Callable[[Delivery], None], routes: Routes) -> None:
        self._emit = emit
        self._routes = routes
        self._asserted: dict[int, PublisherRecord] = {}

    def add(self, peer: Peer, frame: Assert) -> None:
        """Forward a publisher's ASSERT to its readers with the next `report`.

        Raises:
            ProtocolError: The publisher is not this peer's.
        """
        publisher = self._routes.publisher(peer, frame.publisher)
        self._asserted[publisher.key] = publisher

    def report(self) -> None:
        """Forward the ASSERTs since the last call, one for each publisher, to its readers."""
        if self._asserted:
            asserted, self._asserted = self._asserted, {}
            for publisher in asserted.values():
                for route in publisher.routes.values():
                    self._emit(Send(route.peer.id, Assert(publisher.key)))

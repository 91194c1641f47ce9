"""REQUEST, REPLY and CANCEL frames: finds the client or server whose calls they are about."""

from __future__ import annotations

from typing import TYPE_CHECKING

from broker.routing.calls import NO_SERVER, Calls, answer
from broker.routing.deliveries import Send
from broker.routing.records import ClientRecord, ServiceRecord
from proto.wire import frames
from proto.wire.codes import Status

if TYPE_CHECKING:
    from collections.abc import Callable

    from broker.routing.deliveries import Delivery
    from broker.routing.mirrored import Forward
    from broker.routing.records import Peer
    from broker.routing.services import Services


class CallFrames:
    """The handlers of these frames in one graph.

    Args:
        emit: Takes each delivery.
        calls: The graph's calls.
        services: Knows the servers for a client's calls.
    """

    def __init__(self, emit: Callable[[Delivery], None], calls: Calls, services: Services) -> None:
        self._emit = emit
        self._calls = calls
        self._services = services

    def request(self, peer: Peer, frame: frames.Request) -> None:
        """Send a client's calls to servers."""
        client = peer.endpoints.get(frame.endpoint)
        if isinstance(client, ClientRecord):
            self._calls.request(client, self._services.pool(client), frame.entries)
            return
        # The client was refused, or has just been undeclared.
        for entry in frame.entries:
            refusal = answer(entry.call, Status.UNAVAILABLE, NO_SERVER)
            self._emit(Send(peer.id, frames.Reply(frame.endpoint, (refusal,))))

    def forward(self, peer: Peer, frame: Forward) -> None:
        """Send calls of a client of another broker to the server that this broker has chosen."""
        client = peer.endpoints.get(frame.request.endpoint)
        if isinstance(client, ClientRecord):
            server = self._services.only(client, frame.server)
            self._calls.request(client, server, frame.request.entries)

    def reply(self, peer: Peer, frame: frames.Reply) -> None:
        """Send a server's answers to the clients."""
        server = peer.endpoints.get(frame.endpoint)
        if isinstance(server, ServiceRecord):
            self._calls.reply(server, frame.entries)
        else:
            self._calls.late += len(frame.entries)

    def cancel(self, peer: Peer, frame: frames.Cancel) -> None:
        """Cancel calls of a client."""
        client = peer.endpoints.get(frame.endpoint)
        if isinstance(client, ClientRecord):
            self._calls.cancel(client, frame.calls)

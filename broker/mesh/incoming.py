"""Turns messages from other brokers into frames of the router's peer for the mesh."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from broker.mirrored import Forward, Open
from proto import frames
from proto.batches import with_raw

if TYPE_CHECKING:
    from collections.abc import Callable

    from broker.deliveries import Delivery
    from broker.mesh.calls import MeshCalls
    from broker.mesh.imports import MeshImports
    from broker.mesh.messages import Direct
    from broker.mirrored import Mirrored
    from broker.router import Router
    from proto.frames import Frame


class MeshReceiver:
    """What other brokers send about one graph.

    Args:
        router: The graph's router.
        peer: The id of its peer for the mesh.
        imports: The endpoints of other brokers.
        calls: The calls to other brokers.
        deliver: Takes what the router returns.

    Attributes:
        unexpected: Messages about endpoints that are not, or no longer, known.
    """

    def __init__(
        self,
        router: Router,
        peer: int,
        imports: MeshImports,
        calls: MeshCalls,
        deliver: Callable[[list[Delivery]], None],
    ) -> None:
        self._router = router
        self._peer = peer
        self._imports = imports
        self._calls = calls
        self._deliver = deliver
        self.unexpected = 0
        self._handlers: dict[type[Any], Callable[[int, Any, int], None]] = {
            frames.Attached: self._attached,
            frames.Replay: self._replayed,
            frames.Grant: self._granted,
            frames.Request: self._requested,
            frames.Reply: self._replied,
            frames.Cancel: self._cancelled,
        }

    def published(self, frame: frames.Batch | frames.Assert) -> None:
        """Take what a publisher of another broker has sent to all subscriptions."""
        record = self._router.routes.publishers.get(frame.publisher)
        if record is None or not record.opened or not record.peer.mesh:
            self.unexpected += isinstance(frame, frames.Batch)
            return
        self._handle(frame)

    def received(self, broker: int, message: Direct) -> None:
        """Take what another broker has sent to this one.

        Args:
            broker: The sender.
            message: Its message.
        """
        handler = self._handlers.get(type(message.frame))
        if handler is None:
            self.unexpected += 1
        else:
            handler(broker, message.frame, message.endpoint)

    def _attached(self, _broker: int, frame: frames.Attached, first: int) -> None:
        record = self._router.routes.publishers.get(frame.publisher)
        if record is None or not record.peer.mesh:
            self.unexpected += 1
            return
        self._handle(Open(frame.publisher, first, frame.first_sequence))

    def _replayed(self, _broker: int, frame: frames.Replay, _endpoint: int) -> None:
        self.published(with_raw(frames.Batch(*frame[1:], b"")))

    def _granted(self, broker: int, frame: frames.Grant, _endpoint: int) -> None:
        endpoint = self._imports.id_of(broker, frame.subscription)
        if endpoint is not None:
            self._handle(frame._replace(subscription=endpoint))

    def _requested(self, broker: int, frame: frames.Request, server: int) -> None:
        client = self._imports.id_of(broker, frame.endpoint)
        if client is None:
            self.unexpected += 1
            return
        key = self._router.declarations.key_of(server)
        self._handle(Forward(key, frame._replace(endpoint=client)))

    def _replied(self, _broker: int, frame: frames.Reply, _endpoint: int) -> None:
        servers: dict[int, list[frames.ReplyEntry]] = {}
        for entry in frame.entries:
            ended = self._calls.end(entry.call)
            if ended is not None:
                servers.setdefault(ended.server, []).append(entry)
        for server_id, entries in servers.items():
            self._handle(frames.Reply(server_id, tuple(entries)))

    def _cancelled(self, broker: int, frame: frames.Cancel, _endpoint: int) -> None:
        client = self._imports.id_of(broker, frame.endpoint)
        if client is not None:
            self._handle(frame._replace(endpoint=client))

    def _handle(self, frame: Frame | Mirrored) -> None:
        self._deliver(self._router.handle(self._peer, frame))

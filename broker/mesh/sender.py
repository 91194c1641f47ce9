"""Turns what the router sends to the mesh into messages to other brokers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from broker.mesh.messages import Publish
from broker.routing.records import ServiceRecord
from proto.wire import frames
from proto.wire.codec import encode
from proto.wire.mesh_keys import broker_of_key

if TYPE_CHECKING:
    from collections.abc import Callable

    from broker.mesh.calls import MeshCalls
    from broker.mesh.exports import MeshExports
    from broker.mesh.imports import MeshImports
    from broker.routing.router import Router
    from proto.wire.frames import Buffer, Frame


class MeshSender:
    """What one graph's router sends to the mesh.

    Args:
        router: The graph's router.
        exports, imports: Its endpoints, and those of other brokers.
        calls: The calls to other brokers.
        peer: The id of the router's peer for the mesh.
        publish: Takes what goes to all brokers that subscribe to a topic.
        direct: Takes what goes to one broker: its number, the frame, and `Direct.endpoint`.
    """

    def __init__(
        self,
        router: Router,
        exports: MeshExports,
        imports: MeshImports,
        calls: MeshCalls,
        *,
        peer: int,
        publish: Callable[[Publish], None],
        direct: Callable[[int, Frame, int], None],
    ) -> None:
        self._router = router
        self._peer = peer
        self._exports = exports
        self._imports = imports
        self._calls = calls
        self._emit_publish = publish
        self._direct = direct
        self._handlers: dict[type[Any], Callable[[Any], None]] = {
            frames.Batch: self._send_batch,
            frames.Assert: self._send_assert,
            frames.Attached: self._send_attached,
            frames.Replay: self._send_replay,
            frames.Detached: self._send_detached,
            frames.Grant: self._send_grant,
            frames.Request: self._send_request,
            frames.Cancel: self._send_cancel,
            frames.Reply: self._send_reply,
        }

    def send(self, frame: Frame) -> None:
        """Take a frame that the router has sent to the mesh."""
        handler = self._handlers.get(type(frame))
        if handler is not None:
            handler(frame)

    def broker_of(self, endpoint: int) -> int:
        """Return whose endpoint has an id at the router; 0 if it has gone."""
        remote = self._imports.remote(endpoint)
        return 0 if remote is None else remote.broker

    def _send_batch(self, frame: frames.Batch) -> None:
        self._publish(frame.publisher, frame.raw)

    def _send_assert(self, frame: frames.Assert) -> None:
        self._publish(frame.publisher, encode(frame))

    def _publish(self, publisher: int, raw: Buffer) -> None:
        # Of a publisher that has left, the last messages still go out under its topic.
        record = self._router.routes.publishers.get(publisher) or self._exports.leaving(publisher)
        if record is not None:
            self._emit_publish(Publish(record.name, raw))

    def _send_attached(self, frame: frames.Attached) -> None:
        by_broker: dict[int, list[int]] = {}
        for endpoint in frame.subscriptions:
            remote = self._imports.remote(endpoint)
            if remote is not None:
                by_broker.setdefault(remote.broker, []).append(remote.number)
        record = self._router.routes.publishers.get(frame.publisher)
        first = frame.first_sequence
        if record is not None:  # what is latched follows, and what the publisher sends again
            latched = record.latched
            first = min(first, latched[0].first_sequence if latched else record.next_sequence)
        for broker, numbers in by_broker.items():
            self._direct(broker, frame._replace(subscriptions=tuple(numbers)), first)

    def _send_replay(self, frame: frames.Replay) -> None:
        remote = self._imports.remote(frame.subscription)
        if remote is not None:
            self._direct(remote.broker, frame._replace(subscription=remote.number), 0)

    def _send_detached(self, frame: frames.Detached) -> None:
        self._exports.sent_all(frame.publisher)

    def _send_grant(self, frame: frames.Grant) -> None:
        self._direct(broker_of_key(frame.publisher), frame, 0)

    def _send_request(self, frame: frames.Request) -> None:
        server = self._imports.remote(frame.endpoint)
        record = self._router.endpoint(self._peer, frame.endpoint)
        if server is None or not isinstance(record, ServiceRecord):
            return
        # The router numbers calls of all clients together; the other broker matches them by client, as it
        # does for its own.
        clients: dict[int, list[frames.RequestEntry]] = {}
        for entry in frame.entries:
            pending = record.pending.get(entry.call)
            if pending is None:  # cancelled before it was sent
                continue
            client = pending.client.number
            self._calls.begin(entry.call, client, frame.endpoint)
            clients.setdefault(client, []).append(entry)
        for client, entries in clients.items():
            request = frames.Request(client, tuple(entries))
            self._direct(server.broker, request, server.number)

    def _send_cancel(self, frame: frames.Cancel) -> None:
        server = self._imports.remote(frame.endpoint)
        clients: dict[int, list[int]] = {}
        for call in frame.calls:
            ended = self._calls.end(call)
            if ended is not None:
                clients.setdefault(ended.client, []).append(call)
        if server is not None:
            for client, calls in clients.items():
                self._direct(server.broker, frames.Cancel(client, tuple(calls)), server.number)

    def _send_reply(self, frame: frames.Reply) -> None:
        client = self._imports.remote(frame.endpoint)
        if client is not None:
            self._direct(client.broker, frame._replace(endpoint=client.number), 0)

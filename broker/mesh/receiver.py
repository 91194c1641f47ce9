"""Turns messages from other brokers into frames of the router's peer for the mesh."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from broker.routing.calls import NO_SERVER, answer
from broker.routing.mirrored import Forward, Open
from proto.errors import ErrorCode, ProtocolError
from proto.queues.batches import with_raw
from proto.wire import frames
from proto.wire.codes import Status
from proto.wire.mesh_keys import broker_of_key

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from broker.mesh.calls import MeshCalls
    from broker.mesh.imports import MeshImports
    from broker.mesh.messages import Direct
    from broker.routing.deliveries import Delivery
    from broker.routing.mirrored import Mirrored
    from broker.routing.records import PublisherRecord
    from broker.routing.router import Router
    from proto.wire.frames import Frame


class MeshReceiver:
    """What other brokers send about one graph.

    A broker may speak for its own endpoints only. What can be about endpoints that have just gone, or that
    the router refuses, is counted and ignored.

    Args:
        router: The graph's router.
        peer: The id of its peer for the mesh.
        imports: The endpoints of other brokers.
        calls: The calls to other brokers.
        deliver: Takes what the router returns.
        direct: Takes what goes to one broker: its number, and the frame.
        others: What handles frames that do not concern an endpoint, by their type.

    Attributes:
        unexpected: Messages about endpoints that are not, or no longer, known.
    """

    def __init__(
        self,
        router: Router,
        peer: int,
        imports: MeshImports,
        calls: MeshCalls,
        *,
        deliver: Callable[[list[Delivery]], None],
        direct: Callable[[int, Frame], None],
        others: Mapping[type[Any], Callable[[int, Any], None]],
    ) -> None:
        self._router = router
        self._peer = peer
        self._imports = imports
        self._calls = calls
        self._deliver = deliver
        self._direct = direct
        self._others = others
        self.unexpected = 0
        self._handlers: dict[type[Any], Callable[[int, Any, int], None]] = {
            frames.Attached: self._attached,
            frames.Replay: self._replayed,
            frames.Grant: self._granted,
            frames.Request: self._requested,
            frames.Reply: self._replied,
            frames.Cancel: self._cancelled,
        }

    def published(self, broker: int, frame: frames.Batch | frames.Assert, topic: str) -> None:
        """Take what a publisher of another broker has sent to all subscriptions.

        Args:
            broker: The sender.
            frame: What it has sent.
            topic: To whose key; "" if to this broker. A frame of another topic's publisher is ignored: access
                control of Zenoh may allow its writer the one key only.

        Raises:
            ProtocolError: The publisher is not its own, or exceeds the greatest sequence number.
        """
        record = self._publisher(broker, frame.publisher)
        if record is None or not record.opened or (topic and topic != record.name):
            self.unexpected += frame.length if isinstance(frame, frames.Batch) else 0
            return
        # The gap alone is no loss: a KEEP_LAST publisher may have dropped messages. It only counts if credit
        # is missing, too (`held_publishers.stuck_publishers`).
        if isinstance(frame, frames.Batch) and frame.first_sequence > record.next_sequence:
            record.has_gap = True
        self._handle(frame)

    def received(self, broker: int, message: Direct) -> None:
        """Take what another broker has sent to this one.

        Args:
            broker: The sender.
            message: Its message.

        Raises:
            ProtocolError: The broker may not send it.
        """
        kind = type(message.frame)
        if kind in self._handlers:
            self._handlers[kind](broker, message.frame, message.endpoint)
        elif kind in self._others:
            self._others[kind](broker, message.frame)
        else:
            raise ProtocolError(ErrorCode.UNEXPECTED, f"it has sent {kind.__name__} to a broker")

    def _publisher(self, broker: int, key: int) -> PublisherRecord | None:
        if broker_of_key(key) != broker:
            raise ProtocolError(ErrorCode.UNEXPECTED, f"the publisher {key} is of another broker")
        return self._router.routes.publishers.get(key)

    def _attached(self, broker: int, frame: frames.Attached, first: int) -> None:
        if self._publisher(broker, frame.publisher) is None:
            self.unexpected += 1
            return
        subscriptions = tuple(map(self._router.declarations.key_of, frame.subscriptions))
        self._handle(Open(frame.publisher, first, frame.first_sequence, subscriptions))

    def _replayed(self, broker: int, frame: frames.Replay, _endpoint: int) -> None:
        self.published(broker, with_raw(frames.Batch(*frame[1:], b"")), "")

    def _granted(self, broker: int, frame: frames.Grant, _endpoint: int) -> None:
        endpoint = self._imports.id_of(broker, frame.subscription)
        if endpoint is None:
            self.unexpected += 1
            return
        self._handle(frame._replace(subscription=endpoint))

    def _requested(self, broker: int, frame: frames.Request, server: int) -> None:
        client = self._imports.id_of(broker, frame.endpoint)
        if client is None:
            self.unexpected += 1
            refused = tuple(answer(entry.call, Status.UNAVAILABLE, NO_SERVER) for entry in frame.entries)
            self._direct(broker, frames.Reply(frame.endpoint, refused))
            return
        key = self._router.declarations.key_of(server)
        self._handle(Forward(key, frame._replace(endpoint=client)))

    def _replied(self, broker: int, frame: frames.Reply, _endpoint: int) -> None:
        servers: dict[int, list[frames.ReplyEntry]] = {}
        for entry in frame.entries:
            server = self._calls.server(entry.call)
            remote = None if server is None else self._imports.remote(server)
            if server is None or remote is None:
                self.unexpected += 1
                continue
            # Call ids are the router's and can be guessed by nobody else; a foreign answer is no accident.
            if remote.broker != broker:
                raise ProtocolError(ErrorCode.UNEXPECTED, "it has answered a call to another broker")
            self._calls.end(entry.call)
            servers.setdefault(server, []).append(entry)
        for server_id, entries in servers.items():
            self._handle(frames.Reply(server_id, tuple(entries)))

    def _cancelled(self, broker: int, frame: frames.Cancel, _endpoint: int) -> None:
        client = self._imports.id_of(broker, frame.endpoint)
        if client is not None:
            self._handle(frame._replace(endpoint=client))

    def _handle(self, frame: Frame | Mirrored) -> None:
        self._deliver(self._router.handle(self._peer, frame))

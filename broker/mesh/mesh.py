"""One graph's part of the mesh, pure: turns what other brokers say into frames of one peer of the router, and
what the router has for that peer into messages to other brokers.

The router does with the peer what it does with any: it matches, counts, queues, grants credit and keeps
latched messages. Nothing that comes from one broker goes on to another: the engine (Zenoh) does that.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from broker.mesh.exports import MeshExports
from broker.mesh.imports import MeshImports, Remote
from broker.mesh.messages import Change, Direct, Message, Publish, Snapshot, Subscribe
from broker.mirrored import Forward, Open
from proto import frames
from proto.batches import with_raw
from proto.codec import encode

if TYPE_CHECKING:
    from collections.abc import Callable

    from broker.deliveries import Delivery
    from broker.mirrored import Mirrored
    from broker.router import Router
    from proto.frames import Buffer, Frame


class Mesh:
    """One graph's part of the mesh.

    Args:
        router: The graph's router.
        deliver: Takes what the router returns; a `report` must follow.

    Attributes:
        peer: The id of the router's peer for the mesh. What waits in its outbox goes to `send`.
        unexpected: Messages about endpoints that are not, or no longer, known.
    """

    def __init__(self, router: Router, deliver: Callable[[list[Delivery]], None]) -> None:
        self._router = router
        self._deliver = deliver
        self._out: list[Message] = []
        self.peer, _ = router.connect(b"", b"", mesh=True)
        self._touched: set[str] = set()
        """Topics whose subscriptions here or publishers elsewhere have changed."""
        self._exports = router.declarations.exports = MeshExports(
            self._out.append, self._touched.add, self.peer
        )
        self._imports = MeshImports(router, self.peer, deliver, self._touched.add)
        self._calls: dict[int, tuple[int, Remote]] = {}
        """By call, client and server of the calls to other brokers that have no reply yet."""
        self._wanted: set[str] = set()
        """The topics whose messages are wanted of other brokers."""
        self.unexpected = 0
        self._outgoing: dict[type[Any], Callable[[Any], None]] = {
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
        self._incoming: dict[type[Any], Callable[[int, Any, int], None]] = {
            frames.Attached: self._attached,
            frames.Replay: self._replayed,
            frames.Grant: self._granted,
            frames.Request: self._requested,
            frames.Reply: self._replied,
            frames.Cancel: self._cancelled,
        }

    def take(self) -> list[Message]:
        """Return the messages to send, in order."""
        out = self._out[:]
        self._out.clear()
        return out

    # What the other brokers have

    def snapshot(self) -> Snapshot:
        """Return this broker's endpoints, for brokers that have missed changes."""
        return self._exports.snapshot()

    def brokers(self) -> tuple[int, ...]:
        """Return the numbers of the brokers that are known."""
        return self._imports.brokers()

    def take_snapshot(self, broker: int, snapshot: Snapshot) -> None:
        """Replace what is known of a broker."""
        self._imports.take_snapshot(broker, snapshot)

    def take_change(self, broker: int, change: Change) -> bool:
        """Take a change; return False if the broker's snapshot is needed first."""
        return self._imports.take_change(broker, change)

    def remove_broker(self, broker: int) -> None:
        """Remove a broker that is gone, with its endpoints; calls to it fail."""
        self._imports.remove_broker(broker)

    # From the router to other brokers

    def send(self, frame: Frame) -> None:
        """Take a frame that the router has sent to the mesh."""
        handler = self._outgoing.get(type(frame))
        if handler is not None:
            handler(frame)

    def _send_batch(self, frame: frames.Batch) -> None:
        self._publish(frame.publisher, frame.raw)

    def _send_assert(self, frame: frames.Assert) -> None:
        self._publish(frame.publisher, encode(frame))

    def _publish(self, publisher: int, raw: Buffer) -> None:
        record = self._router.routes.publishers.get(publisher) or self._exports.leaving(publisher)
        if record is not None:
            self._out.append(Publish(record.name, raw))

    def _send_attached(self, frame: frames.Attached) -> None:
        by_broker: dict[int, list[int]] = {}
        for endpoint in frame.subscriptions:
            remote = self._imports.remote(endpoint)
            if remote is not None:
                by_broker.setdefault(remote.broker, []).append(remote.number)
        record = self._router.routes.publishers.get(frame.publisher)
        first = frame.first_sequence
        if record is not None and record.latched:
            first = min(first, record.latched[0].first_sequence)
        for broker, numbers in by_broker.items():
            self._out.append(Direct(broker, frame._replace(subscriptions=tuple(numbers)), first))

    def _send_replay(self, frame: frames.Replay) -> None:
        remote = self._imports.remote(frame.subscription)
        if remote is not None:
            self._out.append(Direct(remote.broker, frame._replace(subscription=remote.number)))

    def _send_detached(self, frame: frames.Detached) -> None:
        self._exports.sent_all(frame.publisher)

    def _send_grant(self, frame: frames.Grant) -> None:
        self._out.append(Direct(frame.publisher >> 32, frame))

    def _send_request(self, frame: frames.Request) -> None:
        server = self._imports.remote(frame.endpoint)
        record = self._record(frame.endpoint)
        if server is None or record is None:
            return
        clients: dict[int, list[frames.RequestEntry]] = {}
        for entry in frame.entries:
            client = record.pending[entry.call].client.number
            self._calls[entry.call] = client, Remote(server.broker, frame.endpoint)
            clients.setdefault(client, []).append(entry)
        for client, entries in clients.items():
            request = frames.Request(client, tuple(entries))
            self._out.append(Direct(server.broker, request, server.number))

    def _record(self, endpoint: int) -> Any:
        peer = self._router.peer(self.peer)
        return None if peer is None else peer.endpoints.get(endpoint)

    def _send_cancel(self, frame: frames.Cancel) -> None:
        server = self._imports.remote(frame.endpoint)
        clients: dict[int, list[int]] = {}
        for call in frame.calls:
            client, _ = self._calls.pop(call, (0, None))
            if client:
                clients.setdefault(client, []).append(call)
        if server is not None:
            for client, calls in clients.items():
                self._out.append(Direct(server.broker, frames.Cancel(client, tuple(calls)), server.number))

    def _send_reply(self, frame: frames.Reply) -> None:
        client = self._imports.remote(frame.endpoint)
        if client is not None:
            self._out.append(Direct(client.broker, frame._replace(endpoint=client.number)))

    # From other brokers to the router

    def published(self, frame: Frame) -> None:
        """Take a BATCH or ASSERT of a publisher of another broker."""
        assert isinstance(frame, (frames.Batch, frames.Assert))
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
        handler = self._incoming.get(type(message.frame))
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

    def _replied(self, broker: int, frame: frames.Reply, _endpoint: int) -> None:
        servers: dict[int, list[frames.ReplyEntry]] = {}
        for entry in frame.entries:
            _, server = self._calls.pop(entry.call, (0, None))
            if server is not None and server.broker == broker:
                servers.setdefault(server.number, []).append(entry)
        for server_id, entries in servers.items():
            self._handle(frames.Reply(server_id, tuple(entries)))

    def _cancelled(self, broker: int, frame: frames.Cancel, _endpoint: int) -> None:
        client = self._imports.id_of(broker, frame.endpoint)
        if client is not None:
            self._handle(frame._replace(endpoint=client))

    def _handle(self, frame: Frame | Mirrored) -> None:
        self._deliver(self._router.handle(self.peer, frame))

    # Which topics are wanted

    def update_wanted(self) -> None:
        """Subscribe to the topics that publishers of other brokers and subscriptions of this one share."""
        for topic in self._touched:
            record = self._router.topics.by_name.get(topic)
            wanted = (
                record is not None
                and any(each.peer.mesh for each in record.publishers.values())
                and not all(each.peer.mesh for each in record.subscriptions.values())
            )
            if wanted != (topic in self._wanted):
                (self._wanted.add if wanted else self._wanted.discard)(topic)
                self._out.append(Subscribe(topic, wanted=wanted))
        self._touched.clear()

"""The router: takes frames, returns deliveries. Pure: no I/O, no clock, no randomness.

One router is one graph. It composes the parts that know: `topics`, `services` and `graph`; what is its own is
who has connected, what they have declared, and which part a frame is for.
"""

from __future__ import annotations

from itertools import count
from typing import TYPE_CHECKING, Any, Final

from broker.deliveries import Close, Send
from broker.graph import Definitions, Graph, is_type_text
from broker.latched import latched_depth
from broker.records import (
    ClientRecord,
    Endpoint,
    NodeRecord,
    Peer,
    PublisherRecord,
    ServiceRecord,
    SubscriptionRecord,
)
from broker.services import NONE, Services
from broker.topics import Topics, subscription_depth
from proto import frames, limits
from proto.codes import EntryKind, NoticeKind, Status
from proto.errors import ErrorCode, InvalidNameError, ProtocolError
from proto.frames import Frame, ReplyEntry
from proto.names import (
    full_node_name,
    split_node_name,
    validate_full_service_name,
    validate_full_topic_name,
    validate_namespace,
    validate_node_name,
)
from proto.qos import Refusal, parse_qos

if TYPE_CHECKING:
    from collections.abc import Callable

    from broker.deliveries import Delivery

MAX_ENDPOINTS: Final = 20_000
MAX_PENDING_CALLS: Final = 200_000
MAX_LINK_QUEUE_BYTES: Final = 128 * 1024 * 1024

WAS_SILENT: Final = "This node was silent for the keepalive limit; until now the graph was without it"


class Router:
    """One graph: its peers, and everything they have declared.

    Args:
        domain: The graph's number.
        max_endpoints: What one peer may declare.
        max_pending_calls: Unanswered calls of one peer.
        max_message_bytes: Size of one frame that a peer takes.
        max_queue_bytes: What may wait for a KEEP_ALL subscription whose credit allowed it.
        report: Called with each endpoint that is declared and None, and with each that is removed and the
            reason; "" if its connection has ended: the owner of that knows why. For logs.

    Attributes:
        domain: The same number.
        relied_on: The peers to look at closely: somebody is matched with them, waits for an answer of theirs,
            or has asked who is there.
    """

    def __init__(
        self,
        *,
        domain: int = 0,
        max_endpoints: int = MAX_ENDPOINTS,
        max_pending_calls: int = MAX_PENDING_CALLS,
        max_queue_bytes: int = MAX_LINK_QUEUE_BYTES,
        max_message_bytes: int = limits.MAX_MESSAGE_BYTES,
        report: Callable[[Endpoint, str | None], None] | None = None,
    ) -> None:
        self.domain = domain
        self._report = report or _ignore
        self._out: list[Delivery] = []
        self._max_endpoints = max_endpoints
        self._keys = count(1)
        self._peer_ids = count(1)
        self._peers: dict[int, Peer] = {}
        self._instances: dict[bytes, Peer] = {}
        self._names: dict[str, NodeRecord] = {}
        self.relied_on: set[int] = set()
        self.topics = Topics(self._out_append, max_queue_bytes=max_queue_bytes)
        self.services = Services(self._out_append, max_pending=max_pending_calls, max_bytes=max_message_bytes)
        self.graph = Graph(self._out_append)
        self.definitions = Definitions()
        self._handlers: dict[type[Any], Callable[[Peer, Any], None]] = {
            frames.Batch: self.topics.run,
            frames.Request: self._request,
            frames.Reply: self._reply,
            frames.Cancel: self._cancel,
            frames.Grant: self._grant,
            frames.Assert: self.topics.asserted,
            frames.Credit: self.topics.credit_confirmed,
            frames.Node: self._declare,
            frames.Publisher: self._declare,
            frames.Subscription: self._declare,
            frames.Service: self._declare,
            frames.Client: self._declare,
            frames.Undeclare: self._undeclare,
            frames.Retire: self._retire,
            frames.Watch: self._watch,
            frames.Unwatch: lambda peer, frame: self.graph.unwatch(peer, frame.id),
            frames.Describe: self._describe,
        }

    def _out_append(self, delivery: Delivery) -> None:
        self._out.append(delivery)

    def _finish(self) -> list[Delivery]:
        """Return what is to be delivered, changes that have added up included."""
        self.topics.flush()
        self.services.flush()
        self.graph.flush()
        out, self._out = self._out, []
        return out

    # Peers

    def connect(self, instance: bytes, token: bytes) -> tuple[int, list[Delivery]]:
        """A client has said hello.

        The same instance with the same token takes over from its earlier connection, which is closed.

        Returns:
            The new peer's id, and deliveries.
        """
        peer = Peer(next(self._peer_ids), instance, token, relied_on=self.relied_on)
        self._peers[peer.id] = peer
        old = self._instances.get(instance)
        if old is not None and old.token == token:
            text = "the same node has connected again"
            self._out.append(Close(old.id, ErrorCode.TAKEN_OVER, text))
            self._remove_peer(old, text)
        if old is None or old.token == token:
            self._instances[instance] = peer
        return peer.id, self._finish()

    def disconnect(self, peer_id: int) -> list[Delivery]:
        """A connection is gone; an unknown one has been taken over."""
        peer = self._peers.get(peer_id)
        if peer is not None:
            self._remove_peer(peer, "")
        return self._finish()

    def _remove_peer(self, peer: Peer, reason: str) -> None:
        del self._peers[peer.id]
        if self._instances.get(peer.instance) is peer:
            del self._instances[peer.instance]
        self.graph.forget(peer)
        for endpoint in tuple(peer.endpoints.values()):
            self._remove(endpoint, reason)
        self.topics.forget_peer(peer.id)
        self.relied_on.discard(peer.id)

    def peer(self, peer_id: int) -> Peer | None:
        """Return what is known of a peer; None if it has been taken over."""
        return self._peers.get(peer_id)

    def node_names(self, peer_id: int) -> list[str]:
        """Return the full names of a peer's nodes."""
        peer = self._peers.get(peer_id)
        return [] if peer is None else [e.name for e in peer.endpoints.values() if isinstance(e, NodeRecord)]

    def refuse_calls(self) -> None:
        """The broker stops: take no new calls but what the pending ones need for their answers."""
        self.services.closed = True

    def hold_publishers(self) -> list[Delivery]:
        """The broker stops: let the publishers send no more than what is on its way."""
        self.topics.hold()
        return self._finish()

    def heard(self, peer_id: int) -> None:
        """A peer has given a sign of life: a question about it is answered."""
        peer = self._peers.get(peer_id)
        if peer is not None and not peer.matched and not peer.owed_calls:
            self.relied_on.discard(peer_id)

    def suspend(self, peer_id: int) -> list[Delivery]:
        """A peer is silent: out of the graph, its calls fail, its credit does not count."""
        peer = self._peers.get(peer_id)
        if peer is not None and not peer.suspended:
            peer.suspended = True
            for endpoint in peer.endpoints.values():
                self._leave(endpoint)
        return self._finish()

    def restore(self, peer_id: int) -> list[Delivery]:
        """A suspended peer has been heard of again."""
        peer = self._peers.get(peer_id)
        if peer is not None and peer.suspended:
            peer.suspended = False
            for endpoint in peer.endpoints.values():
                if isinstance(endpoint, NodeRecord):
                    notice = frames.Notice(endpoint.id, NoticeKind.SUSPENDED, WAS_SILENT, policy=0, peers=1)
                    self._out.append(Send(peer.id, notice))
                self._join(endpoint)
        return self._finish()

    # Frames

    def handle(self, peer_id: int, frame: Frame) -> list[Delivery]:
        """Take one frame of an open session.

        Raises:
            ProtocolError: The peer must be closed; call `disconnect` for it. What was done before stands.
        """
        peer = self._peers.get(peer_id)
        if peer is None:
            return []
        handler = self._handlers.get(type(frame))
        if handler is not None:
            handler(peer, frame)
        return self._finish()

    def _declare(self, peer: Peer, frame: Any) -> None:
        if frame.id in peer.endpoints:
            raise ProtocolError(ErrorCode.UNEXPECTED, f"the id {frame.id} is in use")
        try:
            if len(peer.endpoints) >= self._max_endpoints:
                text = f"one connection may declare {self._max_endpoints} endpoints"
                raise Refusal(ErrorCode.LIMIT, text)
            endpoint = self._make(peer, frame)
        except Refusal as refusal:
            self._out.append(Send(peer.id, frames.Refused(frame.id, refusal.code, str(refusal))))
            return
        except InvalidNameError as error:
            self._out.append(Send(peer.id, frames.Refused(frame.id, ErrorCode.INVALID_NAME, str(error))))
            return
        peer.endpoints[endpoint.id] = endpoint
        if endpoint.node is not None:
            endpoint.node.endpoints[endpoint.id] = endpoint
        number = endpoint.key if isinstance(endpoint, PublisherRecord) else 0
        self._out.append(Send(peer.id, frames.Accepted(endpoint.id, number)))
        self._report(endpoint, None)
        if not peer.suspended:
            self._join(endpoint)

    def _make(self, peer: Peer, frame: Any) -> Endpoint:
        if isinstance(frame, frames.Node):
            return self._make_node(peer, frame)
        node = peer.endpoints.get(frame.node)
        if not isinstance(node, NodeRecord):
            raise Refusal(ErrorCode.UNKNOWN_ID, f"this link has no node with the id {frame.node}")
        common: dict[str, Any] = {
            "key": next(self._keys),
            "id": frame.id,
            "peer": peer,
            "node": node,
            "type_name": frame.type_name or "",
            "type_hash": frame.type_hash or "",
        }
        if not (is_type_text(common["type_name"]) and is_type_text(common["type_hash"])):
            text = "a type's name and hash are at most 255 letters, digits and /_.-"
            raise Refusal(ErrorCode.MALFORMED, text)
        if isinstance(frame, frames.Publisher | frames.Subscription):
            validate_full_topic_name(frame.topic)
            return self._make_on_topic(frame, common)
        validate_full_service_name(frame.name)
        if isinstance(frame, frames.Service):
            self.definitions.learn(frame.type_hash, frame.definition)
            return ServiceRecord(kind=EntryKind.SERVICE, name=frame.name, **common)
        return ClientRecord(kind=EntryKind.CLIENT, name=frame.name, **common)

    def _make_node(self, peer: Peer, frame: frames.Node) -> NodeRecord:
        namespace, name = split_node_name(frame.name)
        validate_namespace(namespace)
        validate_node_name(name)
        if frame.name != full_node_name(namespace, name):
            raise Refusal(ErrorCode.INVALID_NAME, f"'{full_node_name(namespace, name)}' is the full name")
        holder = self._names.get(frame.name)
        if holder is not None and holder.peer.suspended:
            # Frozen or cut off: the living goes before it. Should it come back, it is told.
            text = f"another node '{frame.name}' has come while this link was silent"
            self._remove_peer(holder.peer, text)
            self._out.append(Close(holder.peer.id, ErrorCode.TAKEN_OVER, text))
        elif holder is not None:
            self.relied_on.add(holder.peer.id)
            text = f"A node named '{frame.name}' is there already; give this one another name"
            raise Refusal(ErrorCode.NAME_TAKEN, text)
        record = NodeRecord(
            key=next(self._keys), id=frame.id, peer=peer, kind=EntryKind.NODE, node=None, name=frame.name
        )
        self._names[frame.name] = record
        return record

    def _make_on_topic(
        self, frame: frames.Publisher | frames.Subscription, common: dict[str, Any]
    ) -> Endpoint:
        qos = parse_qos(frame.qos)
        shown = qos.to_map()
        if isinstance(frame, frames.Publisher):
            self.definitions.learn(frame.type_hash, frame.definition)
            return PublisherRecord(
                kind=EntryKind.PUBLISHER,
                name=frame.topic,
                qos=shown,
                wants=qos,
                gid=frame.gid,
                next_sequence=frame.next_sequence,
                live_sequence=frame.live_sequence,
                keep=latched_depth(qos),
                **common,
            )
        return SubscriptionRecord(
            kind=EntryKind.SUBSCRIPTION,
            name=frame.topic,
            qos=shown,
            wants=qos,
            depth=subscription_depth(qos),
            window_messages=frame.window_messages,
            window_bytes=frame.window_bytes,
            **common,
        )

    def _join(self, endpoint: Endpoint) -> None:
        if isinstance(endpoint, ServiceRecord) and endpoint.retired:
            return
        self.graph.add(endpoint)
        if isinstance(endpoint, PublisherRecord):
            self.topics.join_publisher(endpoint)
        elif isinstance(endpoint, SubscriptionRecord):
            self.topics.join_subscription(endpoint)
        elif isinstance(endpoint, ServiceRecord | ClientRecord):
            self.services.join(endpoint)

    def _leave(self, endpoint: Endpoint) -> None:
        if not (isinstance(endpoint, ServiceRecord) and endpoint.retired):  # that has left the graph already
            silent = endpoint.peer.suspended and endpoint.id in endpoint.peer.endpoints
            self.graph.remove(endpoint, suspended=silent)
        if isinstance(endpoint, PublisherRecord):
            self.topics.leave_publisher(endpoint)
        elif isinstance(endpoint, SubscriptionRecord):
            self.topics.leave_subscription(endpoint)
        elif isinstance(endpoint, ServiceRecord | ClientRecord):
            self.services.leave(endpoint)

    def _undeclare(self, peer: Peer, frame: frames.Undeclare) -> None:
        endpoint = peer.endpoints.get(frame.id)
        if endpoint is not None:
            self._remove(endpoint, "undeclared")

    def _retire(self, peer: Peer, frame: frames.Retire) -> None:
        server = peer.endpoints.get(frame.id)
        if isinstance(server, ServiceRecord) and not server.retired:
            self.graph.remove(server)
            self.services.retire(server)

    def _remove(self, endpoint: Endpoint, reason: str) -> None:
        if endpoint.peer.endpoints.pop(endpoint.id, None) is None:
            return
        self._report(endpoint, reason)
        if isinstance(endpoint, NodeRecord):
            for child in tuple(endpoint.endpoints.values()):
                self._remove(child, reason)
            if self._names.get(endpoint.name) is endpoint:
                del self._names[endpoint.name]
        elif endpoint.node is not None:
            endpoint.node.endpoints.pop(endpoint.id, None)
        self._leave(endpoint)
        if isinstance(endpoint, PublisherRecord):
            self.topics.forget_publisher(endpoint)

    def _request(self, peer: Peer, frame: frames.Request) -> None:
        client = peer.endpoints.get(frame.endpoint)
        if isinstance(client, ClientRecord):
            self.services.request(client, frame.entries)
            return
        # The client was refused, or has just been taken back.
        for entry in frame.entries:
            answer = ReplyEntry(entry.call, Status.UNAVAILABLE, False, None, NONE.encode())  # noqa: FBT003
            self._out.append(Send(peer.id, frames.Reply(frame.endpoint, (answer,))))

    def _reply(self, peer: Peer, frame: frames.Reply) -> None:
        server = peer.endpoints.get(frame.endpoint)
        if isinstance(server, ServiceRecord):
            self.services.reply(server, frame.entries)
        else:
            self.services.late += len(frame.entries)

    def _cancel(self, peer: Peer, frame: frames.Cancel) -> None:
        client = peer.endpoints.get(frame.endpoint)
        if isinstance(client, ClientRecord):
            self.services.cancel(client, frame.calls)

    def _grant(self, peer: Peer, frame: frames.Grant) -> None:
        subscription = peer.endpoints.get(frame.subscription)
        if isinstance(subscription, SubscriptionRecord):
            self.topics.grant(subscription, frame)

    def _watch(self, peer: Peer, frame: frames.Watch) -> None:
        self.relied_on.update(self._peers)
        self.graph.watch(peer, frame)

    def _describe(self, peer: Peer, frame: frames.Describe) -> None:
        answer = frames.Definition(frame.type_hash, self.definitions.get(frame.type_hash))
        self._out.append(Send(peer.id, answer))


def _ignore(_endpoint: Endpoint, _reason: str | None) -> None:
    """Report nothing."""

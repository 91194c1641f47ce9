"""Declarations: makes records of nodes and endpoints, and takes them into and out of the graph."""

from __future__ import annotations

from collections import deque
from functools import lru_cache, partial
from itertools import count
from typing import TYPE_CHECKING, Any, Final

from broker.access.rules import Action
from broker.routing.definitions import Definitions
from broker.routing.deliveries import Send, SendEncoded
from broker.routing.graph import Graph, check_type
from broker.routing.latched import latched_depth
from broker.routing.mirrored import is_checked_elsewhere
from broker.routing.node_names import NodeNames
from broker.routing.records import (
    NO_QOS,
    NOT_LATCHED,
    ClientRecord,
    Endpoint,
    NodeRecord,
    Peer,
    PublisherRecord,
    ServiceRecord,
    SubscriptionRecord,
)
from broker.routing.topics import Topics, subscription_depth
from proto.errors import ErrorCode, InvalidNameError, ProtocolError
from proto.wire import frames
from proto.wire.codec import encode
from proto.wire.codes import EntryKind
from proto.wire.identity import public_gid
from proto.wire.labels import check_label_text, check_labels
from proto.wire.mesh_keys import broker_of_key
from proto.wire.names import (
    full_node_name,
    split_node_name,
    validate_full_service_name,
    validate_full_topic_name,
    validate_namespace,
    validate_node_name,
)
from proto.wire.qos import Refusal, parse_qos

if TYPE_CHECKING:
    from collections.abc import Callable

    from broker.routing.deliveries import Delivery
    from broker.routing.mirrored import ExportListener, Mirror
    from broker.routing.refusals import Refusals
    from broker.routing.router_limits import RouterLimits
    from broker.routing.services import Services


# Tuples: to build a union takes longer than isinstance.
_ON_TOPIC: Final = (PublisherRecord, SubscriptionRecord)
_OF_SERVICE: Final = (ServiceRecord, ClientRecord)
_ON_TOPIC_FRAMES: Final = (frames.Publisher, frames.Subscription)

_WORDS: Final = {
    Action.NODE: "take the node name",
    Action.PUBLISH: "publish on",
    Action.SUBSCRIBE: "subscribe to",
    Action.SERVE: "serve",
    Action.CALL: "call",
}


def check_right(peer: Peer, action: Action, name: str) -> None:
    """Check that a peer's user may do something.

    Raises:
        Refusal: The access rules deny it.
    """
    principal = peer.principal
    if principal is not None and not principal.rights.may(action, name):
        text = f"the access rules do not allow '{principal.user}' to {_WORDS[action]} '{name}'"
        raise Refusal(ErrorCode.DENIED, text)


@lru_cache(maxsize=1000)
def _accepted(number: int, key: int) -> bytes:
    """Return an encoded ACCEPTED: clients number their endpoints from 1, so that it is often the same."""
    return encode(frames.Accepted(number, key))


def _check_labels(frame: frames.Node) -> None:
    """Check the labels of a node, and its `apart`.

    Raises:
        Refusal: One is not allowed.
    """
    try:
        check_labels(frame.labels)
        check_label_text("apart", frame.apart)
    except ValueError as error:
        raise Refusal(ErrorCode.MALFORMED, str(error)) from None


def _request_from_nobody(_peer: int, _type_hash: str) -> bool:
    """Answer as without a mesh."""
    return False


class Declarations:
    """The declared nodes and endpoints of one graph.

    Args:
        emit: Takes each delivery.
        limits: What one peer may declare.
        refusals: Counts what limits refuse.
        topics, services, graph: The parts that match and publish endpoints.
        replace_peer: Called with a suspended peer whose name another node takes, and the reason; removes it.
        report: See `Router`.
        key_base: The keys of endpoints are greater.

    Attributes:
        definitions: Keeps the definitions of declared types.
        request_definition: Called with a peer and the hash of a type; returns whether another broker of the
            mesh may know its definition, so that the answer follows.
        exports: Learns of endpoints that come and go, those of other brokers excepted; None for nobody.
    """

    def __init__(
        self,
        emit: Callable[[Delivery], None],
        *,
        limits: RouterLimits,
        refusals: Refusals,
        topics: Topics,
        services: Services,
        graph: Graph,
        replace_peer: Callable[[Peer, str], None],
        report: Callable[[Endpoint, str | None], None],
        key_base: int,
    ) -> None:
        self._emit = emit
        self._max_endpoints = limits.max_endpoints
        self._max_matches = limits.max_matches
        self._max_mesh_matches = limits.max_mesh_matches
        self._topics = topics
        self._services = services
        self._graph = graph
        self._report = report
        self._key_base = key_base
        self._keys = count(key_base + 1)
        self.exports: ExportListener | None = None
        self.request_definition: Callable[[int, str], bool] = _request_from_nobody
        self._names = NodeNames(emit, replace_peer, partial(self._revoke, ErrorCode.NAME_TAKEN))
        self.definitions = Definitions(
            max_number=limits.max_definitions, max_bytes=limits.max_definition_bytes
        )
        self._refusals = refusals

    def declare(self, peer: Peer, frame: Any) -> None:
        """Take a declaration, or refuse it.

        Raises:
            ProtocolError: The id is in use, or the name is kept for a silent node.
        """
        if frame.id in peer.endpoints:
            raise ProtocolError(ErrorCode.UNEXPECTED, f"the id {frame.id} is in use")
        try:
            if len(peer.endpoints) >= self._max_endpoints:
                text = f"one connection may declare {self._max_endpoints} endpoints (--max-endpoints)"
                raise Refusal(ErrorCode.LIMIT, text)
            # A key is used up by a refusal, too: keys are never given twice, so that a late frame cannot meet
            # another endpoint.
            endpoint = self._make(peer, frame, next(self._keys))
            check_right(peer, endpoint.action, endpoint.name)
            if not self.fits(endpoint):
                raise Refusal(ErrorCode.LIMIT, self.too_many_matches)
            if getattr(frame, "definition", None) and frame.type_hash:
                endpoint.described = self.definitions.add(peer, frame.type_hash, frame.definition)
        except (Refusal, InvalidNameError) as error:
            code = error.code if isinstance(error, Refusal) else ErrorCode.INVALID_NAME
            self._emit(Send(peer.id, frames.Refused(frame.id, code, str(error))))
            if code is ErrorCode.LIMIT:
                self._refusals.add(peer, str(error))
            return
        # ACCEPTED goes out before `join`: what matching sends (ATTACHED, MATCHED) names an endpoint that the
        # client knows.
        self._add(peer, endpoint)
        number = endpoint.key if isinstance(endpoint, PublisherRecord) else 0
        self._emit(SendEncoded(peer.id, _accepted(endpoint.id, number)))
        self._report(endpoint, None)
        if not peer.suspended:
            self.join(endpoint)

    def key_of(self, number: int) -> int:
        """Return the key of this broker's endpoint with this number."""
        return self._key_base + number

    def mirror(self, peer: Peer, frame: Mirror) -> None:
        """Take a declaration that another broker has accepted.

        Raises:
            ProtocolError, Refusal, InvalidNameError: The other broker should not have accepted it.
        """
        endpoint = self._make(peer.of_broker(broker_of_key(frame.key)), frame.declaration, frame.key)
        if not self.fits(endpoint):
            text = f"the endpoints of one broker may have {self._max_mesh_matches} matches"
            raise Refusal(ErrorCode.LIMIT, f"{text} (--max-mesh-matches)")
        if isinstance(endpoint, PublisherRecord):
            endpoint.opened = False
        self._add(peer, endpoint)
        self._report(endpoint, None)
        self.join(endpoint)

    def _add(self, peer: Peer, endpoint: Endpoint) -> None:
        peer.endpoints[endpoint.id] = endpoint
        if endpoint.node is not None:
            endpoint.node.endpoints[endpoint.id] = endpoint

    def _make(self, peer: Peer, frame: Any, key: int) -> Endpoint:
        if isinstance(frame, frames.Node):
            return self._make_node(peer, frame, key)
        node = peer.endpoints.get(frame.node)
        if not isinstance(node, NodeRecord):
            raise Refusal(ErrorCode.UNKNOWN_ID, f"this link has no node with the id {frame.node}")
        type_name, type_hash = check_type(frame.type_name or "", frame.type_hash or "")
        common: dict[str, Any] = {
            "key": key,
            "id": frame.id,
            "peer": peer,
            "node": node,
            "type_name": type_name,
            "type_hash": type_hash,
            "qos": NO_QOS,
        }
        if isinstance(frame, _ON_TOPIC_FRAMES):
            validate_full_topic_name(frame.topic)
            return self._make_on_topic(frame, common)
        validate_full_service_name(frame.name)
        if isinstance(frame, frames.Service):
            return ServiceRecord(kind=EntryKind.SERVICE, name=frame.name, **common)
        return ClientRecord(kind=EntryKind.CLIENT, name=frame.name, **common)

    def _make_node(self, peer: Peer, frame: frames.Node, key: int) -> NodeRecord:
        namespace, name = split_node_name(frame.name)
        validate_namespace(namespace)
        validate_node_name(name)
        if frame.name != full_node_name(namespace, name):
            raise Refusal(ErrorCode.INVALID_NAME, f"'{full_node_name(namespace, name)}' is the full name")
        _check_labels(frame)
        check_right(peer, Action.NODE, frame.name)  # before it is known whether somebody has the name
        if not is_checked_elsewhere(peer):
            self._names.claim(peer, frame.name, shared=frame.shared)
        record = NodeRecord(
            key=key,
            id=frame.id,
            peer=peer,
            kind=EntryKind.NODE,
            node=None,
            name=frame.name,
            shared=frame.shared,
            labels=frame.labels or NO_QOS,
            kept_apart=frame.apart,
            yields=frame.yields,
        )
        self._names.add(record)
        return record

    def _make_on_topic(
        self, frame: frames.Publisher | frames.Subscription, common: dict[str, Any]
    ) -> Endpoint:
        qos = parse_qos(frame.qos)
        peer: Peer = common["peer"]
        common |= {"name": frame.topic, "qos": qos.to_map(), "wants": qos}
        if isinstance(frame, frames.Publisher):
            keep = latched_depth(qos)
            return PublisherRecord(
                kind=EntryKind.PUBLISHER,
                gid=frame.gid if is_checked_elsewhere(peer) else public_gid(peer.token, frame.gid),
                next_sequence=frame.next_sequence,
                live_sequence=frame.live_sequence,
                keep=keep,
                latched=deque() if keep else NOT_LATCHED,
                **common,
            )
        return SubscriptionRecord(
            kind=EntryKind.SUBSCRIPTION,
            depth=subscription_depth(qos),
            window_messages=frame.window_messages,
            window_bytes=frame.window_bytes,
            stall_ms=frame.stall_ms,
            **common,
        )

    @property
    def too_many_matches(self) -> str:
        """Why an endpoint does not fit."""
        return f"the endpoints of one connection may have {self._max_matches} matches (--max-matches)"

    def fits(self, endpoint: Endpoint) -> bool:
        """Return whether an endpoint that has not joined leaves its peer within the limit of matches."""
        most = self._max_mesh_matches if endpoint.mirrored else self._max_matches
        if isinstance(endpoint, _ON_TOPIC):
            return not self._topics.exceeds(endpoint, most)
        if isinstance(endpoint, _OF_SERVICE):
            return not self._services.exceeds(endpoint, most)
        return True

    def join(self, endpoint: Endpoint) -> None:
        """Take an endpoint that is new or back into the graph, and match it."""
        # A retired server only finishes its calls, also after a suspension.
        if isinstance(endpoint, ServiceRecord) and endpoint.retired:
            return
        exports = self._exports_of(endpoint)
        if exports is not None:
            endpoint.private = not exports.allows(endpoint)
        # First the graph, then the matches, then other brokers: a peer that learns of a match finds both ends
        # in the graph.
        self._graph.add(endpoint)
        if isinstance(endpoint, NodeRecord):
            self._names.report_duplicates(endpoint)
        elif isinstance(endpoint, PublisherRecord):
            self._topics.join_publisher(endpoint)
        elif isinstance(endpoint, SubscriptionRecord):
            self._topics.join_subscription(endpoint)
        elif isinstance(endpoint, _OF_SERVICE):
            self._services.join(endpoint)
        if exports is not None and not endpoint.private:
            exports.joined(endpoint)

    def leave(self, endpoint: Endpoint) -> None:
        """Take an endpoint that is gone or suspended out of the graph, and unmatch it."""
        if not (isinstance(endpoint, ServiceRecord) and endpoint.retired):  # a retired one has left the graph
            suspended = endpoint.peer.suspended and endpoint.id in endpoint.peer.endpoints
            self._graph.remove(endpoint, suspended=suspended)
        if (exports := self._exports_of(endpoint)) is not None:
            exports.left(endpoint)
        if isinstance(endpoint, PublisherRecord):
            self._topics.leave_publisher(endpoint)
        elif isinstance(endpoint, SubscriptionRecord):
            self._topics.leave_subscription(endpoint)
        elif isinstance(endpoint, _OF_SERVICE):
            self._services.leave(endpoint)

    def _exports_of(self, endpoint: Endpoint) -> ExportListener | None:
        """Return who learns of an endpoint; a broker tells others of its own ones only."""
        return None if endpoint.mirrored else self.exports

    def renew_exports(self, exports: ExportListener) -> None:
        """Let endpoints leave and join again if other brokers may now know them, or not any more."""
        own = [each for each in self._graph.endpoints() if not each.mirrored]
        # Nodes first: an endpoint is announced to other brokers after its node.
        for endpoint in sorted(own, key=lambda each: each.kind is not EntryKind.NODE):
            if endpoint.private == exports.allows(endpoint):
                self.leave(endpoint)
                self.join(endpoint)

    def revoke(self, peer: Peer) -> None:
        """Remove what a peer has declared and its user may not have any more; tell it with REFUSED."""
        # Nodes first, as each takes its endpoints with it.
        for endpoint in sorted(peer.endpoints.values(), key=lambda each: each.kind is not EntryKind.NODE):
            try:
                check_right(peer, endpoint.action, endpoint.name)
            except Refusal as refusal:
                self._revoke(ErrorCode.DENIED, endpoint, str(refusal))

    def _revoke(self, code: ErrorCode, endpoint: Endpoint, text: str) -> None:
        children = tuple(endpoint.endpoints.values()) if isinstance(endpoint, NodeRecord) else ()
        if isinstance(endpoint, PublisherRecord):
            # Batches of it may be on their way; they are ignored instead of ending the link as an unknown id
            # would. A link that loses publishers again and again may not make the broker remember them all.
            revoked = endpoint.peer.revoked
            revoked[endpoint.key] = None
            if len(revoked) > self._max_endpoints:
                revoked.popitem(last=False)
        if endpoint.id in endpoint.peer.endpoints:  # not if its node has been removed before
            self._emit(Send(endpoint.peer.id, frames.Refused(endpoint.id, code, text)))
        for child in children:
            self._revoke(code, child, text)
        self.remove(endpoint, text)

    def undeclare(self, peer: Peer, frame: frames.Undeclare) -> None:
        """Remove what a peer declared under an id; ignore an unknown one."""
        endpoint = peer.endpoints.get(frame.id)
        if endpoint is not None:
            self.remove(endpoint, "undeclared")

    def describe(self, peer: Peer, frame: frames.Describe) -> None:
        """Answer a peer's question for the definition of a type, if it may see an endpoint of that type."""
        visible = self._graph.is_type_visible(peer.rights, frame.type_hash)
        definition = self.definitions.get(frame.type_hash) if visible else None
        if definition is None and visible and self.request_definition(peer.id, frame.type_hash):
            return  # the answer follows
        self._emit(Send(peer.id, frames.Definition(frame.type_hash, definition)))

    def retire(self, peer: Peer, frame: frames.Retire) -> None:
        """Take a server out of the graph; it still answers pending calls."""
        server = peer.endpoints.get(frame.id)
        if isinstance(server, ServiceRecord) and not server.retired:
            self._graph.remove(server)
            if (exports := self._exports_of(server)) is not None:
                exports.retired(server)
            self._services.retire(server)

    def remove(self, endpoint: Endpoint, reason: str) -> None:
        """Remove a node or an endpoint for good; a node with all its endpoints."""
        if endpoint.peer.endpoints.pop(endpoint.id, None) is None:
            return
        self._report(endpoint, reason)
        if endpoint.described:
            self.definitions.release(endpoint.peer, endpoint.type_hash)
        if isinstance(endpoint, NodeRecord):
            for child in tuple(endpoint.endpoints.values()):
                self.remove(child, reason)
            self._names.remove(endpoint)
        elif endpoint.node is not None:
            endpoint.node.endpoints.pop(endpoint.id, None)
        self.leave(endpoint)
        if isinstance(endpoint, PublisherRecord):
            self._topics.remove_publisher(endpoint)

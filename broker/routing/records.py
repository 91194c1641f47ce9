"""The router's data: one record per peer, node and endpoint, and the references between them."""

from __future__ import annotations

from collections import Counter, OrderedDict, deque
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, NamedTuple, cast

from broker.access.rules import Action
from broker.routing.flow_control import CreditLimits, PublisherCredit
from proto.limits import MAX_U32
from proto.wire.codes import EntryKind
from proto.wire.fragments import ByteTotal
from proto.wire.frames import GraphEntry, Matched, Options
from proto.wire.labels import NODE_KEY, labels_to_qos
from proto.wire.mesh_keys import broker_of_key
from proto.wire.qos import KEEP_ALL

if TYPE_CHECKING:
    from collections.abc import Callable

    from broker.access.rules import Principal, Rights
    from broker.routing.pool import Pool
    from proto.queues.publisher_queue import PublisherQueue
    from proto.queues.queued_calls import QueuedCalls
    from proto.wire.frames import Batch
    from proto.wire.qos import Qos


NO_QOS: Final[Options] = {}
"""What other nodes, services and clients have."""

SHARED: Final[Options] = {"shared": True}
"""What nodes with shared names have."""

NOT_LATCHED: Final[deque[Batch]] = deque(maxlen=0)
"""The latched messages of VOLATILE publishers."""

_new_dict = cast("Callable[[], dict[Any, Any]]", dict)
"""Takes a fifth of the time of calling an alias such as dict[int, str]."""


@dataclass(slots=True, eq=False)
class Peer:
    """One connection, as the router sees it.

    Each field is changed by one module, which the comment above it names; the others only read it.
    """

    # router: when the connection begins.
    id: int
    instance: bytes = b""
    token: bytes = b""
    relied_on: set[int] = field(default_factory=set[int])
    """Ids of the peers that others rely on or have asked about; one set, shared by all peers of the graph."""
    all_latched: ByteTotal = field(default_factory=ByteTotal)
    """`latched_bytes` of all peers of the broker together."""
    mesh: bool = False
    """Whether its endpoints are those of other brokers; only `mirrored` and `Endpoint.mirrored` read it."""

    # router: when access rules change, and when the peer is silent or back.
    principal: Principal | None = None
    """Whose it is; None if there are no access rules."""
    suspended: bool = False
    names_released: bool = False
    """Whether it has been suspended for so long that other nodes may take its names."""

    # declarations
    endpoints: dict[int, Endpoint] = field(default_factory=_new_dict)
    """By the ids that the client chose."""
    revoked: OrderedDict[int, None] = field(default_factory=OrderedDict[int, None])
    """Ids of its publishers that changed rules or other nodes have removed, as many as it may declare, the
    latest ones; what it still sends for them is ignored."""

    # definitions
    definitions: dict[str, int] = field(default_factory=_new_dict)
    """By the hash of each type that it has defined, its endpoints that declared the definition."""
    definition_bytes: int = 0
    """Size of these definitions."""

    # records: in `Endpoint.set_peers`, as endpoints are matched.
    matched: int = 0
    """Endpoints with counterparts, which must learn soon when this peer is gone."""
    matches: int = 0
    """Counterparts of all its endpoints together."""

    # calls
    pending_calls: int = 0
    """Unanswered calls of its clients."""
    owed_calls: int = 0
    """Calls that its servers, retired ones included, have not answered."""
    queued_calls: QueuedCalls | None = None
    """Requests that wait for its servers; None before the first one."""

    # latched
    latched_bytes: int = 0
    """Bytes kept for late joiners of its publishers."""

    # graph
    watches: int = 0
    """Its kept watches of the graph."""

    # records: in `of_broker`.
    brokers: dict[int, Peer] = field(default_factory=_new_dict)
    """By number, the other brokers of a mesh: each is this peer, with counts of its own."""

    @property
    def rights(self) -> Rights | None:
        """What it may do; None for everything."""
        return None if self.principal is None else self.principal.rights

    def of_broker(self, broker: int) -> Peer:
        """Return the peer of another broker's endpoints, for a peer that stands for a mesh."""
        peer = self.brokers.get(broker)
        if peer is None:
            peer = self.brokers[broker] = Peer(
                self.id,
                endpoints=self.endpoints,
                relied_on=self.relied_on,
                principal=self.principal,
                all_latched=self.all_latched,
                mesh=True,
            )
        return peer

    def node_names(self) -> list[str]:
        """Return the full names of its nodes."""
        return [each.name for each in self.endpoints.values() if isinstance(each, NodeRecord)]

    def may(self, action: Action, name: str) -> bool:
        """Return whether its user may do something with a name."""
        return self.principal is None or self.principal.rights.may(action, name)


_ACTIONS: Final = {
    EntryKind.NODE: Action.NODE,
    EntryKind.PUBLISHER: Action.PUBLISH,
    EntryKind.SUBSCRIPTION: Action.SUBSCRIBE,
    EntryKind.SERVICE: Action.SERVE,
    EntryKind.CLIENT: Action.CALL,
}
"""What an endpoint needs the right to."""


@dataclass(slots=True, eq=False, kw_only=True)
class Endpoint:
    """Anything declared.

    `key` is its number in the graph; `peers` is its current number of counterparts.
    """

    key: int
    id: int
    peer: Peer
    kind: EntryKind
    node: NodeRecord | None
    name: str
    type_name: str = ""
    type_hash: str = ""
    qos: Options = field(default_factory=lambda: NO_QOS)
    peers: int = 0
    total: int = 0
    """Number of counterparts it has had since its declaration."""
    described: bool = False
    """Whether the broker keeps the definition of its type because of it."""
    private: bool = False
    """Whether it is kept from other brokers, and does not match their endpoints."""

    @property
    def broker(self) -> int:
        """The number of its broker in the mesh; 0 without a mesh."""
        return broker_of_key(self.key)

    @property
    def mirrored(self) -> bool:
        """Whether it is another broker's; `mirrored.py` has what is special then."""
        return self.peer.mesh

    @property
    def action(self) -> Action:
        """What somebody needs the right to, for this."""
        return _ACTIONS[self.kind]

    @property
    def number(self) -> int:
        """Its number among the endpoints of its broker."""
        return self.key & MAX_U32

    @property
    def node_name(self) -> str:
        """The full name of its node."""
        return self.node.name if self.node is not None else self.name

    @property
    def apart(self) -> str:
        """Endpoints of nodes with the same text do not match, unless it is empty."""
        return "" if self.node is None else self.node.kept_apart

    def set_peers(self, peers: int) -> None:
        """Set the number of counterparts."""
        peer = self.peer
        change = (peers > 0) - (self.peers > 0)
        peer.matched += change
        if change > 0:
            peer.relied_on.add(peer.id)
        peer.matches += peers - self.peers
        self.total += max(0, peers - self.peers)
        self.peers = peers

    def matched_frame(self) -> Matched:
        """Return the MATCHED frame that reports its counterparts."""
        return Matched(self.id, self.peers, self.total)

    def entry(self) -> GraphEntry:
        """Return its entry in the graph."""
        qos = self.qos
        if self.node is not None and self.node.labels:
            qos = {**qos, NODE_KEY: self.node.key}
        return GraphEntry(self.key, self.kind, self.node_name, self.name, self.type_name, self.type_hash, qos)


@dataclass(slots=True, eq=False, kw_only=True)
class NodeRecord(Endpoint):
    """A node."""

    shared: bool = False
    """Whether other nodes may have the same name."""
    labels: Options = field(default_factory=lambda: NO_QOS)
    kept_apart: str = ""
    """If it is not empty, endpoints of nodes with the same text do not match."""
    yields: bool = False
    """Whether it loses its name to a node that does not share it."""
    endpoints: dict[int, Endpoint] = field(default_factory=_new_dict)

    def entry(self) -> GraphEntry:
        """Return its entry in the graph."""
        qos = SHARED if self.shared else NO_QOS
        if self.labels:
            qos = {**qos, **labels_to_qos(self.labels)}
        return GraphEntry(self.key, self.kind, self.name, "", "", "", qos)


@dataclass(slots=True, eq=False, kw_only=True)
class PublisherRecord(Endpoint):
    """A publisher; `key` is its broker-wide id."""

    wants: Qos
    gid: bytes
    """As others know it (`proto.wire.identity.public_gid`)."""
    next_sequence: int
    live_sequence: int
    """Messages with smaller numbers are latched ones that it sends again."""
    credit: PublisherCredit = field(default_factory=PublisherCredit)
    topic: TopicRecord = field(init=False, repr=False)
    """Its topic; set when it is first matched."""
    routes: dict[int, Route] = field(default_factory=_new_dict)
    matched: dict[int, SubscriptionRecord] = field(default_factory=_new_dict)
    opened: bool = True
    """False for one of another broker whose messages do not arrive yet."""
    unattached: set[int] = field(default_factory=set[int])
    """Keys of matched KEEP_ALL subscriptions that another broker, whose KEEP_ALL publisher this is, has not
    attached: for other readers here it may leave messages out."""
    has_gap: bool = False
    """Whether numbers of one of another broker were left out: messages were dropped or lost."""
    awaited_by: dict[int, SubscriptionRecord] = field(default_factory=_new_dict)
    """Subscriptions that know that it is suspended, and must learn how that ends."""
    keep: int = 0
    """Messages kept for late joiners; 0 for a VOLATILE publisher."""
    latched: deque[Batch] = field(default_factory=lambda: NOT_LATCHED)
    latched_messages: int = 0
    latched_bytes: int = 0
    unlatched: int = 0
    """Batches removed from the start of `latched` so far."""

    @property
    def waits_for_readers(self) -> bool:
        """Whether KEEP_ALL subscriptions hold it back; a KEEP_LAST publisher drops what they do not take."""
        return self.wants.history == KEEP_ALL

    def first_for(self, subscription: SubscriptionRecord) -> int:
        """Return the first number whose batch goes to a subscription that is attached now."""
        if subscription.wants.latched:
            return self.next_sequence
        return max(self.next_sequence, self.live_sequence)


@dataclass(slots=True, eq=False, kw_only=True)
class SubscriptionRecord(Endpoint):
    """A subscription."""

    wants: Qos
    depth: int | None
    """None for KEEP_ALL with RELIABLE, which grants credit."""
    window_messages: int
    window_bytes: int
    stall_ms: int = 0
    """How long it may take nothing, if that is longer than the broker's own limit."""
    stalled: bool = False
    """Whether its credit is suspended: KEEP_ALL publishers neither wait for it nor send it anything."""
    matched: dict[int, PublisherRecord] = field(default_factory=_new_dict)
    awaits: dict[int, PublisherRecord] = field(default_factory=_new_dict)
    """Publishers whose `awaited_by` contains it."""


@dataclass(slots=True, eq=False)
class Route:
    """The route of one publisher's batches to one peer."""

    peer: Peer
    queue: PublisherQueue
    topic: TopicRecord
    own_depth: int | None = None
    """The depth of a KEEP_LAST publisher, which holds for subscriptions that grant credit."""
    limits: CreditLimits | None = None
    """Credit of these subscriptions for a KEEP_LAST publisher, in bytes of the queue."""
    subscriptions: dict[int, SubscriptionRecord] = field(default_factory=_new_dict)
    depths: Counter[int | None] = field(default_factory=Counter["int | None"])
    """How many of the subscriptions have which depth: the queue has the greatest."""
    earlier_ids: tuple[int, ...] = ()
    """Earlier ids of the publisher whose DETACHED may wait in the queue."""
    least_depth: int = 1
    """Other brokers keep the latched messages for late joiners, even if their readers want fewer."""

    def add(self, subscription: SubscriptionRecord) -> None:
        """Send the batches to this subscription, too."""
        self.subscriptions[subscription.id] = subscription
        self.depths[self._depth_for(subscription)] += 1
        self._update_depth()

    def remove(self, subscription: SubscriptionRecord) -> None:
        """Stop sending the batches to this subscription."""
        del self.subscriptions[subscription.id]
        depth = self._depth_for(subscription)
        self.depths[depth] -= 1
        if not self.depths[depth]:
            del self.depths[depth]
        self._update_depth()

    def _depth_for(self, subscription: SubscriptionRecord) -> int | None:
        return self.own_depth if subscription.depth is None else subscription.depth

    def _update_depth(self) -> None:
        keep_all = None in self.depths
        depths = (depth for depth in self.depths if depth is not None)
        self.queue.depth = None if keep_all else max(self.least_depth, 1, *depths)


@dataclass(slots=True, eq=False)
class Tally:
    """What has become of copies: messages, counted once for each link to which they were routed."""

    delivered: int = 0
    dropped: int = 0
    dropped_for_bytes: int = 0
    """Part of `dropped`."""
    abandoned: int = 0
    lost_on_break: int = 0
    queued: int = 0
    leaving: int = 0

    def copy(self) -> Tally:
        """Return another tally with the same counts."""
        return Tally(  # not by `dataclasses.replace`, which is slow: one for each topic of each report
            self.delivered,
            self.dropped,
            self.dropped_for_bytes,
            self.abandoned,
            self.lost_on_break,
            self.queued,
            self.leaving,
        )

    def add(self, queue: PublisherQueue) -> None:
        """Add what has become of a queue's messages so far."""
        self.delivered += queue.sent
        self.dropped += queue.dropped
        self.dropped_for_bytes += queue.dropped_for_bytes
        self.abandoned += queue.abandoned
        self.lost_on_break += queue.lost_on_break
        self.queued += queue.pending
        self.leaving += queue.leaving


@dataclass(slots=True, eq=False)
class TopicRecord:
    """A topic, and its endpoints that are not suspended."""

    name: str
    messages: int = 0
    """Messages that its publishers have sent, without those whose numbers had been seen."""
    bytes: int = 0
    """Size of these messages."""
    forgotten: Tally = field(default_factory=Tally)
    """What became of the messages of forgotten queues."""
    latched_dropped: int = 0
    """Messages that late joiners do not get, because more bytes were latched than allowed."""
    by_reference: int = 0
    publishers: dict[int, PublisherRecord] = field(default_factory=_new_dict)
    subscriptions: dict[int, SubscriptionRecord] = field(default_factory=_new_dict)


@dataclass(slots=True, eq=False, kw_only=True)
class ServiceRecord(Endpoint):
    """A server of a service; `pending` are the calls that it has not answered, by the broker's call ids."""

    pending: dict[int, PendingCall] = field(default_factory=_new_dict)
    pool: Pool[ServiceRecord] | None = None
    """The servers with which it shares requests; None while there are no clients, and when it is retired."""
    retired: bool = False
    """Whether it gets no more requests and only answers pending ones."""


@dataclass(slots=True, eq=False, kw_only=True)
class ClientRecord(Endpoint):
    """A client of a service; `pending` are its unanswered calls, by its own call ids."""

    pending: dict[int, PendingCall] = field(default_factory=_new_dict)


class PendingCall(NamedTuple):
    """A call without an answer yet: its client, and the server chosen for it."""

    call: int
    client: ClientRecord
    client_call: int
    server: ServiceRecord


class ServiceGroup:
    """All endpoints of one service name."""

    __slots__ = ("apart", "clients", "pools", "servers")

    def __init__(self) -> None:
        self.servers: dict[int, ServiceRecord] = {}
        self.clients: dict[int, ClientRecord] = {}
        self.apart = 0
        """How many servers are kept apart from some clients."""
        self.pools: dict[tuple[str, str, bool], Pool[ServiceRecord]] = {}
        """The servers of each type name and hash, those of other brokers apart, while there are clients."""

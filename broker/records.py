"""What the router remembers: one record per peer, node and endpoint, and how they hang together."""

from __future__ import annotations

from collections import Counter, deque
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from broker.credit_limits import CreditLimits
from proto.frames import GraphEntry, Matched, Options, Scalar

if TYPE_CHECKING:
    from broker.pool import Pool
    from proto.codes import EntryKind
    from proto.frames import Batch
    from proto.publisher_queue import PublisherQueue
    from proto.qos import Qos


@dataclass(slots=True, eq=False)
class Peer:
    """One connection, as the router sees it."""

    id: int
    instance: bytes = b""
    token: bytes = b""
    endpoints: dict[int, Endpoint] = field(default_factory=dict["int", "Endpoint"])
    suspended: bool = False
    pending_calls: int = 0
    """Calls of its clients that have no answer yet."""
    owed_calls: int = 0
    """Calls that its servers, retired ones included, have not answered."""
    latched_bytes: int = 0
    """Bytes kept for late joiners of its publishers."""
    matched: int = 0
    """Endpoints with counterparts: somebody must be told soon when this peer is not there any more."""
    relied_on: set[int] = field(default_factory=set[int])
    """The ids of the graph's peers that somebody relies on or has asked about; all of them share it."""


@dataclass(slots=True, eq=False, kw_only=True)
class Endpoint:
    """What all declared things have.

    `key` is its number in the graph; `peers` how many counterparts it has now.
    """

    key: int
    id: int
    peer: Peer
    kind: EntryKind
    node: NodeRecord | None
    name: str
    type_name: str = ""
    type_hash: str = ""
    qos: Options = field(default_factory=dict[str, Scalar])
    peers: int = 0
    total: int = 0
    """Counterparts it has had in all."""

    @property
    def node_name(self) -> str:
        """The full name of its node."""
        return self.node.name if self.node is not None else self.name

    def set_peers(self, peers: int) -> None:
        """It has this many counterparts now."""
        peer = self.peer
        change = (peers > 0) - (self.peers > 0)
        peer.matched += change
        if change > 0:
            peer.relied_on.add(peer.id)
        self.total += max(0, peers - self.peers)
        self.peers = peers

    def matched_frame(self) -> Matched:
        """Return what it is told about its counterparts."""
        return Matched(self.id, self.peers, self.total)

    def entry(self) -> GraphEntry:
        """Return it as everybody may see it."""
        return GraphEntry(
            self.key, self.kind, self.node_name, self.name, self.type_name, self.type_hash, self.qos
        )


@dataclass(slots=True, eq=False, kw_only=True)
class NodeRecord(Endpoint):
    """A node."""

    endpoints: dict[int, Endpoint] = field(default_factory=dict["int", "Endpoint"])

    def entry(self) -> GraphEntry:
        """Return it as everybody may see it."""
        return GraphEntry(self.key, self.kind, self.name, "", "", "", {})


@dataclass(slots=True, eq=False, kw_only=True)
class PublisherRecord(Endpoint):
    """A publisher; `key` is its broker-wide id."""

    wants: Qos
    gid: bytes
    next_sequence: int
    live_sequence: int
    """Messages below it are latched ones that come again."""
    bytes: int = 0
    """Bytes of messages since the declaration: what credit counts."""
    topic: TopicRecord = field(init=False, repr=False)
    """What it publishes on, from its first matching on."""
    routes: dict[int, Route] = field(default_factory=dict["int", "Route"])
    matched: dict[int, SubscriptionRecord] = field(default_factory=dict["int", "SubscriptionRecord"])
    awaited_by: dict[int, SubscriptionRecord] = field(default_factory=dict["int", "SubscriptionRecord"])
    """Subscriptions that have been told that it is suspended, and are to be told how that ends."""
    keep: int = 0
    """Messages kept for late joiners; 0 for a VOLATILE publisher."""
    latched: deque[Batch] = field(default_factory=deque["Batch"])
    latched_messages: int = 0
    latched_bytes: int = 0
    credits: CreditLimits = field(default_factory=CreditLimits)
    limit: tuple[int, int] | None = None
    """The credit that has been sent: (sequence limit, byte limit)."""
    promised: tuple[int, int] | None = None
    """The greatest credit that has been sent since it was unlimited; None while unlimited."""
    echoes_owed: int = 0
    """How many CREDIT frames that ended an unlimited time it has not confirmed yet."""

    def first_for(self, subscription: SubscriptionRecord) -> int:
        """Return the number from which on its runs are for a subscription that is attached now."""
        if subscription.wants.latched:
            return self.next_sequence
        return max(self.next_sequence, self.live_sequence)


@dataclass(slots=True, eq=False, kw_only=True)
class SubscriptionRecord(Endpoint):
    """A subscription."""

    wants: Qos
    depth: int | None
    """None: KEEP_ALL with RELIABLE, which needs credit."""
    window_messages: int
    window_bytes: int
    matched: dict[int, PublisherRecord] = field(default_factory=dict["int", "PublisherRecord"])
    awaits: dict[int, PublisherRecord] = field(default_factory=dict["int", "PublisherRecord"])
    """Publishers whose `awaited_by` it is in."""


@dataclass(slots=True, eq=False)
class Route:
    """The way of one publisher's runs to one peer."""

    peer: Peer
    queue: PublisherQueue
    topic: TopicRecord
    subscriptions: dict[int, SubscriptionRecord] = field(default_factory=dict["int", "SubscriptionRecord"])
    depths: Counter[int | None] = field(default_factory=Counter["int | None"])
    """How many of the subscriptions have which depth: the lane has the greatest."""
    lives: tuple[int, ...] = ()
    """Ids of the publisher's earlier lives whose DETACHED may wait in the lane."""

    def add(self, subscription: SubscriptionRecord) -> None:
        """The runs are for this subscription, too."""
        self.subscriptions[subscription.id] = subscription
        self.depths[subscription.depth] += 1
        self._deepen()

    def remove(self, subscription: SubscriptionRecord) -> None:
        """The runs are no longer for this subscription."""
        del self.subscriptions[subscription.id]
        self.depths[subscription.depth] -= 1
        if not self.depths[subscription.depth]:
            del self.depths[subscription.depth]
        self._deepen()

    def _deepen(self) -> None:
        keep_all = None in self.depths
        self.queue.depth = None if keep_all else max((d for d in self.depths if d is not None), default=1)


@dataclass(slots=True, eq=False)
class Tally:
    """What has become of copies: messages, counted once for each link they were routed to."""

    delivered: int = 0
    dropped: int = 0
    dropped_for_bytes: int = 0
    """Part of `dropped`."""
    abandoned: int = 0
    lost_on_break: int = 0
    queued: int = 0
    leaving: int = 0

    def copy(self) -> Tally:
        """Return another with the same counts."""
        return Tally(
            self.delivered,
            self.dropped,
            self.dropped_for_bytes,
            self.abandoned,
            self.lost_on_break,
            self.queued,
            self.leaving,
        )

    def add(self, queue: PublisherQueue) -> None:
        """Count what has become of a lane's messages so far."""
        self.delivered += queue.sent
        self.dropped += queue.dropped
        self.dropped_for_bytes += queue.dropped_for_bytes
        self.abandoned += queue.abandoned
        self.lost_on_break += queue.lost_on_break
        self.queued += queue.pending
        self.leaving += queue.leaving


@dataclass(slots=True, eq=False)
class TopicRecord:
    """A topic: everybody who has declared something on it and is not suspended."""

    name: str
    messages: int = 0
    """Messages that its publishers have sent, but for those that had been seen."""
    bytes: int = 0
    """Their size."""
    settled: Tally = field(default_factory=Tally)
    """What became of the messages of lanes that are forgotten."""
    latched_dropped: int = 0
    """Messages that late joiners do not get, because what is latched was more than may be."""
    publishers: dict[int, PublisherRecord] = field(default_factory=dict["int", "PublisherRecord"])
    subscriptions: dict[int, SubscriptionRecord] = field(default_factory=dict["int", "SubscriptionRecord"])


@dataclass(slots=True, eq=False, kw_only=True)
class ServiceRecord(Endpoint):
    """A server of a service; `pending` are the calls it owes an answer."""

    pending: dict[int, PendingCall] = field(default_factory=dict["int", "PendingCall"])
    pool: Pool | None = None
    """Who it shares the requests with, while it takes part."""
    retired: bool = False
    """It only answers what it has."""


@dataclass(slots=True, eq=False, kw_only=True)
class ClientRecord(Endpoint):
    """A client of a service; `pending` by its own call ids."""

    pending: dict[int, PendingCall] = field(default_factory=dict["int", "PendingCall"])


class PendingCall(NamedTuple):
    """A call that has no answer yet: whose it is, and who was chosen to answer."""

    call: int
    client: ClientRecord
    client_call: int
    server: ServiceRecord


@dataclass(slots=True, eq=False)
class ServiceGroup:
    """Everybody at one service name."""

    name: str
    servers: dict[int, ServiceRecord] = field(default_factory=dict["int", "ServiceRecord"])
    clients: dict[int, ClientRecord] = field(default_factory=dict["int", "ClientRecord"])
    pools: dict[tuple[str, str], Pool] = field(default_factory=dict["tuple[str, str]", "Pool"])
    """The servers of each type and hash: who may answer whom."""

"""Statistics of a broker, of its topics and of its links.

Counts are totals since the broker started to listen. Two snapshots give rates: `later.rates_since(earlier)`.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from proto.renaming import former_name

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

MAX_NODE_NAMES: Final = 8
"""Node names in the statistics of one link. A link may have any number of nodes; this bounds the answers."""

MAY_DECREASE: Final = ("lost_on_break",)
"""Totals that may fall: a subscription may receive a message after it was counted as lost."""


def increase(totals: Sequence[str], earlier: object | None, later: object) -> dict[str, Any]:
    """Return the increase of each of these totals between two snapshots of an object; never negative.

    Args:
        totals: The names of attributes, ints or floats.
        earlier: The first snapshot; None if the object did not exist then.
        later: The second snapshot. If a total outside of MAY_DECREASE is smaller in it, counting has started
            again, and all totals count from zero.
    """
    now = {total: getattr(later, total) for total in totals}
    before = {total: getattr(earlier, total, 0) for total in totals}
    if any(now[total] < before[total] for total in totals if total not in MAY_DECREASE):
        return now
    return {total: max(0, now[total] - before[total]) for total in totals}


@dataclass(frozen=True, kw_only=True, slots=True)
class BrokerRates:
    """Events per second between two snapshots of a broker; `interval_sec` is the time between them."""

    interval_sec: float
    routed: float
    copies: float
    delivered: float
    dropped: float
    abandoned: float
    lost_on_break: float
    shared_sent: float
    unmatched: float
    stale: float
    calls: float
    refused_calls: float
    refused_declarations: float
    late_replies: float
    refused_connections: float
    frames_received: float
    bytes_received: float
    bytes_sent: float
    seconds = former_name("seconds", "interval_sec")

    def as_dict(self) -> dict[str, float]:
        """Return the values by name; `seconds`, the former `interval_sec`, stays for one version."""
        return {**asdict(self), "seconds": self.interval_sec}


TOTALS: Final = tuple(rate.name for rate in fields(BrokerRates) if rate.name != "interval_sec")
"""The fields of BrokerStats that are totals, from which rates are computed."""


@dataclass(frozen=True, kw_only=True, slots=True)
class BrokerStats:
    """A snapshot of a broker's statistics.

    `copies`, which counts each message once for every link it was routed to, equals `accounted` at every
    moment, although each term of `accounted` is counted independently.
    """

    broker: str = ""
    """The broker's instance id in hex; it changes with a restart. Empty if the numbers are `withheld`."""
    stamp_sec: float = 0.0
    """The time of the snapshot, by the monotonic clock of the broker's event loop."""
    uptime_sec: float = 0.0
    """Since the broker started to listen."""
    lag_last_sec: float = 0.0
    """How late the event loop ran its last timer."""
    lag_longest_sec: float = 0.0
    """The longest such delay of the last minute."""
    connections: int = 0
    """Open connections, including those in the handshake."""
    refused_connections: int = 0
    """Connections refused because there were too many, in all or from one address."""
    unauthorized_connections: int = 0
    """Connections refused because the access rules have no user for them."""
    refused_per_address: int = 0
    """Those of `refused_connections` whose address had too many."""
    tls_failures: int = 0
    """Connections that ended because TLS failed before their session."""
    reassembly_timeouts: int = 0
    """Links closed because a message stayed incomplete."""
    stalls: int = 0
    """KEEP_ALL subscriptions that lost their credit because they took nothing."""
    departed_overflows: int = 0
    """Queues of publishers that had gone, emptied because too many waited for one link."""
    suspended: int = 0
    """Links that have been silent for too long and may return."""
    endpoints: int = 0
    """Nodes, publishers, subscriptions, services and clients."""
    topics: int = 0
    routed: int = 0
    """Messages that reached at least one link."""
    copies: int = 0
    delivered: int = 0
    """Copies passed completely to a link's transport."""
    dropped: int = 0
    """Copies dropped because a link was slower than its depth allows."""
    dropped_for_bytes: int = 0
    """Those of them that fitted the depth but not a limit in bytes."""
    abandoned: int = 0
    """Copies that waited when the last matching subscription of the link left or was suspended."""
    lost_on_break: int = 0
    """Copies that waited for a link when it ended, or were routed to it while it ended."""
    leaving: int = 0
    """Copies of which some fragments, but not the last, are passed to the transport."""
    queued: int = 0
    """Copies that wait to be sent."""
    queued_bytes: int = 0
    """Their estimated memory; a message that waits for several links counts for each."""
    urgent_bytes: int = 0
    """Control frames and calls that wait, large calls included."""
    ordered_bytes: int = 0
    """Control frames and latched messages that wait in order with messages."""
    reassembly_bytes: int = 0
    """Parts of large messages that links have not sent completely."""
    received_bytes: int = 0
    """Buffers of received bytes that wait to be handled, of incomplete large frames, and of TLS."""
    held_bytes: int = 0
    """All that counts for the broker's `max_broker_bytes`."""
    refused_messages: int = 0
    """Large messages discarded because the broker held too much."""
    closed_for_memory: int = 0
    """Links closed because the broker held too much, and most of it for them."""
    shared_received: int = 0
    """Messages received by reference: they are in the shared memory of their publishers."""
    shared_sent: int = 0
    """Copies of these sent by reference."""
    shared_copied: int = 0
    """Copies of these sent as bytes to links that have shared memory but not (yet) opened the arena."""
    refused_arenas: int = 0
    """Shared memory that the broker or a client could not open."""
    latched: int = 0
    """Messages kept for late joiners."""
    latched_bytes: int = 0
    """Their estimated memory."""
    latched_dropped: int = 0
    """Messages no longer kept for late joiners because too many bytes were latched."""
    unmatched: int = 0
    """Messages without a matching subscription."""
    stale: int = 0
    """Messages discarded because they had been received before."""
    calls: int = 0
    refused_calls: int = 0
    overloaded_calls: int = 0
    """Those of them that were refused because too many bytes of calls waited for their server."""
    refused_declarations: int = 0
    """Declarations, watches of the graph and INSPECTs that a limit has refused."""
    pending_calls: int = 0
    late_replies: int = 0
    definitions: int = 0
    """Type definitions kept."""
    definition_bytes: int = 0
    refused_definitions: int = 0
    """Definitions that were not kept: not of their hash, or over a limit."""
    frames_received: int = 0
    """From all connections, including those that have ended; a batch of messages is one."""
    bytes_received: int = 0
    bytes_sent: int = 0

    @property
    def withheld(self) -> bool:
        """Whether the broker tells the asker only the time, and 0 for the rest.

        The access rules do not let the asker's user administer the whole broker.
        """
        return not self.broker

    @property
    def accounted(self) -> int:
        """The sum of all copies by what happened to them."""
        return (
            self.delivered + self.dropped + self.abandoned + self.lost_on_break + self.leaving + self.queued
        )

    def rates_since(self, earlier: BrokerStats) -> BrokerRates:
        """Return the events per second since an earlier snapshot of the same broker.

        Args:
            earlier: The earlier snapshot.

        Raises:
            ValueError: `earlier` is not earlier, or is of another broker.
        """
        seconds = self.stamp_sec - earlier.stamp_sec
        if seconds <= 0 or self.broker != earlier.broker:
            raise ValueError("Rates need an earlier snapshot of the same broker")
        rise = increase(("uptime_sec", *TOTALS), earlier, self)
        return BrokerRates(interval_sec=seconds, **{name: rise[name] / seconds for name in TOTALS})

    def as_dict(self) -> dict[str, Any]:
        """Return the values by name, ready for `json.dumps`."""
        return asdict(self)

    @classmethod
    def from_map(cls, totals: Mapping[str, object]) -> BrokerStats:
        """Return the statistics in a STATS frame.

        Args:
            totals: The frame's `totals`; unknown names are ignored, missing ones get their default.
        """
        return cls(**_known(cls, totals))


def _known(kind: type[BrokerStats | MeshStats], numbers: Mapping[str, object]) -> dict[str, Any]:
    """Return the values that have the name and the type of a field."""
    return {
        field.name: numbers[field.name]
        for field in fields(kind)
        if type(numbers.get(field.name)) is type(field.default)
    }


@dataclass(frozen=True, kw_only=True, slots=True)
class MeshStats:
    """A snapshot of what a broker has exchanged with the other brokers of its mesh, in all domains."""

    brokers: int = 0
    """Other brokers that are alive."""
    sent: int = 0
    """Messages sent to other brokers: batches, changes of the graph, replies and so on."""
    bytes_sent: int = 0
    received: int = 0
    """Messages received from them."""
    bytes_received: int = 0
    waiting_bytes: int = 0
    """Messages, control frames and calls that wait in the broker to be sent."""
    sending_bytes: int = 0
    """What waits for the network."""
    unhandled_bytes: int = 0
    """What has been received and waits for the event loop."""
    dropped: int = 0
    """Messages of topics dropped before they were sent, because the network or other brokers are slow."""
    overruns: int = 0
    """Received messages of topics dropped because the event loop is slow."""
    failed: int = 0
    """Messages that could not be sent."""
    malformed: int = 0
    """Received messages that could not be decoded."""
    ignored: int = 0
    """Received messages about brokers or endpoints that were not, or no longer, known."""
    refused: int = 0
    """Endpoints of other brokers that this one does not take."""
    resets: int = 0
    """How often messages to or from a broker were lost, so that the exchange with it was restarted."""
    rejected: int = 0
    """Brokers that have broken a rule, so that this one has removed and ignored them."""
    limited: int = 0
    """Brokers that were given up because they did not answer, changes of others that came too fast, and
    requests for the graph that came too often."""
    overflows: int = 0
    """How often too much waited for brokers, so that the exchange with them was restarted."""
    neighbours: str = ""
    """The ids of the routers and peers that Zenoh is connected with, separated by spaces."""

    def as_dict(self) -> dict[str, Any]:
        """Return the values by name, ready for `json.dumps`."""
        return asdict(self)

    @classmethod
    def from_map(cls, numbers: Mapping[str, object]) -> MeshStats:
        """Return the statistics in a STATS frame, as `BrokerStats.from_map` does.

        Args:
            numbers: The frame's `mesh`.
        """
        return cls(**_known(cls, numbers))


class TopicStats(NamedTuple):
    """Statistics of a topic with at least one endpoint; its counts start again when the last one is removed.

    Attributes:
        domain: The topic's domain.
        name: The full name.
        publishers: Publishers that are not suspended.
        subscriptions: Subscriptions that are not suspended.
        messages: Messages received from publishers.
        bytes: Their size.
        delivered, dropped, abandoned, lost_on_break, leaving, queued: Copies of these messages by what
            happened to them, as in BrokerStats.
        latched_dropped: Messages no longer kept for late joiners because too many bytes were latched.
        by_reference: Those of `messages` that are in shared memory; 0 from earlier brokers.
    """

    domain: int
    name: str
    publishers: int
    subscriptions: int
    messages: int
    bytes: int
    delivered: int
    dropped: int
    abandoned: int
    lost_on_break: int
    leaving: int
    queued: int
    latched_dropped: int
    by_reference: int = 0


class MeshBrokerStats(NamedTuple):
    """Statistics of a broker of a mesh, as another one sees it; counts are of all domains.

    Attributes:
        number: Its number, from 1: `broker` of entries of the graph.
        name: Its name in listings, which others may have, too; empty if it is not known yet.
        version: Its version of callboard.
        direct: Whether it is connected with this one, not by way of others.
        round_trip_us: Microseconds of the last round trip to it and back; 0 if none has been measured.
        sent: Messages sent to it alone: replies, calls, credit.
        bytes_sent: Their size.
        received: Messages received from it.
        bytes_received: Their size.
    """

    number: int
    name: str
    version: str
    direct: bool = False
    round_trip_us: int = 0
    sent: int = 0
    bytes_sent: int = 0
    received: int = 0
    bytes_received: int = 0


class LinkStats(NamedTuple):
    """Statistics of a link after its handshake.

    Attributes:
        domain: The domain of its nodes.
        session: The session number from WELCOME.
        agent: The `agent` text from HELLO.
        nodes: The full names of its first 8 nodes.
        endpoints: The number of its nodes and endpoints.
        suspended: Whether it has been silent for too long.
        silent_ms: Milliseconds without a received byte, as of the broker's last periodic check.
        queued: Messages that wait for it.
        queued_bytes: Their size.
        waiting_bytes: Bytes of control frames, latched messages and calls that wait for it.
        dropped: Messages dropped because it was slow.
        bytes_received: Bytes received from it.
        bytes_sent: Bytes passed to its transport.
        pending_calls: Calls of its clients that wait for a reply.
        owed_calls: Calls that its servers have not answered.
        shared_bytes_received, shared_bytes_sent: Size of the messages received from it and sent to it by
            reference, which `bytes_received` and `bytes_sent` do not have; 0 from earlier brokers.
    """

    domain: int
    session: int
    agent: str
    nodes: tuple[str, ...]
    endpoints: int
    suspended: bool
    silent_ms: int
    queued: int
    queued_bytes: int
    waiting_bytes: int
    dropped: int
    bytes_received: int
    bytes_sent: int
    pending_calls: int
    owed_calls: int
    shared_bytes_received: int = 0
    shared_bytes_sent: int = 0

"""What goes on in a graph, from looks at it: who is there, how much goes through, where it waits or is lost.

    looks = Looks()
    with actors.Inspector("callboard://127.0.0.1:7411") as inspector:
        while True:
            seen = looks.add(Look(inspector.graph(), inspector.report()))
            for topic in seen.topics:
                print(topic.name, topic.messages_per_sec)
            time.sleep(1)

Nothing here asks anybody: a look is the graph and the broker's numbers at about one moment. Rates are the
broker's counters' rise between two looks, so measuring costs no traffic. A single look has no rates: they are
None until there is a second one of the same broker.
"""

from __future__ import annotations

from collections import Counter, deque
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from proto.codes import EntryKind
from proto.names import is_hidden

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from actors.graph.broker_report import BrokerReport, BrokerReportRates
    from actors.graph.snapshot import GraphSnapshot
    from proto.stats import LinkStats, TopicStats

WINDOW: Final = 3
"""Over how many pauses between looks a rate is taken: a slow topic's is steadier for it."""

LINKED: Final = "linked"
SUSPENDED: Final = "suspended"


class Look(NamedTuple):
    """The graph and the broker's numbers at about one moment."""

    snapshot: GraphSnapshot
    report: BrokerReport


@dataclass(frozen=True, kw_only=True, slots=True)
class TopicRow:
    """A topic.

    Attributes:
        name: Its full name.
        types: The types seen on it, sorted; more than one is a clash.
        publishers, subscriptions: How many there are.
        messages_per_sec, bytes_per_sec: What its publishers send.
        drops_per_sec: Copies dropped because a reader is slower than its depth allows.
        queued: Copies that wait for their readers.
        dropped, lost_on_break: Copies dropped since the topic came, and those lost with a link.
    """

    name: str
    types: tuple[str, ...]
    publishers: int
    subscriptions: int
    messages_per_sec: float | None
    bytes_per_sec: float | None
    drops_per_sec: float | None
    queued: int
    dropped: int
    lost_on_break: int

    @property
    def lost(self) -> int:
        """Copies that have not reached a reader that stayed."""
        return self.dropped + self.lost_on_break


@dataclass(frozen=True, kw_only=True, slots=True)
class NodeRow:
    """A node. The numbers from `received_bytes_per_sec` on are its link's.

    Attributes:
        name: Its full name.
        state: "linked", or "suspended": its link is silent, and it may come back.
        silent_ms: Since when nothing has come from it.
        endpoints: Its publishers, subscriptions, services and clients.
        received_bytes_per_sec, sent_bytes_per_sec: What it takes in and gives out.
        queued, queued_bytes: Messages that wait in the broker for it.
        dropped: Messages dropped in the broker because it was slow, and ...
        drops_per_sec: ... how many a second now.
        pending_calls: Calls of its clients that wait for an answer.
        owed_calls: Calls that its services have not answered.
    """

    name: str
    state: str
    silent_ms: int
    endpoints: int
    received_bytes_per_sec: float | None
    sent_bytes_per_sec: float | None
    queued: int
    queued_bytes: int
    dropped: int
    drops_per_sec: float | None
    pending_calls: int
    owed_calls: int


@dataclass(frozen=True, kw_only=True, slots=True)
class ServiceRow:
    """A service.

    Attributes:
        name: Its full name.
        types: The types seen on it, sorted; more than one is a clash.
        servers, clients: How many there are.
        owed_calls: Calls that its servers' nodes have not answered; their other services' count, too.
    """

    name: str
    types: tuple[str, ...]
    servers: int
    clients: int
    owed_calls: int


@dataclass(frozen=True, kw_only=True, slots=True)
class Totals:
    """The whole broker, all its domains together.

    Attributes:
        broker: Its instance, in hex: another after a restart.
        uptime_sec: Since when it listens.
        routed_per_sec: Messages that reached at least one link.
        delivered_per_sec: Copies handed to a link.
        drops_per_sec: Copies dropped because a link was slow.
        calls_per_sec: Calls sent on to a server.
        received_bytes_per_sec, sent_bytes_per_sec: What went into the broker and out of it.
        queued, queued_bytes: Copies that wait now.
        dropped, lost_on_break: Copies dropped since it listens, and those lost with a link.
        lag_sec, longest_lag_sec: How late its loop is, and was at worst in the last minute.
        connections: How many it has; who is looking is one of them.
        suspended: Links that are silent, and may come back.
    """

    broker: str
    uptime_sec: float
    routed_per_sec: float | None
    delivered_per_sec: float | None
    drops_per_sec: float | None
    calls_per_sec: float | None
    received_bytes_per_sec: float | None
    sent_bytes_per_sec: float | None
    queued: int
    queued_bytes: int
    dropped: int
    lost_on_break: int
    lag_sec: float
    longest_lag_sec: float
    connections: int
    suspended: int


@dataclass(frozen=True, kw_only=True, slots=True)
class Overview:
    """What goes on, with rates over the last few looks.

    Attributes:
        seconds: Over how long the rates are taken; 0.0 if there are none yet.
        totals: The whole broker.
        topics, nodes, services: Sorted by name.
    """

    seconds: float
    totals: Totals
    topics: tuple[TopicRow, ...]
    nodes: tuple[NodeRow, ...]
    services: tuple[ServiceRow, ...]

    def without_hidden(self) -> Overview:
        """Return the same without names that have a token with a leading `_`."""
        return Overview(
            seconds=self.seconds,
            totals=self.totals,
            topics=tuple(row for row in self.topics if not is_hidden(row.name)),
            nodes=tuple(row for row in self.nodes if not is_hidden(row.name)),
            services=tuple(row for row in self.services if not is_hidden(row.name)),
        )

    def as_dict(self) -> dict[str, Any]:
        """Return the same as dicts, tuples, strings and numbers."""
        return asdict(self)


class Looks:
    """Takes looks as they come and keeps the last few.

    Args:
        window: Over how many pauses between looks rates are taken.
    """

    def __init__(self, window: int = WINDOW) -> None:
        self._looks: deque[Look] = deque(maxlen=max(1, window) + 1)

    def add(self, look: Look) -> Overview:
        """Take in the newest look and return what goes on."""
        newest = look.report.totals
        if self._looks:
            last = self._looks[-1].report.totals
            if last.broker != newest.broker or last.stamp_sec >= newest.stamp_sec:
                self._looks.clear()  # a broker that has begun anew has no past
        self._looks.append(look)
        first = self._looks[0].report
        return overview(look, None if first is look.report else look.report.rates_since(first))


def overview(look: Look, rates: BrokerReportRates | None) -> Overview:
    """Return what a look shows, with rates up to it."""
    snapshot, report = look
    links = {name: link for link in report.links.values() for name in link.nodes}
    return Overview(
        seconds=0.0 if rates is None else rates.totals.seconds,
        totals=_totals(report, rates),
        topics=tuple(_topics(snapshot, report.topics, None if rates is None else rates.topics)),
        nodes=tuple(_nodes(snapshot, links, None if rates is None else rates.links)),
        services=tuple(_services(snapshot, links)),
    )


def _totals(report: BrokerReport, rates: BrokerReportRates | None) -> Totals:
    totals, rise = report.totals, None if rates is None else rates.totals
    return Totals(
        broker=totals.broker,
        uptime_sec=totals.uptime_sec,
        routed_per_sec=None if rise is None else rise.routed,
        delivered_per_sec=None if rise is None else rise.delivered,
        drops_per_sec=None if rise is None else rise.dropped,
        calls_per_sec=None if rise is None else rise.calls,
        received_bytes_per_sec=None if rise is None else rise.bytes_received,
        sent_bytes_per_sec=None if rise is None else rise.bytes_sent,
        queued=totals.queued,
        queued_bytes=totals.queued_bytes,
        dropped=totals.dropped,
        lost_on_break=totals.lost_on_break,
        lag_sec=totals.lag_last_sec,
        longest_lag_sec=totals.lag_longest_sec,
        connections=totals.connections,
        suspended=totals.suspended,
    )


def _topics(
    snapshot: GraphSnapshot, stats: Mapping[str, TopicStats], rates: Mapping[str, Mapping[str, float]] | None
) -> Iterable[TopicRow]:
    types = dict(snapshot.names_and_types(EntryKind.PUBLISHER, EntryKind.SUBSCRIPTION))
    publishers = _counts(snapshot, EntryKind.PUBLISHER)
    subscriptions = _counts(snapshot, EntryKind.SUBSCRIPTION)
    for name, kinds in types.items():
        topic = stats.get(name)
        rise = _rise(rates, name)
        yield TopicRow(
            name=name,
            types=tuple(kinds),
            publishers=publishers[name],
            subscriptions=subscriptions[name],
            messages_per_sec=rise.get("messages"),
            bytes_per_sec=rise.get("bytes"),
            drops_per_sec=rise.get("dropped"),
            queued=0 if topic is None else topic.queued,
            dropped=0 if topic is None else topic.dropped,
            lost_on_break=0 if topic is None else topic.lost_on_break,
        )


def _nodes(
    snapshot: GraphSnapshot,
    links: Mapping[str, LinkStats],
    rates: Mapping[int, Mapping[str, float]] | None,
) -> Iterable[NodeRow]:
    endpoints = Counter(entry.node for entry in snapshot.entries.values() if entry.kind != EntryKind.NODE)
    there = set(snapshot.nodes())
    silent = {name for name, link in links.items() if link.suspended}
    for name in sorted(there | silent):
        link = links.get(name)  # a link names the first few of its nodes only
        rise = _rise(rates, None if link is None else link.session)
        yield NodeRow(
            name=name,
            state=SUSPENDED if name in silent else LINKED,
            silent_ms=0 if link is None else link.silent_ms,
            endpoints=endpoints[name] or _beside_nodes(link),
            received_bytes_per_sec=rise.get("bytes_sent"),
            sent_bytes_per_sec=rise.get("bytes_received"),
            queued=0 if link is None else link.queued,
            queued_bytes=0 if link is None else link.queued_bytes,
            dropped=0 if link is None else link.dropped,
            drops_per_sec=rise.get("dropped"),
            pending_calls=0 if link is None else link.pending_calls,
            owed_calls=0 if link is None else link.owed_calls,
        )


def _beside_nodes(link: LinkStats | None) -> int:
    """A suspended link's endpoints are not in the graph."""
    return link.endpoints - len(link.nodes) if link is not None and link.suspended else 0


def _services(snapshot: GraphSnapshot, links: Mapping[str, LinkStats]) -> Iterable[ServiceRow]:
    servers = _counts(snapshot, EntryKind.SERVICE)
    clients = _counts(snapshot, EntryKind.CLIENT)
    owing: dict[str, dict[int, int]] = {}
    for entry in snapshot.of_kind(EntryKind.SERVICE):
        link = links.get(entry.node)
        if link is not None:
            owing.setdefault(entry.name, {})[link.session] = link.owed_calls
    for name, kinds in snapshot.names_and_types(EntryKind.SERVICE, EntryKind.CLIENT):
        yield ServiceRow(
            name=name,
            types=tuple(kinds),
            servers=servers[name],
            clients=clients[name],
            owed_calls=sum(owing.get(name, {}).values()),
        )


def _counts(snapshot: GraphSnapshot, kind: EntryKind) -> Counter[str]:
    return Counter(entry.name for entry in snapshot.of_kind(kind))


def _rise(rates: Mapping[Any, Mapping[str, float]] | None, key: object) -> Mapping[str, float]:
    """Return the rates of one thing; none of what the numbers do not know, or know no rates of."""
    return {} if rates is None else rates.get(key, {})

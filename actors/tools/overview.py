"""An overview of a graph at work: its topics, nodes and services, their rates, queues and losses.

    samples = Samples()
    with actors.Inspector("callboard://127.0.0.1:7411") as inspector:
        while True:
            overview = samples.add(Sample(inspector.graph(), inspector.report()))
            for topic in overview.topics:
                print(topic.name, topic.messages_per_sec)
            time.sleep(1)

A sample is the graph and the broker's counters at about the same moment; nothing here does I/O. Rates are the
rise of the broker's counters between two samples, so measuring them causes no traffic. A single sample has no
rates: they are None until there is a second one of the same broker.
"""

from __future__ import annotations

from collections import Counter, deque
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from actors.tools.broker_names import BrokerNames
from proto.renaming import former_name
from proto.wire.codes import EntryKind
from proto.wire.names import is_hidden

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from actors.graph.broker_report import BrokerReport, BrokerReportRates
    from actors.graph.snapshot import GraphSnapshot
    from proto.wire.stats import LinkStats, TopicStats

WINDOW: Final = 3
"""Intervals between samples over which a rate is taken: more make the rate of a slow topic steadier."""

WITHHELD: Final = 'the broker keeps its own numbers from this user, who may not administer "/"'
"""Text in place of a broker's numbers that are withheld."""

LINKED: Final = "linked"
SUSPENDED: Final = "suspended"


class Sample(NamedTuple):
    """The graph and the broker's counters at about the same moment.

    Attributes:
        snapshot: The graph.
        report: The broker's counters.
    """

    snapshot: GraphSnapshot
    report: BrokerReport


@dataclass(frozen=True, kw_only=True, slots=True)
class TopicRow:
    """A topic.

    Attributes:
        name: Its full name.
        types: The declared types, sorted; more than one is a conflict.
        publishers, subscriptions: Their numbers.
        messages_per_sec, bytes_per_sec: Messages and bytes that its publishers send per second.
        shared_per_sec: Those of `messages_per_sec` that are in shared memory.
        drops_per_sec: Copies dropped per second because a subscription's queue was full.
        queued: Copies that wait in the broker.
        dropped, lost_on_break: Copies dropped, and copies lost with a link, since the topic exists.

    Rates and counts are None if the broker does not report the topic: it is another broker's, or the user may
    not administer it.
    """

    name: str
    types: tuple[str, ...]
    publishers: int
    subscriptions: int
    messages_per_sec: float | None
    bytes_per_sec: float | None
    shared_per_sec: float | None
    drops_per_sec: float | None
    queued: int | None
    dropped: int | None
    lost_on_break: int | None

    @property
    def lost(self) -> int | None:
        """Copies dropped or lost with a link; None if the broker does not report the topic."""
        if self.dropped is None or self.lost_on_break is None:
            return None
        return self.dropped + self.lost_on_break


@dataclass(frozen=True, kw_only=True, slots=True)
class NodeRow:
    """A node. From `received_bytes_per_sec` on, the numbers belong to its link, which other nodes may share.

    Attributes:
        name: Its full name. Nodes that share it have a row for each of their links.
        broker: The names of the brokers with nodes of this name; empty unless a mesh has several.
        labels: The labels of the nodes of this name.
        link: The session number of its link; 0 if the broker does not report it.
        shared: Whether another row has the same name.
        state: "linked", or "suspended": its link is silent and may come back.
        silent_ms: Milliseconds since something arrived from it.
        endpoints: The number of its publishers, subscriptions, services and clients; if `shared`, of all
            nodes of its link.
        received_bytes_per_sec, sent_bytes_per_sec: Bytes that it receives and sends per second, also those in
            shared memory.
        queued, queued_bytes: Messages that wait in the broker for it, and their size.
        dropped: Messages that the broker dropped because it was slow.
        drops_per_sec: Messages that the broker drops now, per second.
        pending_calls: Calls of its clients that wait for a response.
        owed_calls: Calls that its services have not answered yet.

    What belongs to the link is None if the broker does not report it, as for a topic.
    """

    name: str
    broker: str
    labels: Mapping[str, str]
    link: int
    shared: bool
    state: str
    silent_ms: int | None
    endpoints: int
    received_bytes_per_sec: float | None
    sent_bytes_per_sec: float | None
    queued: int | None
    queued_bytes: int | None
    dropped: int | None
    drops_per_sec: float | None
    pending_calls: int | None
    owed_calls: int | None


@dataclass(frozen=True, kw_only=True, slots=True)
class ServiceRow:
    """A service.

    Attributes:
        name: Its full name.
        types: The declared types, sorted; more than one is a conflict.
        servers, clients: Their numbers.
        owed_calls: Calls that its servers' links have not answered yet; other services on them count, too.
            None if it has servers, and the broker reports none of their links.
    """

    name: str
    types: tuple[str, ...]
    servers: int
    clients: int
    owed_calls: int | None


@dataclass(frozen=True, kw_only=True, slots=True)
class Totals:
    """The whole broker, all its domains together.

    Attributes:
        broker: The hex id of its instance, which changes with a restart; empty if the numbers are `withheld`.
        uptime_sec: Seconds since it began to listen.
        routed_per_sec: Messages per second that had at least one receiver.
        delivered_per_sec: Copies per second handed to a link.
        shared_per_sec: Of these, copies per second passed on in shared memory.
        drops_per_sec: Copies per second dropped because a link was slow.
        calls_per_sec: Calls per second forwarded to a server.
        received_bytes_per_sec, sent_bytes_per_sec: Bytes per second into the broker and out of it.
        queued, queued_bytes: Copies that wait now, and their size.
        dropped, lost_on_break: Copies dropped, and copies lost with a link, since it listens.
        lag_sec, longest_lag_sec: The lag of its event loop now, and the longest in the last minute.
        connections: Open connections, the observer's included.
        suspended: Links that are silent and may come back.
    """

    broker: str
    uptime_sec: float
    routed_per_sec: float | None
    delivered_per_sec: float | None
    shared_per_sec: float | None
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

    @property
    def withheld(self) -> bool:
        """Whether the broker does not tell these numbers: the user may not administer the whole broker."""
        return not self.broker

    def as_dict(self) -> dict[str, Any]:
        """Return the numbers by name; all are None if the broker withholds them."""
        found = asdict(self)
        return {**dict.fromkeys(found), "broker": ""} if self.withheld else found


@dataclass(frozen=True, kw_only=True, slots=True)
class Overview:
    """A graph at work, with rates over the last few samples.

    Attributes:
        interval_sec: The seconds over which rates are taken; 0.0 while there are none.
        totals: The whole broker.
        topics, nodes, services: Sorted by name.
    """

    interval_sec: float
    totals: Totals
    topics: tuple[TopicRow, ...]
    nodes: tuple[NodeRow, ...]
    services: tuple[ServiceRow, ...]
    seconds = former_name("seconds", "interval_sec")

    def without_hidden(self) -> Overview:
        """Return the overview without hidden names: those with a token that begins with `_`."""
        return Overview(
            interval_sec=self.interval_sec,
            totals=self.totals,
            topics=tuple(row for row in self.topics if not is_hidden(row.name)),
            nodes=tuple(row for row in self.nodes if not is_hidden(row.name)),
            services=tuple(row for row in self.services if not is_hidden(row.name)),
        )

    def as_dict(self) -> dict[str, Any]:
        """Return the overview as dicts, tuples, strings and numbers.

        `seconds`, the former `interval_sec`, stays for one version.
        """
        return {**asdict(self), "totals": self.totals.as_dict(), "seconds": self.interval_sec}


class Samples:
    """The last few samples of a broker.

    Args:
        window: Intervals between samples over which rates are taken, 1 or more.
        least_sec: The shortest interval: a sample that comes sooner is replaced by the next one, and has no
            rates if there is only one before it.
    """

    def __init__(self, window: int = WINDOW, *, least_sec: float = 0.0) -> None:
        self._samples: deque[Sample] = deque(maxlen=max(1, window) + 1)
        self._least_sec = least_sec

    def add(self, sample: Sample) -> Overview:
        """Add the newest sample.

        Args:
            sample: A sample of another broker instance than before clears the window.

        Returns:
            The overview, with rates over the window.
        """
        newest = sample.report.totals
        if self._samples:
            last = self._samples[-1].report.totals
            if last.broker != newest.broker or last.stamp_sec >= newest.stamp_sec:
                self._samples.clear()  # the counters of a restarted broker begin at 0
        # A sample that came too soon after the one before is replaced: two of them would give wild rates.
        if len(self._samples) > 1 and self._is_soon(self._samples[-2], self._samples[-1]):
            self._samples.pop()
        self._samples.append(sample)
        first = self._samples[0]
        soon = self._is_soon(first, sample)
        return overview(sample, None if soon else sample.report.rates_since(first.report))

    def _is_soon(self, earlier: Sample, later: Sample) -> bool:
        seconds = later.report.totals.stamp_sec - earlier.report.totals.stamp_sec
        return seconds <= 0 or seconds < self._least_sec


def overview(sample: Sample, rates: BrokerReportRates | None) -> Overview:
    """Return the overview of a sample.

    Args:
        sample: The graph and the counters.
        rates: The rates up to the sample; None if there are none yet.
    """
    snapshot, report = sample
    links: dict[str, dict[int, LinkStats]] = {}
    for session, link in report.links.items():
        for name in link.nodes:  # the broker names the first few only (MAX_NODE_NAMES)
            links.setdefault(name, {})[session] = link
    return Overview(
        interval_sec=0.0 if rates is None else rates.totals.interval_sec,
        totals=_totals(report, rates),
        topics=tuple(_topics(snapshot, report.topics, None if rates is None else rates.topics)),
        nodes=tuple(_nodes(sample, links, None if rates is None else rates.links)),
        services=tuple(_services(snapshot, links)),
    )


def _totals(report: BrokerReport, rates: BrokerReportRates | None) -> Totals:
    totals = report.totals
    rise = None if rates is None or totals.withheld else rates.totals
    return Totals(
        broker=totals.broker,
        uptime_sec=totals.uptime_sec,
        routed_per_sec=None if rise is None else rise.routed,
        delivered_per_sec=None if rise is None else rise.delivered,
        shared_per_sec=None if rise is None else rise.shared_sent,
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
            shared_per_sec=rise.get("by_reference"),
            drops_per_sec=rise.get("dropped"),
            queued=None if topic is None else topic.queued,
            dropped=None if topic is None else topic.dropped,
            lost_on_break=None if topic is None else topic.lost_on_break,
        )


def _nodes(
    sample: Sample,
    links: Mapping[str, Mapping[int, LinkStats]],
    rates: Mapping[int, Mapping[str, float]] | None,
) -> Iterable[NodeRow]:
    snapshot, names = sample.snapshot, BrokerNames(sample.report)
    endpoints = Counter(entry.node for entry in snapshot.entries.values() if entry.kind != EntryKind.NODE)
    brokers = snapshot.node_brokers() if names.several else {}
    labels = snapshot.node_labels()
    # Suspended nodes are not in the graph, but somebody who looks for a missing node should see them.
    silent = {name for name, found in links.items() if any(link.suspended for link in found.values())}
    rows = [
        (name, link)
        for name in sorted({*snapshot.nodes(), *silent})
        for link in (links[name].values() if name in links else (None,))
    ]
    for name, link in rows:
        rise = _rise(rates, None if link is None else link.session)
        shared = len(links.get(name, ())) > 1
        yield NodeRow(
            name=name,
            broker=names.joined(brokers.get(name, ())),
            labels=labels.get(name, {}),
            link=0 if link is None else link.session,
            shared=shared,
            state=SUSPENDED if link is not None and link.suspended else LINKED,
            silent_ms=None if link is None else link.silent_ms,
            endpoints=link.endpoints - len(link.nodes)
            if link is not None and (shared or link.suspended)
            else endpoints[name],
            received_bytes_per_sec=rise["bytes_sent"] + rise["shared_bytes_sent"] if rise else None,
            sent_bytes_per_sec=rise["bytes_received"] + rise["shared_bytes_received"] if rise else None,
            queued=None if link is None else link.queued,
            queued_bytes=None if link is None else link.queued_bytes,
            dropped=None if link is None else link.dropped,
            drops_per_sec=rise.get("dropped"),
            pending_calls=None if link is None else link.pending_calls,
            owed_calls=None if link is None else link.owed_calls,
        )


def _services(snapshot: GraphSnapshot, links: Mapping[str, Mapping[int, LinkStats]]) -> Iterable[ServiceRow]:
    servers = _counts(snapshot, EntryKind.SERVICE)
    clients = _counts(snapshot, EntryKind.CLIENT)
    owing: dict[str, dict[int, int]] = {}
    for entry in snapshot.of_kind(EntryKind.SERVICE):
        for session, link in links.get(entry.node, {}).items():
            owing.setdefault(entry.name, {})[session] = link.owed_calls
    for name, kinds in snapshot.names_and_types(EntryKind.SERVICE, EntryKind.CLIENT):
        yield ServiceRow(
            name=name,
            types=tuple(kinds),
            servers=servers[name],
            clients=clients[name],
            owed_calls=sum(owing[name].values()) if name in owing else None if servers[name] else 0,
        )


def _counts(snapshot: GraphSnapshot, kind: EntryKind) -> Counter[str]:
    return Counter(entry.name for entry in snapshot.of_kind(kind))


def _rise(rates: Mapping[Any, Mapping[str, float]] | None, key: object) -> Mapping[str, float]:
    """Return the rates of one topic or link; empty if there are none."""
    return {} if rates is None else rates.get(key, {})

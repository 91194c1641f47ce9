"""The numbers of a broker as Prometheus reads them. No I/O.

Names follow Prometheus: a base unit at the end, `_total` for counts that only grow. The names of topics come
from the nodes that declare them, so that only the busiest ones get a label of their own.
"""

from __future__ import annotations

from collections import Counter
from itertools import islice
from typing import TYPE_CHECKING, Final

from prometheus_client import CollectorRegistry, Histogram, generate_latest
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily
from prometheus_client.registry import Collector

from actors.graph.broker_report import TOPIC_TOTALS
from actors.tools.broker_names import BrokerNames
from proto.wire.codes import EntryKind
from proto.wire.stats import increase

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from prometheus_client.metrics_core import Metric

    from actors.graph.broker_report import BrokerReport
    from actors.graph.snapshot import GraphSnapshot
    from proto.wire.stats import TopicStats

MAX_TOPICS: Final = 100
"""Topics with a label of their own. Prometheus keeps a series for each label forever, and peers choose the
names."""

NEW_LABELS: Final = 2 * MAX_TOPICS
"""Until one more topic may get its first label: nodes that invent topics must not fill Prometheus."""

NEW_LABEL_SEC: Final = 60.0
"""Seconds until one more topic may get its first label: nodes that invent topics cannot fill Prometheus."""

MAX_KNOWN: Final = 10_000
"""Names that have had a label and may get it again at any time; a week of new ones."""

OTHER: Final = "(other)"
"""The label of all further topics together; no topic's name, which begins with a slash."""

ROUND_TRIP_BUCKETS: Final = (0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5)
"""Upper bounds of the histogram's buckets, in seconds."""

GAUGES: Final = {
    "callboard_uptime_seconds": ("uptime_sec", "Time since the broker began to listen"),
    "callboard_connections": ("connections", "Open connections of the broker"),
    "callboard_suspended_links": ("suspended", "Links that are silent and may return"),
    "callboard_endpoints": ("endpoints", "Nodes, publishers, subscriptions, services and clients"),
    "callboard_topics": ("topics", "Topics"),
    "callboard_queued_messages": ("queued", "Copies of messages that wait to be sent"),
    "callboard_queued_bytes": ("queued_bytes", "Memory of the copies that wait to be sent"),
    "callboard_held_bytes": ("held_bytes", "Memory that counts for the broker's max_broker_bytes"),
    "callboard_latched_messages": ("latched", "Messages kept for late joiners"),
    "callboard_latched_bytes": ("latched_bytes", "Memory of the messages kept for late joiners"),
    "callboard_pending_calls": ("pending_calls", "Calls that wait for a reply"),
    "callboard_loop_lag_seconds": ("lag_last_sec", "How late the event loop ran its last timer"),
    "callboard_loop_lag_longest_seconds": ("lag_longest_sec", "The longest such delay of the last minute"),
}
"""By name of the metric, the field of BrokerStats and a description."""

COUNTERS: Final = {
    "callboard_messages_routed": ("routed", "Messages that had at least one receiver"),
    "callboard_copies_delivered": ("delivered", "Copies of messages handed to connections"),
    "callboard_received_frames": (
        "frames_received",
        "Frames from all connections; a batch of messages is one",
    ),
    "callboard_received_bytes": ("bytes_received", "Bytes from all connections"),
    "callboard_sent_bytes": ("bytes_sent", "Bytes to all connections"),
    "callboard_shared_memory_messages": ("shared_received", "Large messages received by reference"),
    "callboard_shared_memory_copies": ("shared_sent", "Copies of large messages sent by reference"),
    "callboard_shared_memory_failures": ("refused_arenas", "Failed attempts to share memory"),
    "callboard_calls": ("calls", "Calls forwarded to a server"),
    "callboard_late_replies": ("late_replies", "Replies that nobody waited for any more"),
    "callboard_reader_stalls": ("stalls", "KEEP_ALL subscriptions that lost their credit"),
    "callboard_refused_declarations": ("refused_declarations", "Declarations that a limit has refused"),
    "callboard_tls_failures": ("tls_failures", "Connections that ended because TLS failed"),
}
"""By name of the metric, to which `_total` is added, the field of BrokerStats and a description."""

REASONS: Final = {
    "callboard_lost_copies": (
        "Copies of messages that did not reach a subscription, by reason",
        {"bytes": "dropped_for_bytes", "abandoned": "abandoned", "connection_lost": "lost_on_break"},
    ),
    "callboard_discarded_messages": (
        "Messages that were discarded before they were routed, by reason",
        {"unmatched": "unmatched", "repeated": "stale", "memory": "refused_messages"},
    ),
    "callboard_refused_calls": ("Calls that were refused, by reason", {"overloaded": "overloaded_calls"}),
    "callboard_refused_connections": (
        "Connections that were refused, by reason",
        {"per_address": "refused_per_address", "unauthorized": "unauthorized_connections"},
    ),
    "callboard_closed_links": (
        "Links that the broker closed, by reason",
        {"memory": "closed_for_memory", "incomplete_message": "reassembly_timeouts"},
    ),
}
"""Counters by reason: the field of BrokerStats of each."""

REMAINDERS: Final = {
    "callboard_lost_copies": ("depth", "dropped", "dropped_for_bytes"),
    "callboard_refused_calls": ("other", "refused_calls", "overloaded_calls"),
    "callboard_refused_connections": ("too_many", "refused_connections", "refused_per_address"),
}
"""One more reason of a counter in REASONS: its name, and the two fields whose difference it is."""

MESH_PROBLEMS: Final = (
    "dropped", "overruns", "failed", "malformed", "ignored", "refused", "resets", "limited", "overflows"
)  # fmt: skip
"""Fields of MeshStats, whose names are the reasons."""

TOPIC_COUNTERS: Final = {
    "callboard_topic_messages": ("messages", "Messages that a topic's publishers have sent"),
    "callboard_topic_bytes": ("bytes", "Size of the messages that a topic's publishers have sent"),
    "callboard_topic_copies_delivered": ("delivered", "Copies of a topic's messages handed to connections"),
    "callboard_topic_copies_dropped": ("dropped", "Copies of a topic's messages dropped: a reader is slow"),
}
"""Metrics of each of the busiest `MAX_TOPICS` topics, and of the others together."""


class Metrics:
    """The content of `/metrics`.

    Attributes:
        round_trips: Of the probes to the broker and back.
    """

    def __init__(self) -> None:
        self._registry = CollectorRegistry()
        self._collector = _BrokerCollector()
        self._registry.register(self._collector)
        self.round_trips = Histogram(
            "callboard_round_trip_seconds",
            "Time of a question to the broker and its answer, asked every few seconds",
            buckets=ROUND_TRIP_BUCKETS,
            registry=self._registry,
        )

    def text(self, report: BrokerReport | None, snapshot: GraphSnapshot, now_sec: float) -> bytes:
        """Return the metrics in Prometheus' text format.

        Args:
            report: The broker's counters now; None if it does not answer.
            snapshot: The graph.
            now_sec: Of a monotonic clock.
        """
        self._collector.update(report, snapshot, now_sec)
        return generate_latest(self._registry)


class _BrokerCollector(Collector):
    """Makes metrics of the newest report."""

    def __init__(self) -> None:
        self._report: BrokerReport | None = None
        self._snapshot: GraphSnapshot | None = None
        self._broker = ""
        self._lost = 0
        self._topics = TopicCounts()

    def update(self, report: BrokerReport | None, snapshot: GraphSnapshot, now_sec: float) -> None:
        """Replace the report and the snapshot of the graph that `collect` describes."""
        self._report, self._snapshot = report, snapshot
        if report is None:
            return
        if report.totals.broker != self._broker:  # another broker counts from 0
            self._broker, self._lost = report.totals.broker, 0
            self._topics.restart()
        # It may fall, when a message arrives that was counted as lost; a counter must not.
        self._lost = max(self._lost, report.totals.lost_on_break)
        self._topics.update(report.topics, now_sec)

    def describe(self) -> list[Metric]:
        """Return nothing: the registry needs names only to find collectors that share one."""
        return []

    def collect(self) -> Iterator[Metric]:
        """Return the metrics."""
        report, snapshot = self._report, self._snapshot
        yield GaugeMetricFamily("callboard_up", "Whether the broker answers", value=float(report is not None))
        if report is None or snapshot is None:
            return
        text = 'Whether the broker withholds its numbers: the server\'s user may not administer "/"'
        yield GaugeMetricFamily("callboard_withheld", text, value=float(report.totals.withheld))
        yield from self._graph_metrics(snapshot)
        # Absent, not 0: a 0 would look like a broker without connections and losses.
        if not report.totals.withheld:
            yield from self._broker_metrics(report)
            yield from _mesh_metrics(report)
        if report.topics or not report.totals.withheld:
            yield from self._topics.metrics()

    def _broker_metrics(self, report: BrokerReport) -> Iterator[Metric]:
        totals = {**report.totals.as_dict(), "lost_on_break": self._lost}  # as a counter, which never falls
        for name, (field, text) in GAUGES.items():
            yield GaugeMetricFamily(name, text, value=totals[field])
        for name, (field, text) in COUNTERS.items():
            yield CounterMetricFamily(name, text, value=totals[field])
        for name, (text, reasons) in REASONS.items():
            values = {reason: totals[field] for reason, field in reasons.items()}
            if name in REMAINDERS:
                reason, whole, part = REMAINDERS[name]
                values[reason] = max(0, totals[whole] - totals[part])
            yield _counter_by(name, text, "reason", values)
        queued = max((link.queued for link in report.links.values()), default=0)
        text = "Messages that wait for the slowest link of the domain"
        yield GaugeMetricFamily("callboard_link_queued_messages_longest", text, value=queued)

    def _graph_metrics(self, snapshot: GraphSnapshot) -> Iterator[Metric]:
        yield GaugeMetricFamily("callboard_nodes", "Nodes of the domain", value=len(snapshot.nodes()))
        kinds = Counter(entry.kind for entry in snapshot.entries.values())
        shown = {kind.name.lower(): kinds[kind] for kind in EntryKind if kind != EntryKind.NODE}
        yield _gauge_by("callboard_domain_endpoints", "Endpoints of the domain, by kind", "kind", shown)


class TopicCounts:
    """Counts of topics, with few labels.

    All topics without a label of their own share one counter. It adds up by how much they grow, because a
    counter must not fall when a topic ends or gets a label of its own.

    The busiest topics have labels. A name that has never had one gets it if there have been few such names: a
    new label is a new series for each metric, which Prometheus keeps.

    Args:
        limit: Topics with a label of their own.
    """

    def __init__(self, limit: int = MAX_TOPICS) -> None:
        self._limit = limit
        self._new_labels, self._counted_sec = float(NEW_LABELS), 0.0
        self._known: dict[str, None] = {}
        """Names that have had a label, in the order in which they were busy last."""
        self.restart()

    def restart(self) -> None:
        """Begin anew, for another broker."""
        self._earlier: Mapping[str, TopicStats] = {}
        self._named: list[TopicStats] = []
        self._others: Counter[str] = Counter()
        self._other_queued = 0
        self._refused = 0

    def update(self, topics: Mapping[str, TopicStats], now_sec: float) -> None:
        """Replace the numbers of all topics.

        Args:
            topics: By name.
            now_sec: Of a monotonic clock.
        """
        passed, self._counted_sec = max(0.0, now_sec - self._counted_sec), now_sec
        self._new_labels = min(float(NEW_LABELS), self._new_labels + passed / NEW_LABEL_SEC)
        ranked = sorted(topics.values(), key=lambda topic: (-topic.messages, topic.name))
        admitted = {topic.name for topic in ranked[: self._limit] if self._admit(topic.name)}
        self._refused = min(len(ranked), self._limit) - len(admitted)
        # Places of topics without a label are for those that had one: no place is empty because of newcomers.
        kept = (topic.name for topic in ranked[self._limit :] if topic.name in self._known)
        admitted |= {*islice(kept, self._refused)}
        self._named = [topic for topic in ranked if topic.name in admitted]
        others = [topic for topic in ranked if topic.name not in admitted]
        for topic in others:
            self._others.update(increase(TOPIC_TOTALS, self._earlier.get(topic.name), topic))
        self._other_queued = sum(topic.queued for topic in others)
        self._earlier = topics

    def _admit(self, name: str) -> bool:
        """Return whether a busy topic gets a label."""
        if name not in self._known:
            if self._new_labels < 1:
                return False
            self._new_labels -= 1
        self._known.pop(name, None)
        self._known[name] = None
        if len(self._known) > MAX_KNOWN:
            del self._known[next(iter(self._known))]
        return True

    def metrics(self) -> Iterator[Metric]:
        """Return the metrics."""
        for name, (field, text) in TOPIC_COUNTERS.items():
            counts = {topic.name: getattr(topic, field) for topic in self._named}
            yield _counter_by(name, text, "topic", {**counts, OTHER: self._others[field]})
        text = "Busy topics without a label of their own, because too many names were new"
        yield GaugeMetricFamily("callboard_topics_without_label", text, value=self._refused)
        queued = {topic.name: topic.queued for topic in self._named}
        text = "Copies of a topic's messages that wait to be sent"
        yield _gauge_by(
            "callboard_topic_queued_messages", text, "topic", {**queued, OTHER: self._other_queued}
        )


def _mesh_metrics(report: BrokerReport) -> Iterator[Metric]:
    if not report.brokers:
        return
    mesh, names = report.mesh, BrokerNames(report)
    yield GaugeMetricFamily("callboard_mesh_brokers", "Other brokers that are alive", value=mesh.brokers)
    traffic = {
        "callboard_mesh_sent_messages": ("Messages sent to other brokers", mesh.sent),
        "callboard_mesh_sent_bytes": ("Bytes sent to other brokers", mesh.bytes_sent),
        "callboard_mesh_received_messages": ("Messages received from other brokers", mesh.received),
        "callboard_mesh_received_bytes": ("Bytes received from other brokers", mesh.bytes_received),
    }
    for name, (text, value) in traffic.items():
        yield CounterMetricFamily(name, text, value=value)
    waiting = {
        "broker": mesh.waiting_bytes, "network": mesh.sending_bytes, "event_loop": mesh.unhandled_bytes
    }  # fmt: skip
    text = "Bytes from and to other brokers, by what they wait for"
    yield _gauge_by("callboard_mesh_waiting_bytes", text, "waits_for", waiting)
    problems = {reason: getattr(mesh, reason) for reason in MESH_PROBLEMS}
    text = "Messages of the mesh that were lost or refused, and exchanges restarted, by reason"
    yield _counter_by("callboard_mesh_problems", text, "reason", problems)
    trips = {
        names[number]: broker.round_trip_us / 1e6
        for number, broker in report.brokers.items()
        if broker.round_trip_us
    }
    text = "The last round trip to another broker"
    yield _gauge_by("callboard_mesh_round_trip_seconds", text, "broker", trips)


def _gauge_by(name: str, text: str, label: str, values: Mapping[str, float]) -> Metric:
    family = GaugeMetricFamily(name, text, labels=(label,))
    for each, value in values.items():
        family.add_metric((each,), value)
    return family


def _counter_by(name: str, text: str, label: str, values: Mapping[str, float]) -> Metric:
    family = CounterMetricFamily(name, text, labels=(label,))
    for each, value in values.items():
        family.add_metric((each,), value)
    return family

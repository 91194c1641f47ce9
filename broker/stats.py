"""Looks at a broker's graphs and links: what is behind `Broker.stats()`. Pure: time is an argument.

Nothing is kept for this but counters where things happen; a look costs about as much as there are lanes,
topics and links.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING, Final, TypeVar

from broker.records import NodeRecord
from proto import frames
from proto.loop_lag import LoopLag
from proto.stats import MAX_NODE_NAMES, BrokerStats, LinkStats, TopicStats

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping

    from broker.connection import Connection
    from broker.router import Router
    from proto.aio.channel import Channel


EntryT = TypeVar("EntryT")

TOPICS_PER_FRAME: Final = 500
LINKS_PER_FRAME: Final = 40
"""Keep a STATS frame below limits.MAX_FRAME_BYTES, however long the names are."""


class Meter:
    """What a broker counts beside its graphs.

    Attributes:
        started_at: Loop time since which it listens.
        lag: How late its ticker comes.
    """

    def __init__(self) -> None:
        self.started_at = 0.0
        self.lag = LoopLag()
        self._bytes_received = self._bytes_sent = 0

    def ended(self, channel: Channel) -> None:
        """A connection is gone; its bytes still count."""
        self._bytes_received += channel.bytes_received
        self._bytes_sent += channel.bytes_sent

    def look(self, now: float, connections: Collection[Connection], routers: Iterable[Router]) -> BrokerStats:
        """Return the numbers of the whole broker."""
        outboxes = [each.channel.outbox for each in connections]
        return replace(
            collect(len(connections), routers),
            stamp_sec=now,
            uptime_sec=now - self.started_at,
            lag_last_sec=self.lag.last_sec,
            lag_longest_sec=self.lag.longest_sec(now),
            suspended=sum(each.suspended_at is not None for each in connections),
            queued_bytes=sum(outbox.held_bytes for outbox in outboxes),
            urgent_bytes=sum(outbox.urgent_bytes for outbox in outboxes),
            ordered_bytes=sum(outbox.ordered_bytes for outbox in outboxes),
            bytes_received=self._bytes_received + sum(each.channel.bytes_received for each in connections),
            bytes_sent=self._bytes_sent + sum(each.channel.bytes_sent for each in connections),
        )


def collect(connections: int, routers: Iterable[Router]) -> BrokerStats:
    """Return the numbers of all graphs of a broker together; those of its links and its clock are missing."""
    graphs = list(routers)
    topics = [router.topics for router in graphs]
    services = [router.services for router in graphs]
    tallies = [topic.tallies()[0] for topic in topics]
    publishers = [publisher for topic in topics for publisher in topic.publishers()]
    return BrokerStats(
        connections=connections,
        endpoints=sum(len(router.graph) for router in graphs),
        topics=sum(len(topic.records()) for topic in topics),
        routed=sum(topic.routed for topic in topics),
        copies=sum(topic.copies for topic in topics),
        delivered=sum(tally.delivered for tally in tallies),
        dropped=sum(tally.dropped for tally in tallies),
        dropped_for_bytes=sum(tally.dropped_for_bytes for tally in tallies),
        abandoned=sum(tally.abandoned for tally in tallies),
        lost_on_break=sum(tally.lost_on_break for tally in tallies),
        leaving=sum(tally.leaving for tally in tallies),
        queued=sum(tally.queued for tally in tallies),
        latched=sum(publisher.latched_messages for publisher in publishers),
        latched_bytes=sum(publisher.latched_bytes for publisher in publishers),
        latched_dropped=sum(topic.latched_dropped for topic in topics),
        unmatched=sum(topic.unmatched for topic in topics),
        stale=sum(topic.stale for topic in topics),
        calls=sum(service.calls for service in services),
        refused_calls=sum(service.refused for service in services),
        pending_calls=sum(service.pending for service in services),
        late_replies=sum(service.late for service in services),
        definitions=sum(len(router.definitions) for router in graphs),
        definition_bytes=sum(router.definitions.size_bytes for router in graphs),
    )


def topic_stats(router: Router) -> Iterator[TopicStats]:
    """Return the numbers of each topic of a graph."""
    _, tallies = router.topics.tallies()
    for topic in router.topics.records():
        tally = tallies.get(topic, topic.settled)
        yield TopicStats(
            domain=router.domain,
            name=topic.name,
            publishers=len(topic.publishers),
            subscriptions=len(topic.subscriptions),
            messages=topic.messages,
            bytes=topic.bytes,
            delivered=tally.delivered,
            dropped=tally.dropped,
            abandoned=tally.abandoned,
            lost_on_break=tally.lost_on_break,
            leaving=tally.leaving,
            queued=tally.queued,
            latched_dropped=topic.latched_dropped,
        )


def link_stats(now: float, router: Router, joined: Mapping[int, Connection]) -> Iterator[LinkStats]:
    """Return the numbers of each link of a graph.

    Args:
        now: Loop time.
        router: The graph.
        joined: The connections of its peers, by peer.
    """
    queued: Counter[int] = Counter()
    queued_bytes: Counter[int] = Counter()
    for queue, _, number, _ in router.topics.peer_queues():
        queued[number] += queue.pending
        queued_bytes[number] += queue.pending_bytes
    for number, connection in joined.items():
        peer, channel = router.peer(number), connection.channel
        endpoints = () if peer is None else tuple(peer.endpoints.values())
        nodes = [endpoint.name for endpoint in endpoints if isinstance(endpoint, NodeRecord)]
        yield LinkStats(
            domain=router.domain,
            session=connection.session,
            agent=connection.agent,
            nodes=tuple(nodes[:MAX_NODE_NAMES]),
            endpoints=len(endpoints),
            suspended=connection.suspended_at is not None,
            silent_ms=round(1000 * connection.silent_s(now)),
            queued=queued[number],
            queued_bytes=queued_bytes[number],
            waiting_bytes=channel.outbox.urgent_bytes + channel.outbox.ordered_bytes,
            dropped=channel.outbox.dropped,
            bytes_received=channel.bytes_received,
            bytes_sent=channel.bytes_sent,
            pending_calls=0 if peer is None else peer.pending_calls,
            owed_calls=0 if peer is None else peer.owed_calls,
        )


def answer(
    question: int, totals: BrokerStats, topics: tuple[TopicStats, ...], links: tuple[LinkStats, ...]
) -> Iterator[frames.Stats]:
    """Return the numbers as the frames that answer an INSPECT."""
    pieces: list[tuple[tuple[TopicStats, ...], tuple[LinkStats, ...]]] = [
        *((part, ()) for part in _slices(topics, TOPICS_PER_FRAME)),
        *(((), part) for part in _slices(links, LINKS_PER_FRAME)),
    ]
    shown: frames.Options = totals.as_dict()
    for number, piece in enumerate(pieces or [((), ())], 1):
        yield frames.Stats(question, number < len(pieces), shown, *piece)
        shown = {}


def _slices(entries: tuple[EntryT, ...], size: int) -> Iterator[tuple[EntryT, ...]]:
    for start in range(0, len(entries), size):
        yield entries[start : start + size]

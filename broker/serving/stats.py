"""The numbers behind `Broker.stats()`, and the answers to INSPECT. Pure: time is an argument.

Counters are kept where things happen and summed up here on demand; that costs about as much as there are
publisher queues, topics and links.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Final, TypeVar

from broker.access.rules import Action
from proto.loop_lag import LoopLag
from proto.wire import frames
from proto.wire.stats import MAX_NODE_NAMES, BrokerStats, LinkStats, MeshBrokerStats, MeshStats, TopicStats

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from broker.routing.records import Peer
    from broker.routing.router import Router
    from broker.serving.dispatcher import Dispatcher
    from broker.serving.link import Link


EntryT = TypeVar("EntryT")

WHOLE_BROKER: Final = "/"
"""The name under which the rules know what belongs to no node and no topic; `/**` matches it."""

TOPICS_PER_FRAME: Final = 500
LINKS_PER_FRAME: Final = 40
BROKERS_PER_FRAME: Final = 300
"""Keep a STATS frame below limits.MAX_FRAME_BYTES, however long the names are."""


class Statistics:
    """The numbers of one run of a broker.

    Args:
        broker: The broker's random identity, in hexadecimal.
        dispatcher: Its links and graphs.

    Attributes:
        started_at: Loop time since which it listens.
        lag: How late its periodic check is.
    """

    def __init__(self, broker: str, dispatcher: Dispatcher) -> None:
        self.started_at = 0.0
        self.lag = LoopLag()
        self._broker = broker
        self._dispatcher = dispatcher

    def totals(self, now: float) -> BrokerStats:
        """Return the numbers of the whole broker."""
        dispatcher = self._dispatcher
        channels = [link.channel for link in dispatcher.links]
        outboxes = [channel.outbox for channel in channels]
        outboxes += [channel.outbox for channel in dispatcher.mesh_channels.values()]
        return replace(
            collect(len(channels), dispatcher.joined),
            broker=self._broker,
            **asdict(dispatcher.limit_counts),
            refused_connections=dispatcher.capacity.refused,
            unauthorized_connections=dispatcher.admission.unauthorized,
            stamp_sec=now,
            uptime_sec=now - self.started_at,
            lag_last_sec=self.lag.last_sec,
            lag_longest_sec=self.lag.longest_sec(now),
            suspended=sum(link.suspended_at is not None for link in dispatcher.links),
            queued_bytes=sum(outbox.held_bytes for outbox in outboxes),
            urgent_bytes=sum(outbox.urgent_bytes for outbox in outboxes),
            ordered_bytes=sum(outbox.ordered_bytes for outbox in outboxes),
            reassembly_bytes=dispatcher.reassembly.bytes,
            received_bytes=dispatcher.received.bytes,
            held_bytes=dispatcher.memory.held_bytes,
            refused_messages=dispatcher.reassembly.refused,
            closed_for_memory=dispatcher.memory.closed,
            **dispatcher.shared_memory.counts(link.memory for link in dispatcher.links),
            frames_received=dispatcher.closed_frames_received
            + sum(each.frames_received for each in channels),
            bytes_received=dispatcher.closed_bytes_received + sum(each.bytes_received for each in channels),
            bytes_sent=dispatcher.closed_bytes_sent + sum(each.bytes_sent for each in channels),
        )

    def mesh(self) -> MeshStats:
        """Return the numbers of the mesh."""
        mesh = self._dispatcher.mesh
        return MeshStats() if mesh is None else mesh.totals()

    def topics(self) -> list[TopicStats]:
        """Return the numbers of each topic of each graph."""
        return [topic for router in self._dispatcher.joined for topic in topic_stats(router)]

    def links(self, now: float) -> list[LinkStats]:
        """Return the numbers of each link that has joined a graph."""
        joined = self._dispatcher.joined
        return [link for router in joined for link in link_stats(now, router, joined[router])]

    def answer(self, now: float, router: Router, link: Link, totals: BrokerStats) -> Iterator[frames.Stats]:
        """Return the frames that answer an INSPECT with the id 0 from a link of this graph.

        They leave out what the link's user may not administer, except the numbers of the link itself, and the
        names of the brokers of the mesh.
        """
        topics = tuple(topic_stats(router))
        links = tuple(link_stats(now, router, self._dispatcher.joined[router]))
        mesh, peer = self._dispatcher.mesh, router.peer(link.peer)
        brokers = () if mesh is None else mesh.brokers(router.domain)
        numbers = {} if mesh is None else mesh.totals().as_dict()
        if peer is not None and peer.rights is not None:
            if not peer.may(Action.ADMINISTER, WHOLE_BROKER):
                # The time remains: rates of the topics that the user may administer need it.
                totals, numbers = BrokerStats(stamp_sec=totals.stamp_sec), {}
                brokers = tuple(MeshBrokerStats(*each[:3]) for each in brokers)
            topics = tuple(topic for topic in topics if peer.may(Action.ADMINISTER, topic.name))
            links = tuple(each for each in links if each.session == link.session or _may_inspect(peer, each))
        return answer(0, totals, topics, links, brokers=brokers, mesh=numbers)


def _may_inspect(peer: Peer, link: LinkStats) -> bool:
    return all(peer.may(Action.ADMINISTER, name) for name in link.nodes or (WHOLE_BROKER,))


def collect(connections: int, routers: Iterable[Router]) -> BrokerStats:
    """Return the numbers of all graphs together, without those of links and of the clock."""
    graphs = list(routers)
    routes = [router.routes for router in graphs]
    calls = [router.calls for router in graphs]
    tallies = [each.tallies()[0] for each in routes]
    publishers = [publisher for each in routes for publisher in each.publishers.values()]
    return BrokerStats(
        connections=connections,
        endpoints=sum(len(router.graph) for router in graphs),
        topics=sum(len(router.topics.by_name.values()) for router in graphs),
        routed=sum(each.routed for each in routes),
        copies=sum(each.copies for each in routes),
        delivered=sum(tally.delivered for tally in tallies),
        dropped=sum(tally.dropped for tally in tallies),
        dropped_for_bytes=sum(tally.dropped_for_bytes for tally in tallies),
        abandoned=sum(tally.abandoned for tally in tallies),
        lost_on_break=sum(tally.lost_on_break for tally in tallies),
        leaving=sum(tally.leaving for tally in tallies),
        queued=sum(tally.queued for tally in tallies),
        latched=sum(publisher.latched_messages for publisher in publishers),
        latched_bytes=sum(publisher.latched_bytes for publisher in publishers),
        latched_dropped=sum(each.latched_dropped for each in routes),
        unmatched=sum(each.unmatched for each in routes),
        stale=sum(each.stale for each in routes),
        calls=sum(each.routed for each in calls),
        refused_calls=sum(each.refused for each in calls),
        overloaded_calls=sum(each.overloaded for each in calls),
        stalls=sum(router.topics.stalls.count for router in graphs),
        departed_overflows=sum(each.departed.overflows for each in routes),
        refused_declarations=sum(router.refusals.count for router in graphs),
        pending_calls=sum(each.pending for each in calls),
        late_replies=sum(each.late for each in calls),
        definitions=sum(len(router.declarations.definitions) for router in graphs),
        definition_bytes=sum(router.declarations.definitions.size_bytes for router in graphs),
        refused_definitions=sum(router.declarations.definitions.refused for router in graphs),
    )


def topic_stats(router: Router) -> Iterator[TopicStats]:
    """Return the numbers of each topic of a graph."""
    _, tallies = router.routes.tallies()
    for topic in router.topics.by_name.values():
        tally = tallies.get(topic, topic.forgotten)
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
            by_reference=topic.by_reference,
        )


def link_stats(now: float, router: Router, joined: Mapping[int, Link]) -> Iterator[LinkStats]:
    """Return the numbers of each link of a graph.

    Args:
        now: Loop time.
        router: The graph.
        joined: Its links, by peer.
    """
    queued: Counter[int] = Counter()
    queued_bytes: Counter[int] = Counter()
    for queue, _, number, *_ in router.routes.peer_queues():
        queued[number] += queue.pending
        queued_bytes[number] += queue.pending_bytes
    for number, link in joined.items():
        peer, channel = router.peer(number), link.channel
        nodes = [] if peer is None else peer.node_names()
        yield LinkStats(
            domain=router.domain,
            session=link.session,
            agent=link.agent,
            nodes=tuple(nodes[:MAX_NODE_NAMES]),
            endpoints=0 if peer is None else len(peer.endpoints),
            suspended=link.suspended_at is not None,
            silent_ms=round(1000 * link.silent_sec(now)),
            queued=queued[number],
            queued_bytes=queued_bytes[number],
            waiting_bytes=channel.outbox.urgent_bytes + channel.outbox.ordered_bytes,
            dropped=channel.outbox.dropped,
            bytes_received=channel.bytes_received,
            bytes_sent=channel.bytes_sent,
            pending_calls=0 if peer is None else peer.pending_calls,
            owed_calls=0 if peer is None else peer.owed_calls,
            shared_bytes_received=0 if link.memory is None else link.memory.received_bytes,
            shared_bytes_sent=0 if link.memory is None else link.memory.references.sent_bytes,
        )


def answer(
    inspect: int,
    totals: BrokerStats,
    topics: tuple[TopicStats, ...],
    links: tuple[LinkStats, ...],
    *,
    brokers: tuple[MeshBrokerStats, ...] = (),
    mesh: frames.Options | None = None,
) -> Iterator[frames.Stats]:
    """Return the numbers as the frames that answer an INSPECT; only the first has the totals and `mesh`."""
    pieces: list[tuple[tuple[TopicStats, ...], tuple[LinkStats, ...], tuple[MeshBrokerStats, ...]]] = [
        *((part, (), ()) for part in _slices(topics, TOPICS_PER_FRAME)),
        *(((), part, ()) for part in _slices(links, LINKS_PER_FRAME)),
        *(((), (), part) for part in _slices(brokers, BROKERS_PER_FRAME)),
    ]
    numbers: frames.Options = totals.as_dict()
    for count, piece in enumerate(pieces or [((), (), ())], 1):
        yield frames.Stats(inspect, count < len(pieces), numbers, *piece, mesh or {})
        numbers = mesh = {}


def _slices(entries: tuple[EntryT, ...], size: int) -> Iterator[tuple[EntryT, ...]]:
    for start in range(0, len(entries), size):
        yield entries[start : start + size]

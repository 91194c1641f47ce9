"""Publishers of which a heartbeat says how far they have come, because no later message would show a loss.

A reader grants credit for what it has received. If everything within its credit was lost, the publisher would
wait for ever; likewise if bytes were lost so often that the rest of its credit is none. What is latched, such
as a map, may be the last message for long.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from broker.mesh.messages import Held
from proto.wire.mesh_keys import mesh_key

if TYPE_CHECKING:
    from collections.abc import Mapping

    from broker.routing.records import PublisherRecord, Route
    from broker.routing.router import Router

LATCHED_HEARTBEATS: Final = 10
"""Heartbeats, one a second, that name a publisher with latched messages after its last message."""


class HeldPublishers:
    """The publishers that the heartbeats of one graph name.

    Args:
        router: The graph's router.
        peer: The id of its peer for the mesh.
    """

    def __init__(self, router: Router, peer: int) -> None:
        self._router = router
        self._peer = peer
        self._latched: dict[int, tuple[int, int]] = {}
        """By key, the next numbers of publishers with latched messages, and since how many heartbeats."""

    def next_sequences(self) -> dict[int, Held]:
        """Return the publishers that the next heartbeat names, by their numbers."""
        held: dict[int, Held] = {}
        latched, self._latched = self._latched, {}
        for publisher in self._router.topics.matched.values():
            route = publisher.routes.get(self._peer)
            if route is None:
                continue
            next_sequence = route.queue.next_sequence or publisher.next_sequence
            # The last message before a silence shows no gap when it is lost. A publisher that waits for
            # credit is silent for sure; a latched message matters to late joiners for as long as it is kept,
            # but not for ever.
            heartbeats = 0
            if publisher.keep and route.queue.empty:
                before, heartbeats = latched.get(publisher.key, (next_sequence, -1))
                heartbeats = heartbeats + 1 if before == next_sequence else 0
                self._latched[publisher.key] = next_sequence, heartbeats
            if 0 < heartbeats <= LATCHED_HEARTBEATS or _waits_for_credit(publisher, route):
                held[publisher.number] = Held(next_sequence, self._waits_for(publisher))
        return held

    def _waits_for(self, publisher: PublisherRecord) -> tuple[int, ...]:
        """Return the brokers with subscriptions whose credit is used up."""
        credit, next_sequence = publisher.credit, publisher.next_sequence
        brokers = {
            subscription.broker
            for key, subscription in publisher.matched.items()
            if subscription.mirrored and credit.limits.used_up(key, next_sequence, credit.bytes)
        }
        return tuple(sorted(brokers))


def _waits_for_credit(publisher: PublisherRecord, route: Route) -> bool:
    queue = route.queue
    if queue.sendable:
        return False
    return not queue.empty or publisher.credit.used_up(publisher.next_sequence)


def has_lost(router: Router, broker: int, held: Mapping[int, Held]) -> bool:
    """Return whether last messages of another broker's held publishers are missing."""
    publishers = router.routes.publishers
    for number, (next_sequence, _) in held.items():
        publisher = publishers.get(mesh_key(broker, number))
        if publisher is None or not (publisher.mirrored and publisher.opened):
            continue
        if publisher.next_sequence < next_sequence:
            return True
    return False


def stuck_publishers(
    router: Router, here: int, broker: int, held: Mapping[int, Held]
) -> set[tuple[int, int]]:
    """Return which of another broker's publishers have lost messages, and wait for credit that they have.

    Readers do not grant again the bytes that were lost. What was granted may also be on its way: only a
    publisher that is here again and again is stuck.

    Args:
        router: The graph's router.
        here: This broker's number.
        broker: The other broker.
        held: What its heartbeat says.

    Returns:
        Their numbers and next sequence numbers.
    """
    stuck: set[tuple[int, int]] = set()
    for number, (next_sequence, brokers) in held.items():
        publisher = router.routes.publishers.get(mesh_key(broker, number))
        if here not in brokers or publisher is None or not publisher.has_gap:
            continue
        if not publisher.credit.used_up(publisher.next_sequence):
            stuck.add((number, next_sequence))
    return stuck

"""Publishers of which a heartbeat says how far they have come, because no later message would show a loss.

A reader grants credit for what it has received. If everything within its credit was lost, the publisher would
wait for ever; likewise if bytes were lost so often that the rest of its credit is none. What is latched, such
as a map, may be the last message for long.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Mapping

    from broker.records import PublisherRecord, Route
    from broker.router import Router

LATCHED_BEATS: Final = 10
"""Heartbeats that name a publisher with latched messages after its last message."""


class HeldPublishers:
    """The publishers that the heartbeats of one graph name.

    Args:
        router: The graph's router.
        mesh: The id of its peer for the mesh.
    """

    def __init__(self, router: Router, mesh: int) -> None:
        self._router = router
        self._mesh = mesh
        self._latched: dict[int, tuple[int, int]] = {}
        """By key, the next numbers of publishers with latched messages, and since how many heartbeats."""

    def beat(self) -> dict[int, int]:
        """Return this broker's publishers by their numbers, with their next sequence numbers."""
        held: dict[int, int] = {}
        latched, self._latched = self._latched, {}
        for publisher in self._router.routes.publishers.values():
            route = publisher.routes.get(self._mesh)
            if route is None:
                continue
            next_sequence = route.queue.next_sequence or publisher.next_sequence
            beats = 0
            if publisher.keep and route.queue.empty:
                before, beats = latched.get(publisher.key, (next_sequence, -1))
                beats = beats + 1 if before == next_sequence else 0
                self._latched[publisher.key] = next_sequence, beats
            if 0 < beats <= LATCHED_BEATS or _waits_for_credit(publisher, route):
                held[publisher.number] = next_sequence
        return held


def _waits_for_credit(publisher: PublisherRecord, route: Route) -> bool:
    queue = route.queue
    if queue.sendable:
        return False
    return not queue.empty or publisher.credit.used_up(publisher.next_sequence)


def has_lost(router: Router, broker: int, held: Mapping[int, int]) -> bool:
    """Return whether the last messages of another broker's held publishers have not come."""
    publishers = router.routes.publishers
    for number, next_sequence in held.items():
        publisher = publishers.get(broker << 32 | number)
        if publisher is None or not (publisher.peer.mesh and publisher.opened):
            continue
        if publisher.next_sequence < next_sequence:
            return True
    return False


def stuck_publishers(router: Router, broker: int, held: Mapping[int, int]) -> dict[tuple[int, int], int]:
    """Return those of another broker's held publishers that have lost messages and have credit here.

    Readers do not grant again the bytes that were lost.

    Returns:
        By number and next sequence number, how many heartbeats may say so: what has been granted may be on
        its way, and one with latched messages need not wait for credit.
    """
    stuck: dict[tuple[int, int], int] = {}
    for number, next_sequence in held.items():
        publisher = router.routes.publishers.get(broker << 32 | number)
        if publisher is None or not publisher.has_gap or publisher.credit.limit is None:
            continue
        if not publisher.credit.used_up(publisher.next_sequence):
            stuck[number, next_sequence] = 1 + (LATCHED_BEATS if publisher.keep else 0)
    return stuck

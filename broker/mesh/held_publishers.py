"""Publishers that wait for credit of other brokers' subscriptions: a heartbeat says how far they have come.

A reader grants credit for what it has received. If everything within its credit was lost, no later message
would show the loss, and the publisher would wait for ever.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from broker.records import PublisherRecord, Route
    from broker.router import Router


def held_publishers(router: Router, mesh: int) -> dict[int, int]:
    """Return, by their numbers, the next sequence numbers of this broker's publishers that wait for credit.

    Args:
        router: The graph's router.
        mesh: The id of its peer for the mesh.
    """
    held: dict[int, int] = {}
    for publisher in router.routes.publishers.values():
        route = publisher.routes.get(mesh)
        if route is not None and _waits_for_credit(publisher, route):
            held[publisher.number] = route.queue.next_sequence or publisher.next_sequence
    return held


def _waits_for_credit(publisher: PublisherRecord, route: Route) -> bool:
    queue = route.queue
    if queue.sendable:
        return False
    return not queue.empty or publisher.credit.used_up(publisher.next_sequence)


def has_lost(router: Router, broker: int, held: Mapping[int, int]) -> bool:
    """Return whether messages of another broker's held publishers have not come."""
    publishers = router.routes.publishers
    for number, next_sequence in held.items():
        publisher = publishers.get(broker << 32 | number)
        if publisher is None or not (publisher.peer.mesh and publisher.opened):
            continue
        if publisher.next_sequence < next_sequence:
            return True
    return False

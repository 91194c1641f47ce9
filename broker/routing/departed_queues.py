"""Publisher queues without a publisher or without a reader, and the counts of all queues so far.

Messages that a publisher sent before it left are still delivered, so its queues stay until they are empty.
Then they are removed, and their counts are kept.
"""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING, Final, NamedTuple

from broker.routing.records import Tally

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from broker.routing.records import Peer, TopicRecord
    from proto.queues.publisher_queue import PublisherQueue

FORGET_QUEUES: Final = 100
"""Departed queues that are kept before the empty ones are forgotten; the periodic check forgets them, too."""

MAX_EARLIER_IDS: Final = 100
"""Earlier ids of a publisher that are remembered while its queue never gets empty: the latest."""


class PeerQueue(NamedTuple):
    """A publisher queue, the topic that it counts for, the peer that reads it, and its publisher's peer.

    `earlier_ids` are ids that its publisher had before it came back; their DETACHED may still be in it.
    """

    queue: PublisherQueue
    topic: TopicRecord
    peer: int
    source: Peer
    earlier_ids: tuple[int, ...] = ()


class DepartedQueues:
    """The queues of one graph that get no batches any more.

    Args:
        max_per_peer: Queues with messages for one peer; beyond it the oldest loses its messages.

    Attributes:
        overflows: Queues whose messages were dropped because one peer had too many queues.
    """

    def __init__(self, max_per_peer: int) -> None:
        self._max_per_peer = max_per_peer
        self._resumable: dict[int, dict[tuple[bytes, str], PeerQueue]] = {}
        """By peer, and publisher gid and topic: queues whose publisher is gone."""
        self._final: dict[int, list[PeerQueue]] = {}
        """By peer: queues that no publisher will resume."""
        self._count = 0
        self._forget_at = FORGET_QUEUES
        self._forgotten = Tally()
        self.overflows = 0

    def add(self, gid: bytes, publisher: int, peer_queue: PeerQueue) -> PublisherQueue | None:
        """Add a queue whose publisher, of this gid and id, is gone; its content is still delivered.

        Returns:
            The oldest queue of the same peer if there are too many, for the caller to empty.
        """
        peer = peer_queue.peer
        queues = self._resumable.setdefault(peer, {})
        key = gid, peer_queue.topic.name
        if earlier := queues.pop(key, None):  # the new one is the latest, too
            self._final.setdefault(peer, []).append(earlier)
        ids = (*(each for each in peer_queue.earlier_ids if each != publisher), publisher)
        queues[key] = peer_queue._replace(earlier_ids=ids[-MAX_EARLIER_IDS:])
        self._count += 1
        if len(queues) <= self._max_per_peer:
            return None
        self.overflows += 1
        oldest = queues.pop(next(iter(queues)))
        self._final.setdefault(peer, []).append(oldest)
        return oldest.queue

    def forget(self, peer_queue: PeerQueue) -> None:
        """Keep only the counts of a queue that is empty and gets nothing any more."""
        self._forgotten.add(peer_queue.queue)
        peer_queue.topic.forgotten.add(peer_queue.queue)

    def add_unwanted(self, peer_queue: PeerQueue) -> None:
        """Add a queue whose reader is gone; the caller discards its content."""
        self._final.setdefault(peer_queue.peer, []).append(peer_queue)
        self._count += 1

    def latest(self, peer: int, gid: bytes, topic: str) -> PublisherQueue | None:
        """Return the queue that a publisher left last, or None if it is forgotten.

        It may be empty: a delivery to it may be under way.
        """
        peer_queue = self._resumable.get(peer, {}).get((gid, topic))
        return None if peer_queue is None else peer_queue.queue

    def resume(self, peer: int, gid: bytes, topic: str) -> PeerQueue | None:
        """Remove and return the queue that a returning publisher left; None if it is empty."""
        queue = self.latest(peer, gid, topic)
        if queue is None or queue.empty:
            return None
        self._count -= 1
        return self._resumable[peer].pop((gid, topic))

    def remove_peer(self, peer: int) -> list[PublisherQueue]:
        """Return the queues to a peer that is gone, for the caller to discard.

        Also the empty ones: the removal of the peer's own publishers may still add frames to them.
        """
        peer_queues = [*self._final.pop(peer, ()), *self._resumable.pop(peer, {}).values()]
        if peer_queues:
            self._final[peer] = peer_queues
        return [peer_queue.queue for peer_queue in peer_queues]

    def prune(self, *, at_least: int | None = None) -> None:
        """Forget the empty queues if there are many. Not while a delivery to one may be under way.

        Args:
            at_least: Forget them if there are more departed queues than this; None: than twice the number
                that the last call kept.
        """
        if self._count > (self._forget_at if at_least is None else at_least):
            self._forget_empty()

    def _forget_empty(self) -> None:
        for peer, queues in tuple(self._resumable.items()):
            self._resumable[peer] = {
                key: each for key, each in queues.items() if not self._drop_if_empty(each)
            }
        for peer, peer_queues in tuple(self._final.items()):
            self._final[peer] = [each for each in peer_queues if not self._drop_if_empty(each)]
        self._resumable = {peer: queues for peer, queues in self._resumable.items() if queues}
        self._final = {peer: queues for peer, queues in self._final.items() if queues}
        self._count = sum(map(len, self._resumable.values())) + sum(map(len, self._final.values()))
        # Twice what has stayed: checking too often would cost the square of it.
        self._forget_at = max(FORGET_QUEUES, 2 * self._count)

    def _drop_if_empty(self, peer_queue: PeerQueue) -> bool:
        if not peer_queue.queue.empty:
            return False
        self.forget(peer_queue)
        return True

    def all(self) -> Iterator[PeerQueue]:
        """Return every departed queue."""
        return chain(*(queues.values() for queues in self._resumable.values()), *self._final.values())

    def tallies(self, in_use: Iterable[PeerQueue]) -> tuple[Tally, dict[TopicRecord, Tally]]:
        """Return what has become of all copies, in all and by topic for the topics that have queues.

        Args:
            in_use: All queues that have not departed.
        """
        total = self._forgotten.copy()
        topics: dict[TopicRecord, Tally] = {}
        for queue, topic, *_ in chain(in_use, self.all()):
            tally = topics.get(topic)
            if tally is None:
                tally = topics[topic] = topic.forgotten.copy()
            tally.add(queue)
            total.add(queue)
        return total, topics

"""Lanes that have lost their publisher or their reader, and what has become of everything put into lanes.

What a publisher has sent before it went still goes out; so its lanes live on until they are empty. Then they
are forgotten, and their numbers stay.
"""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING, Final, NamedTuple

from broker.records import Tally

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from broker.records import TopicRecord
    from proto.publisher_queue import PublisherQueue

FORGET_QUEUES: Final = 1000
"""Lanes without a publisher or a reader, before those that are empty are forgotten."""


MAX_LIVES: Final = 100
"""Earlier lives of a publisher that are remembered while its lane never gets empty: the latest."""


class PeerQueue(NamedTuple):
    """A lane, the topic that it counts for, and the peer that it leads to.

    `lives` are the ids under which its publisher has gone and come back: their DETACHED may still be in it.
    """

    queue: PublisherQueue
    topic: TopicRecord
    peer: int
    lives: tuple[int, ...] = ()


class DepartedQueues:
    """The lanes of one graph that no run is put into any more."""

    def __init__(self) -> None:
        self._left: dict[int, dict[tuple[bytes, str], PeerQueue]] = {}
        """By peer, and publisher gid and topic, what publishers that have gone have left to be sent."""
        self._retired: dict[int, list[PeerQueue]] = {}
        """By peer, lanes that nobody will go on with."""
        self._count = 0
        self._settle_at = FORGET_QUEUES
        self._settled = Tally()

    def leave(self, gid: bytes, publisher: int, peer_queue: PeerQueue) -> None:
        """A publisher, of this gid and id, has gone; what is in its lane is still wanted."""
        peer = peer_queue.peer
        queues = self._left.setdefault(peer, {})
        key = gid, peer_queue.topic.name
        if key in queues:
            self._retired.setdefault(peer, []).append(queues[key])
        lives = (*(life for life in peer_queue.lives if life != publisher), publisher)
        queues[key] = peer_queue._replace(lives=lives[-MAX_LIVES:])
        self._count += 1

    def retire(self, peer: int, queue: PublisherQueue, topic: TopicRecord) -> None:
        """Nobody wants what is in a lane any more; the caller has it discarded."""
        self._retired.setdefault(peer, []).append(PeerQueue(queue, topic, peer))
        self._count += 1

    def last(self, peer: int, gid: bytes, topic: str) -> PublisherQueue | None:
        """Return the lane of a publisher's latest life that is over; None if it is empty and forgotten.

        An empty one, too: what is being said to the peer in it may not have been put there yet.
        """
        peer_queue = self._left.get(peer, {}).get((gid, topic))
        return None if peer_queue is None else peer_queue.queue

    def take_back(self, peer: int, gid: bytes, topic: str) -> PeerQueue | None:
        """Return a lane with something in it for its publisher to go on with: it is not departed any more."""
        queue = self.last(peer, gid, topic)
        if queue is None or queue.empty:
            return None
        self._count -= 1
        return self._left[peer].pop((gid, topic))

    def forget(self, peer: int) -> list[PublisherQueue]:
        """Nothing can be sent to a peer any more; return its lanes, for the caller to have them discarded.

        The empty ones, too: what the peer's own publishers have told it as they went may not be in them yet.
        """
        peer_queues = [*self._retired.pop(peer, ()), *self._left.pop(peer, {}).values()]
        if peer_queues:
            self._retired[peer] = peer_queues
        return [peer_queue.queue for peer_queue in peer_queues]

    def settle_some(self) -> None:
        """Forget what is empty, now and then. Not while something for such a lane is being delivered."""
        if self._count > self._settle_at:
            self._settle()

    def _settle(self) -> None:
        for peer, queues in tuple(self._left.items()):
            kept = {key: peer_queue for key, peer_queue in queues.items() if not self._is_over(peer_queue)}
            if kept:
                self._left[peer] = kept
            else:
                del self._left[peer]
        for peer, peer_queues in tuple(self._retired.items()):
            left = [peer_queue for peer_queue in peer_queues if not self._is_over(peer_queue)]
            if left:
                self._retired[peer] = left
            else:
                del self._retired[peer]
        self._count = sum(map(len, self._left.values())) + sum(map(len, self._retired.values()))
        # Twice what has stayed: asking too often would cost the square of it.
        self._settle_at = max(FORGET_QUEUES, 2 * self._count)

    def _is_over(self, peer_queue: PeerQueue) -> bool:
        if not peer_queue.queue.empty:
            return False
        self._settled.add(peer_queue.queue)
        peer_queue.topic.settled.add(peer_queue.queue)
        return True

    def all(self) -> Iterator[PeerQueue]:
        """Return every lane, and what it belongs to."""
        return chain(*(queues.values() for queues in self._left.values()), *self._retired.values())

    def tallies(self, in_use: Iterable[PeerQueue]) -> tuple[Tally, dict[TopicRecord, Tally]]:
        """Return what has become of all copies, and the same by topic, for topics that have lanes.

        Args:
            in_use: All lanes that are not here.
        """
        total = self._settled.copy()
        topics: dict[TopicRecord, Tally] = {}
        for queue, topic, *_ in chain(in_use, self.all()):
            tally = topics.get(topic)
            if tally is None:
                tally = topics[topic] = topic.settled.copy()
            tally.add(queue)
            total.add(queue)
        return total, topics

"""Queues of destroyed publishers: the node does not end before they are empty."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from actors.logging.logger import Logger
    from actors.session.link import Link
    from proto.queues.publisher_queue import PublisherQueue

DEPARTING_SLACK: Final = 64
"""Queues to keep before all of them are checked for empty ones."""


class DepartingQueues:
    """The queues of the destroyed publishers of one node.

    Args:
        link: The node's link.
        log: The node's logger.
    """

    def __init__(self, link: Link, log: Logger) -> None:
        self._link = link
        self._log = log
        self._queues: list[PublisherQueue] = []
        self._standard: frozenset[PublisherQueue] = frozenset()
        """Those of publishers that every node has: no warning speaks of them, and no broker is waited for."""
        self._most = DEPARTING_SLACK

    def __len__(self) -> int:
        """Return how many are kept; some of them may have become empty."""
        return len(self._queues)

    @property
    def empty(self) -> bool:
        """Whether nothing in them is worth waiting for."""
        connected = self._link.connected
        return all(queue.empty or (queue in self._standard and not connected) for queue in self._queues)

    def __iter__(self) -> Iterator[PublisherQueue]:
        """Iterate over them, the oldest first."""
        return iter(self._queues)

    def add(self, queue: PublisherQueue, *, standard: bool = False) -> None:
        """Add a destroyed publisher's queue, and remove those that have become empty."""
        while self._queues and self._queues[0].empty:
            self._forget(self._queues.pop(0))
        if len(self._queues) >= self._most:
            queues, self._queues = self._queues, []
            for known in queues:
                if known.empty:
                    self._forget(known)
                else:
                    self._queues.append(known)
            self._most = DEPARTING_SLACK + 2 * len(self._queues)
        self._queues.append(queue)
        if standard:
            self._standard |= {queue}

    def _forget(self, queue: PublisherQueue) -> None:
        self._standard -= {queue}
        self._link.publishers.pop(queue.publisher, None)  # it needs no more credit

    def session_ended(self) -> None:
        """Discard the queues of publishers that the broker had accepted, and report their messages.

        A destroyed publisher that the broker had not accepted yet is declared again and sends then.
        """
        self.report_unsent(queue for queue in self._queues if queue.publisher)
        self._queues = [queue for queue in self._queues if not queue.publisher]
        self._standard &= frozenset(self._queues)

    def report_unsent(self, queues: Iterable[PublisherQueue] | None = None) -> None:
        """Warn of messages that were never sent, those dropped beyond the depth included."""
        unsent = standard = 0
        for queue in self._queues if queues is None else queues:
            if not queue.empty:
                unsent += queue.unsent
                standard += queue.unsent if queue in self._standard else 0
        why = (
            "no time was left" if self._link.connected else f"no link to a broker at {self._link.broker_urls}"
        )
        if unsent > standard:
            self._log.warning(f"{unsent - standard} published messages were never sent: {why}")
        if standard:
            self._log.debug(f"{standard} log lines and parameter events were never sent: {why}")

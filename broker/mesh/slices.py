"""Long work for other brokers, in slices: a broker with many endpoints must not hold the event loop."""

from __future__ import annotations

from collections import deque
from itertools import islice
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterator

SLICE: Final = 500
"""Steps, such as declarations, at once: about 5 ms. Most brokers need no more, and so no later loop turn."""


class SlicedWork:
    """What is to be done for other brokers: in order for each of them, and in turn between them."""

    def __init__(self) -> None:
        self._queues: dict[int, deque[Iterator[None]]] = {}

    @property
    def pending(self) -> bool:
        """Whether `go_on` has something to do."""
        return bool(self._queues)

    def start(self, broker: int, work: Iterator[None]) -> None:
        """Begin work at once, or after the earlier work for a broker, if that is pending.

        Args:
            broker: The broker.
            work: Makes one step at a time.
        """
        queue = self._queues.get(broker)
        if queue is None:
            self._queues[broker] = deque([work])
            self._run(broker, SLICE)
        else:
            queue.append(work)

    def go_on(self, steps: int) -> None:
        """Make some steps for the broker whose turn it is."""
        broker = next(iter(self._queues), None)
        if broker is not None:
            self._run(broker, steps)
            if broker in self._queues:
                self._queues[broker] = self._queues.pop(broker)

    def _run(self, broker: int, steps: int) -> None:
        queue = self._queues[broker]
        while queue and steps > 0:
            made = sum(1 for _ in islice(queue[0], steps))
            if made < steps:
                queue.popleft()
            steps -= made
        if not queue:
            del self._queues[broker]

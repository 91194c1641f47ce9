"""Iterates over the messages of a subscription that has no callback."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Generic, TypeVar

from actors.endpoints.iteration import Iteration

if TYPE_CHECKING:
    from actors.endpoints.subscription.consumer import Consumer

M = TypeVar("M")
_NEVER = math.inf


class Messages(Iteration[M], Generic[M]):
    """Messages as they arrive, until the consumer is closed.

    Args:
        consumer: The subscription's; other threads may read from it at the same time.

    Raises:
        TypeError: The subscription has a callback.
    """

    def __init__(self, consumer: Consumer) -> None:
        super().__init__()
        self._consumer = consumer
        self._backlog = consumer.require_no_callback("iterate")

    async def __anext__(self) -> M:
        """Return the oldest queued message, or wait for one."""
        consumer, backlog = self._consumer, self._backlog
        batches, lock = backlog.batches, backlog.lock
        while not (self.closed or consumer.closed):
            lock.acquire()  # `with` costs twice as much
            try:
                if batches and (batches[0].expires_at == _NEVER or consumer.next_is_fresh()):
                    consumer.calls += 1
                    queued_batch = batches[0]  # as in `Backlog.pop`, without the call
                    message: M = queued_batch.messages[queued_batch.index]
                    queued_batch.index += 1
                    backlog.pending -= 1
                    if queued_batch.index == len(queued_batch.messages):
                        backlog.finish()
                    # Nothing is awaited after this: a message that has been taken is never lost.
                    return message
            finally:
                lock.release()
            await consumer.wait()
        raise StopAsyncIteration

    def _wake(self) -> None:
        self._consumer.wake_waiter()

"""The topics whose messages a broker wants of others."""

from __future__ import annotations

from typing import TYPE_CHECKING

from broker.mesh.messages import Subscribe

if TYPE_CHECKING:
    from collections.abc import Callable

    from broker.routing.router import Router


class WantedTopics:
    """The topics to which this broker's nodes subscribe in one graph.

    Whether there are publishers elsewhere makes no difference: a publisher that is told of a subscription may
    send at once.

    Args:
        router: The graph's router.
        emit: Takes what to subscribe to.
    """

    def __init__(self, router: Router, emit: Callable[[Subscribe], None]) -> None:
        self._router = router
        self._emit = emit
        self._touched: set[str] = set()
        self._wanted: set[str] = set()

    def touch(self, topic: str) -> None:
        """Note that a subscription to a topic has come or gone."""
        self._touched.add(topic)

    def update(self) -> None:
        """Subscribe and unsubscribe as the noted topics need it."""
        for topic in self._touched:
            record = self._router.topics.by_name.get(topic)
            subscriptions = () if record is None else record.subscriptions.values()
            wanted = not all(each.peer.mesh or each.private for each in subscriptions)
            if wanted != (topic in self._wanted):
                (self._wanted.add if wanted else self._wanted.discard)(topic)
                self._emit(Subscribe(topic, wanted=wanted))
        self._touched.clear()

"""Whether the broker accepts a subscription. Without that, readers wait for messages that never come."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

from actors.web.probes import broker_answers
from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.endpoints.subscription.subscription import Subscription
    from actors.node.node import Node


class SubscriptionRefusedError(CallboardError):
    """The broker refuses the subscription; the text says why."""


class SubscriptionAnswer:
    """The broker's answer to a subscription that has just been made.

    Args:
        node: Has the subscription.
        subscription: Returns the subscription, which may be replaced by another one of the topic.
        wake: Called if it is refused.
    """

    def __init__(
        self, node: Node, subscription: Callable[[], Subscription[Any]], wake: Callable[[], None]
    ) -> None:
        self._node, self._subscription, self._wake = node, subscription, wake
        self._task = asyncio.get_running_loop().create_task(self._wait())

    async def _wait(self) -> None:
        await broker_answers(self._node)  # in order: it has answered the subscription before
        if self._subscription().refusal:
            self._wake()

    async def accepted(self) -> None:
        """Wait until the broker has answered, or cannot be reached.

        Raises:
            SubscriptionRefusedError: It refuses the subscription.
        """
        await asyncio.shield(self._task)
        self.require_accepted()

    def require_accepted(self) -> None:
        """Raise SubscriptionRefusedError if the broker is known to refuse the subscription."""
        if refusal := self._subscription().refusal:
            raise SubscriptionRefusedError(refusal)

    def close(self) -> None:
        """Wait no more."""
        self._task.cancel()

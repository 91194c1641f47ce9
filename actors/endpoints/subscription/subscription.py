"""The subscription as users hold it."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from actors.endpoints.endpoint import Handle
from actors.endpoints.subscription.endpoint import SubscriptionEndpoint
from actors.endpoints.subscription.messages import Messages

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.endpoints.context import NodeContext
    from actors.endpoints.events import SubscriptionEventCallbacks
    from actors.endpoints.iteration import Iteration
    from actors.endpoints.subscription.backlog import MessageInfo
    from actors.interfaces.message import Message
    from actors.qos.profile import QoSProfile

M = TypeVar("M")


class Subscription(Handle[SubscriptionEndpoint], Generic[M]):
    """Receives the messages of one topic. Made by `Node.create_subscription`.

    With a callback, messages go there. Without one, iterate: `async for msg in subscription`, or `take` them.

    Attributes:
        msg_type: The message class; None if the subscription takes every type as bytes.
        topic_name: The full name of the topic.
        qos_profile: Its QoS.
    """

    def __init__(
        self,
        context: NodeContext,
        msg_type: type[Message] | None,
        topic: str,
        callback: Callable[..., Any] | None,
        qos: QoSProfile,
        *,
        concurrent: bool,
        raw: bool,
        event_callbacks: SubscriptionEventCallbacks | None = None,
        stall_timeout_sec: float = 0.0,
        strict_qos: bool | None = None,
    ) -> None:
        super().__init__(
            SubscriptionEndpoint(
                context,
                msg_type,
                topic,
                callback,
                qos,
                concurrent=concurrent,
                raw=raw,
                event_callbacks=event_callbacks,
                stall_timeout_sec=stall_timeout_sec,
                strict_qos=strict_qos,
            )
        )
        self.msg_type = msg_type
        self.topic_name = topic
        self.qos_profile = qos

    @property
    def topic(self) -> str:
        """The full name of the topic."""
        return self.topic_name

    @property
    def received(self) -> int:
        """Messages handed to the callback, the iterator or `take`."""
        return self._endpoint.consumer.calls

    @property
    def refusal(self) -> str:
        """Why the broker of this session refuses the subscription; "" if it does not."""
        return self._endpoint.refusal

    @property
    def dropped(self) -> int:
        """Messages dropped here because the reader was slower than the depth allows."""
        return self._endpoint.consumer.dropped

    @property
    def expired(self) -> int:
        """Messages not handed over because they were older than their publisher's lifespan."""
        return self._endpoint.consumer.expired

    @property
    def lost(self) -> int:
        """Messages that never came over an unbroken link: dropped by the broker or the publisher."""
        return self._endpoint.tracker.lost

    @property
    def lost_on_break(self) -> int:
        """Messages that never came because a link broke."""
        return self._endpoint.tracker.lost_on_break

    @property
    def undecodable(self) -> int:
        """Messages dropped because they were not valid, or left out too much (docs/protocol.md §10.1)."""
        return self._endpoint.undecodable

    @property
    def queued(self) -> int:
        """Messages that have been received and wait for the callback, the iterator or `take`."""
        return self._endpoint.consumer.backlog.pending

    def get_publisher_count(self) -> int:
        """Return how many publishers are matched now.

        Returns:
            The number of matched publishers; 0 without a broker.
        """
        return self._endpoint.peers

    def __aiter__(self) -> Iteration[M]:
        """Iterate over messages as they arrive; ends when the subscription or its node is destroyed.

        Returns:
            An iterator with `aclose`. One task at a time may use it. A step that is cancelled takes no
            message, and the next step goes on.

        Raises:
            NodeDestroyed: The subscription or its node has been destroyed before.
            TypeError: The subscription has a callback.
            RuntimeError: Another task is iterating, or the node does not run (at a step that waits).
        """
        self._endpoint.require_alive()
        return Messages(self._endpoint.consumer)

    def take(self) -> tuple[M, MessageInfo] | None:
        """Return the oldest message that waits, and remove it. Never blocks; any thread may call it.

        At most as many messages wait as the profile's depth; older ones are dropped and counted. With
        KEEP_ALL, none is dropped: publishers get credit for what has been taken.

        Returns:
            The message and its info; None if no message waits.

        Raises:
            TypeError: The subscription has a callback.
            NodeDestroyed: The subscription or the node has been destroyed.
        """
        self._endpoint.require_alive()
        return self._endpoint.consumer.take()

    def set_on_ready(self, callback: Callable[[], object] | None) -> None:
        """Set a function that is called when messages have arrived, once for all that came together.

        It runs in the loop's thread and must not block: it calls `take` until that returns None, or wakes
        another thread that does. If messages wait already, it is called soon. Call this in the loop's thread.

        Args:
            callback: A plain function without arguments; None for no further calls.

        Raises:
            TypeError: The subscription has a callback, or this is a coroutine function.
        """
        if inspect.iscoroutinefunction(callback):
            raise TypeError("on_ready is a plain function: it runs between two turns of the loop")
        self._endpoint.consumer.set_on_ready(callback)

    def destroy(self) -> None:
        """Take the subscription out of service; messages that wait are discarded."""
        self._endpoint.destroy()

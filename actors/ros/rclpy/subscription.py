"""Subscriptions: messages wait at the node, until the thread that spins reads them."""

from __future__ import annotations

import inspect
from contextlib import suppress
from enum import Enum
from functools import partial
from typing import TYPE_CHECKING, Any, Final, Generic, TypedDict, TypeVar

from actors.endpoints.endpoint import endpoint_of
from actors.endpoints.subscription.selection import select
from actors.errors import NodeDestroyed
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.message import Message
from actors.logging.logger import get_logger
from actors.ros.rclpy._rclpy_pybind11 import RCLError as RCLError
from actors.ros.rclpy.entity import Entity, destroy_with, weakly
from actors.ros.rclpy.serialization import serialize_message
from actors.ros.rclpy.thread_node import settle
from actors.ros.values import prepare, rosidl_values
from actors.ros.rclpy.imported_names import imported_names

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.endpoints.subscription.backlog import MessageInfo as NativeInfo
    from actors.endpoints.subscription.subscription import Subscription as NativeSubscription
    from actors.ros.rclpy.callback_groups import CallbackGroup
    from actors.ros.rclpy.content_filter import ContentFilter
    from actors.ros.rclpy.event_handler import EventCalls
    from actors.ros.rclpy.qos import QoSProfile
    from actors.ros.rclpy.subscription_content_filter_options import ContentFilterOptions
    from actors.threads.node_thread import NodeThread

MsgT = TypeVar("MsgT", bound=Message)

_DROPPED_LOG_SEC: Final = 5.0
"""Time between lines about dropped messages of a raw subscription."""

__getattr__ = imported_names(__name__, "CallbackGroup MsgType QoSProfile SubscriptionEventCallbacks")


class MessageInfo(TypedDict):
    """The times at which a message was sent and received, in ns since 1970, its numbers and its publisher."""

    source_timestamp: int
    received_timestamp: int
    publication_sequence_number: int | None
    reception_sequence_number: int | None
    publisher_gid: dict[str, Any] | None


class Subscription(Entity, Generic[MsgT]):
    """Receives the messages of a topic. Made by `Node.create_subscription`.

    Attributes:
        msg_type: The message class.
        topic: The name it was made with, remapped and expanded.
        qos_profile: Its QoS.
        event_handlers: Entities with the calls of its event callbacks.
        raw: Whether the callback gets messages as bytes.
        content_filter: What is set already; None to receive all messages.
    """

    class CallbackType(Enum):
        """The arguments of a callback."""

        MessageOnly = 0
        WithMessageInfo = 1

    def __init__(
        self,
        thread: NodeThread,
        native: NativeSubscription[Any],
        callback: Callable[..., Any],
        callback_group: CallbackGroup,
        qos_profile: QoSProfile,
        event_handlers: list[EventCalls],
        *,
        raw: bool,
        content_filter: ContentFilter | None = None,
    ) -> None:
        super().__init__(callback_group)
        self.msg_type: type[MsgT] = native.msg_type  # type: ignore[assignment]  # the same class
        self.topic = native.topic_name
        self.qos_profile = qos_profile
        self.event_handlers = event_handlers
        self.raw = raw
        self.content_filter = content_filter
        self.callback = callback
        prepare(native.msg_type)
        self._converted: Callable[[Any], Any] = self._bytes_of if raw else rosidl_values
        self._thread = thread
        self._native = native
        destroy_with(self, thread, native.destroy)
        # Last: from here on messages arrive, and the executor may look at this object.
        thread.call(lambda: native.set_on_ready(weakly(self.notify)))

    @property
    def callback(self) -> Callable[..., Any]:
        """The callback: `(msg)` or `(msg, info)`."""
        return self._callback

    @callback.setter
    def callback(self, value: Callable[..., Any]) -> None:
        # As rclpy does, with one argument first: a second parameter with a default is the program's own.
        for kind, arguments in _ARGUMENTS.items():
            with suppress(TypeError):
                inspect.signature(value).bind(*arguments)
                self._callback_type, self._callback = kind, value
                return
        raise RuntimeError(
            "The callback of a subscription must be callable with one argument (the message) or two"
            " (the message and its MessageInfo)"
        )

    @property
    def topic_name(self) -> str:
        """The full name of the topic."""
        with self.handle:
            return self.topic

    def get_publisher_count(self) -> int:
        """Return how many publishers are matched."""
        with self.handle:
            settle(self._thread)
            return self._native.get_publisher_count()

    @property
    def is_cft_enabled(self) -> bool:
        """Whether messages are filtered by their content."""
        with self.handle:
            return self.content_filter is not None

    def set_content_filter(self, filter_expression: str, expression_parameters: list[str]) -> None:
        """Filter the messages that arrive from now on by their content.

        Args:
            filter_expression: The expression; "" for all messages again.
            expression_parameters: The values of `%0`, `%1`, ... in it.

        Raises:
            RCLError: The expression or a parameter is wrong, or there is no filter that "" could end.
        """
        from actors.ros.rclpy.content_filter import ContentFilter  # noqa: PLC0415 - few programs filter

        with self.handle:
            if not filter_expression and self.content_filter is None:
                raise RCLError(f"The subscription of {self.topic} has no content filter to end")
            wanted = ContentFilter(filter_expression, expression_parameters, self.msg_type)
            self.content_filter = wanted if filter_expression else None
            wants = wanted.passes if filter_expression else None
            self._thread.call(lambda: select(self._native, wants))

    def get_content_filter(self) -> ContentFilterOptions:
        """Return the content filter.

        Raises:
            RCLError: There is none.
        """
        with self.handle:
            if self.content_filter is None:
                raise RCLError(f"The subscription of {self.topic} has no content filter")
            return self.content_filter.options

    def has_work(self) -> bool:
        """Return whether a message waits."""
        return self._native.queued > 0

    def take(self) -> Callable[[], Any] | None:
        """Return a call of the callback with the next message."""
        try:
            # callboard's `take` may be called in any thread, so that no call into the loop is needed for
            # each message.
            taken = self._native.take()
        except NodeDestroyed:
            return None
        if taken is None:
            return None
        # Here and not in the loop: conversions cost the thread that wants the message.
        message = self._converted(taken[0])
        if message is None:
            return None
        if self._callback_type is Subscription.CallbackType.MessageOnly:
            return partial(self._callback, message)
        return partial(self._callback, message, _info(taken[1]))

    def _bytes_of(self, message: Message) -> bytes | None:
        """Return a message as bytes; None for one that cannot be written as such."""
        try:
            return serialize_message(message)
        except InvalidMessageError as error:
            # callboard's own strings may have a NUL in them.
            get_logger(self.node_logger_name).warning(
                f"A message of {self.topic} is dropped: {error}", throttle_duration_sec=_DROPPED_LOG_SEC
            )
            endpoint_of(self._native).consumer.reject()
            return None

    def destroy(self) -> None:
        """Take the subscription out of service."""
        super().destroy()
        self._thread.call(self._native.destroy)


_ARGUMENTS: Final = {
    Subscription.CallbackType.MessageOnly: (None,),
    Subscription.CallbackType.WithMessageInfo: (None, None),
}
"""The arguments of a callback, in the order in which they are tried."""


def _info(info: NativeInfo) -> MessageInfo:
    return {
        "source_timestamp": info.source_timestamp,
        "received_timestamp": info.received_timestamp,
        "publication_sequence_number": info.publication_sequence_number,
        "reception_sequence_number": None,
        "publisher_gid": {"implementation_identifier": "callboard", "data": info.publisher_gid},
    }

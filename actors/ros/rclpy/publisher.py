"""Publishers."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final, Generic, TypeVar

from actors.errors import PublisherFull, WaitTimeout
from actors.interfaces.message import Message
from actors.ros.rclpy.destroyable import Destroyable
from actors.ros.rclpy.exceptions import InvalidHandle
from actors.ros.rclpy.serialization import decode_message
from actors.ros.rclpy.thread_node import settle
from actors.ros.values import convert_assignments
from actors.threads.errors import ThreadStopped
from actors.ros.rclpy.imported_names import imported_names

if TYPE_CHECKING:
    from actors.endpoints.publisher.publisher import Publisher as NativePublisher
    from actors.ros.rclpy.context import Context
    from actors.ros.rclpy.duration import Duration
    from actors.ros.rclpy.event_handler import EventCalls
    from actors.ros.rclpy.qos import QoSProfile
    from actors.threads.node_thread import NodeThread

CROWDED_SEC: Final = 0.1
"""How long a message waits for slow KEEP_ALL readers before it takes what is left of the queue: as in ROS 2.
A program that is its own reader may fill the queue before it spins."""

MsgT = TypeVar("MsgT", bound=Message)

__getattr__ = imported_names(__name__, "CallbackGroup Duration MsgType PublisherEventCallbacks QoSProfile")


class Publisher(Destroyable, Generic[MsgT]):
    """Publishes on a topic from any thread. Made by `Node.create_publisher`.

    Attributes:
        msg_type: The message class.
        topic: The name it was made with, remapped and expanded.
        qos_profile: Its QoS.
        event_handlers: Entities with the calls of its event callbacks.
    """

    def __init__(
        self,
        context: Context,
        thread: NodeThread,
        native: NativePublisher[MsgT],
        qos_profile: QoSProfile,
        event_handlers: list[EventCalls],
    ) -> None:
        self.msg_type = native.msg_type
        self.topic = native.topic_name
        self.qos_profile = qos_profile
        self.event_handlers = event_handlers
        self._context = context
        self._thread = thread
        self._native = native
        # The only way into the loop that is cheap enough for each message.
        self._publisher = thread.publisher(native)
        convert_assignments(native.msg_type)

    @property
    def topic_name(self) -> str:
        """The full name of the topic."""
        with self.handle:
            return self.topic

    def publish(self, msg: MsgT | bytes) -> None:
        """Send a message; wait while KEEP_ALL readers have no space.

        Args:
            msg: The message, or one that is serialized already.

        Raises:
            InvalidMessageError: A field's value does not fit its type, or the bytes are no message.
            TypeError: It is not of the publisher's class.
            InvalidHandle: The publisher has been destroyed.
            ExternalShutdownException: The context has ended while it waited.
        """
        if isinstance(msg, bytes):
            msg = decode_message(msg, self.msg_type)
        if self._publisher.crowded:
            with suppress(WaitTimeout):
                self._wait_for_space(CROWDED_SEC)
        # Again after each wait: another thread may have used the space.
        while True:
            try:
                self._publisher.publish(msg)
            # `publish` blocks in rclpy; callboard's never does.
            except PublisherFull:
                self._wait_for_space()
            except ThreadStopped as error:
                raise InvalidHandle(str(error)) from error
            else:
                return

    def _wait_for_space(self, timeout_sec: float | None = None) -> None:
        try:
            self._context.wait_for(self._thread.submit(lambda: self._native.ready(timeout_sec)))
        except ThreadStopped as error:
            raise InvalidHandle(str(error)) from error

    def get_subscription_count(self) -> int:
        """Return how many subscriptions are matched."""
        with self.handle:
            settle(self._thread)
            return self._native.get_subscription_count()

    def assert_liveliness(self) -> None:
        """Show that the publisher is alive, if its liveliness is MANUAL_BY_TOPIC."""
        self._thread.call(self._native.assert_liveliness)

    def wait_for_all_acked(self, timeout: Duration | None = None) -> bool:
        """Wait until what was published has been sent; return False if the time was not enough."""
        seconds = None if timeout is None or timeout.nanoseconds < 0 else timeout.nanoseconds / 1e9
        try:
            self._thread.call(lambda: self._native.flush(seconds))
        except WaitTimeout:
            return False
        return True

    def destroy(self) -> None:
        """Take the publisher out of service, after what it has published has been sent."""
        super().destroy()
        self._thread.call(self._native.destroy)


AnyPublisher = Publisher[Any]

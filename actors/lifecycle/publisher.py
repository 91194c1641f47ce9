"""Publishers of a node with states."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

from actors.endpoints.publisher.publisher import Publisher
from actors.interfaces.message import Message

if TYPE_CHECKING:
    from typing_extensions import Buffer

    from actors.endpoints.context import NodeContext
    from actors.endpoints.events import PublisherEventCallbacks
    from actors.qos.profile import QoSProfile

T = TypeVar("T", bound=Message)


# An object that the node and its publishers share. The publishers need not know the node, nor be told.
class Activation:
    """Whether the lifecycle publishers of a node publish.

    Attributes:
        active: True while they do.
    """

    def __init__(self) -> None:
        self.active = False


class LifecyclePublisher(Publisher[T]):
    """A publisher that is silent while its node is not active.

    Made by `LifecycleNode.create_lifecycle_publisher`.

    Attributes:
        suppressed: Messages that were not published because the node was not active.
    """

    def __init__(
        self,
        context: NodeContext,
        msg_type: type[T],
        topic: str,
        qos: QoSProfile,
        event_callbacks: PublisherEventCallbacks | None = None,
        *,
        activation: Activation,
        strict_qos: bool | None = None,
    ) -> None:
        super().__init__(context, msg_type, topic, qos, event_callbacks, strict_qos=strict_qos)
        self.suppressed = 0
        self._activation = activation

    @property
    def is_activated(self) -> bool:
        """Whether `publish` sends messages now."""
        return self._activation.active

    def publish(self, msg: T | bytes) -> None:
        """Send a message as `Publisher.publish` does; while the node is not active, only count it.

        Args:
            msg: The message, or one that is already encoded.

        Raises:
            TypeError, InvalidMessageError, PublisherFull, NodeDestroyed: As `Publisher.publish`.
        """
        if self._activation.active:
            super().publish(msg)
        else:
            # Counted: nothing is lost in silence.
            self.suppressed += 1

    def publish_encoded(self, data: Buffer, source_timestamp_ns: int | None = None) -> None:
        """Send an encoded message as `Publisher.publish_encoded` does; while not active, only count it.

        Args:
            data: One message as msgpack.
            source_timestamp_ns: As for `Publisher.publish_encoded`.

        Raises:
            TypeError, ValueError, InvalidMessageError, PublisherFull, NodeDestroyed: As
                `Publisher.publish_encoded`.
        """
        if self._activation.active:
            super().publish_encoded(data, source_timestamp_ns=source_timestamp_ns)
        else:
            self.suppressed += 1

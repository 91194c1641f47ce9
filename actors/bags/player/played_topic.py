"""A topic that is played: how its messages are converted, and what has become of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from actors.interfaces.cdr import codec_for as cdr_codec_for
from actors.interfaces.codec import codec_for

if TYPE_CHECKING:
    from collections.abc import Callable

    from typing_extensions import Buffer

    from actors.bags.records import BagTopic
    from actors.endpoints.publisher.publisher import Publisher
    from actors.interfaces.message import Message


class PlayedTopic:
    """A topic that is played.

    Args:
        bag_topic: It, as the bag has it.

    Attributes:
        bag_topic: As given.
        msg_type: The class of its messages.
        publisher: Publishes them; None: they are not played.
        published: Messages that have been published.
        invalid: Messages that are none of the type. The reading thread's.
        problem: Why the newest of these is none.

    Raises:
        InterfaceSyntaxError, InvalidMessageError, UnknownInterfaceError: There is no class for its messages.
        TypeError: One of the class's fields has no type of ROS.
    """

    __slots__ = (
        "_decode",
        "_encode",
        "bag_topic",
        "invalid",
        "msg_type",
        "problem",
        "published",
        "publisher",
    )

    def __init__(self, bag_topic: BagTopic) -> None:
        self.bag_topic = bag_topic
        self.msg_type: type[Message] = bag_topic.message_class()
        self.publisher: Publisher[Any] | None = None
        self.published = 0
        self.invalid = 0
        self.problem = ""
        self._decode: Callable[[Buffer], Message] = cdr_codec_for(self.msg_type).decode
        self._encode: Callable[[Message], bytes] = codec_for(self.msg_type).encode_decoded

    @property
    def name(self) -> str:
        """Its name in the bag."""
        return self.bag_topic.name

    def to_msgpack(self, data: bytes) -> bytes:
        """Return a message as msgpack.

        Args:
            data: It as CDR.

        Raises:
            InvalidMessageError: It is not a message of this type, or would take too much memory.
        """
        return self._encode(self._decode(data))


class QueuedMessage(NamedTuple):
    """A message that waits until it is due."""

    topic: PlayedTopic
    data: bytes
    """As msgpack."""
    time_ns: int
    """The time of the bag when it is due."""
    publish_time_ns: int

"""A played topic: converts its messages, and counts them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from actors.interfaces.codec import codec_for

if TYPE_CHECKING:
    from collections.abc import Callable

    from typing_extensions import Buffer

    from actors.bags.contents.records import BagTopic
    from actors.endpoints.publisher.publisher import Publisher
    from actors.interfaces.message import Message


class PlayedTopic:
    """A played topic.

    Args:
        bag_topic: The topic in the bag.

    Attributes:
        bag_topic: As given.
        msg_type: The class of its messages.
        publisher: Publishes the messages; None if they are not published.
        published: Number of published messages.
        invalid: Number of messages that cannot be decoded; only the reading thread changes it.
        problem: Why the newest invalid message could not be converted; "" if there is none to report.

    Raises:
        InterfaceSyntaxError, InvalidMessageError, UnknownInterfaceError: There is no class for its messages.
        TypeError: A field of the class has no ROS type.
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
        self._decode: Callable[[Buffer], Message] = bag_topic.decoder()
        self._encode: Callable[[Message], bytes] = codec_for(self.msg_type).encode_decoded

    @property
    def name(self) -> str:
        """Its name in the bag."""
        return self.bag_topic.name

    @property
    def is_played(self) -> bool:
        """Whether its messages are read."""
        return self.publisher is not None

    def to_msgpack(self, data: bytes) -> bytes | None:
        """Convert a message to msgpack.

        Args:
            data: The message as CDR.

        Returns:
            The message; None if it is not played.

        Raises:
            InvalidMessageError: It is not a message of this type, or would need too much memory.
        """
        return self._encode(self._decode(data))


class DueMessage(NamedTuple):
    """A message to publish at a time of the bag."""

    topic: PlayedTopic
    data: bytes
    """The message as msgpack."""
    time_ns: int
    """The time of the bag at which it is due."""
    publish_time_ns: int
    split: tuple[str, str] | None = None
    """For the first message of a further file: the path of the file before, and of this one."""

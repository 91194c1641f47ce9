"""A topic that is recorded: how its messages are converted, and what has become of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.bags.recorder.losses import TopicCounts
from actors.bags.records import BagTopic
from actors.interfaces.cdr import codec_for as cdr_codec_for
from actors.interfaces.codec import codec_for
from actors.qos.profile import DurabilityPolicy

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from actors.interfaces.message import Message
    from actors.qos.profile import QoSProfile


class RecordedTopic:
    """A topic that is recorded.

    Args:
        name: Its full name.
        msg_type: The class of its messages.
        offers: What its publishers offer.

    Attributes:
        bag_topic: It, as the bag has it.
        counts: What has become of its messages. The writer's thread alone changes `written`, `unwritten` and
            `invalid`.
        is_latched: Whether a late subscription gets the newest messages: each file of the bag has them, too.
        number: Its number in the bag; set by the writer's thread.
        problem: Why the newest message that could not be written does not fit the type.

    Raises:
        TypeError: One of the class's fields has no type of ROS.
    """

    __slots__ = ("_decode", "_encode", "bag_topic", "counts", "is_latched", "number", "problem")

    def __init__(self, name: str, msg_type: type[Message], offers: Iterable[QoSProfile]) -> None:
        self.bag_topic = BagTopic.of_class(name, msg_type, offers)
        self.counts = TopicCounts()
        self.is_latched = any(
            each.durability is DurabilityPolicy.TRANSIENT_LOCAL for each in self.bag_topic.qos_profiles
        )
        self.number = -1
        self.problem = ""
        self._decode: Callable[[bytes], Message] = codec_for(msg_type).decode
        self._encode: Callable[[Message], bytes] = cdr_codec_for(msg_type).encode

    @property
    def name(self) -> str:
        """Its full name."""
        return self.bag_topic.name

    def to_cdr(self, data: bytes) -> bytes:
        """Return a message as CDR.

        Args:
            data: It as msgpack.

        Raises:
            InvalidMessageError: It is not a message of this type, would take too much memory, or has a value
                that ROS 2 cannot have.
        """
        return self._encode(self._decode(data))

"""A recorded topic: converts its messages, and counts them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.bags.contents.records import BagTopic
from actors.bags.recorder.losses import TopicCounts
from actors.interfaces.cdr import codec_for as cdr_codec_for
from actors.interfaces.codec import codec_for
from actors.qos.profile import DurabilityPolicy

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from actors.interfaces.message import Message
    from actors.qos.profile import QoSProfile


class RecordedTopic:
    """A recorded topic.

    Args:
        name: Its full name.
        msg_type: The class of its messages.
        offers: The QoS that its publishers offer.

    Attributes:
        bag_topic: The topic in the bag.
        counts: Counts of its messages. Only the writer thread changes `written`, `unwritten` and `invalid`.
        is_latched: Whether late subscriptions get the newest messages. Each file of the bag repeats these.
        number: Its number in the bag; set by the writer thread.
        problem: Why the newest invalid message could not be converted; "" if there is none to report.

    Raises:
        TypeError: A field of the class has no ROS type.
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
        """Convert a message to CDR.

        Args:
            data: The message as msgpack.

        Raises:
            InvalidMessageError: It is not a message of this type, would need too much memory, or has a value
                that CDR cannot represent.
        """
        return self._encode(self._decode(data))

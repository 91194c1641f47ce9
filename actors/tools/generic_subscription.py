"""Subscribe to a topic whose type and QoS are known from the graph only.

    snapshot = await node.get_graph()
    decode = decoder_of(snapshot, "/chatter")
    profile = profile_of(snapshot, "/chatter", depth=10)
    node.create_subscription(None, "/chatter", lambda data: print(decode(data)), profile, raw=True)

Messages are self-describing maps, so that they can be decoded without their class. If the topic has one type
and its class is installed, the class is used: it knows more, such as the length of an array.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actors.interfaces.codec import Codec, codec_for, decode_untyped
from actors.interfaces.errors import InvalidMessageError, MessageBudgetError
from actors.interfaces.message import Message, type_hash
from actors.interfaces.registry import installed_interface
from actors.qos.profile import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.graph.snapshot import GraphSnapshot


def decoder_of(snapshot: GraphSnapshot, topic: str) -> Callable[[bytes], Any]:
    """Return a function that decodes a topic's messages: into their class if installed, else into dicts.

    Args:
        snapshot: The graph.
        topic: The topic's full name.

    Returns:
        A function of a message's bytes. It raises InvalidMessageError for bytes that are no message, and
        MessageBudgetError for a message that leaves out too much.
    """
    types = {
        (entry.type_name, entry.type_hash)
        for entry in snapshot.of_kind(EntryKind.PUBLISHER, EntryKind.SUBSCRIPTION)
        if entry.name == topic and entry.type_name
    }
    if len(types) != 1:
        return decode_untyped
    name, digest = types.pop()
    found = installed_interface(name)
    if found is None or not issubclass(found, Message) or type_hash(found) != digest:
        return decode_untyped
    codec: Codec[Message] = codec_for(found)

    def decode(data: bytes) -> Any:
        try:
            return codec.decode(data)
        except MessageBudgetError:
            raise
        except InvalidMessageError:  # from a new publisher with another type
            return decode_untyped(data)

    return decode


def profile_of(snapshot: GraphSnapshot, topic: str, *, depth: int) -> QoSProfile:
    """Return a profile that receives everything that the topic's publishers offer.

    Args:
        snapshot: The graph.
        topic: The topic's full name.
        depth: The number of messages to keep.
    """
    offers = [info.qos_profile for info in snapshot.endpoints(EntryKind.PUBLISHER, topic)]
    latched = bool(offers) and all(each.durability is DurabilityPolicy.TRANSIENT_LOCAL for each in offers)
    best_effort = any(each.reliability is ReliabilityPolicy.BEST_EFFORT for each in offers)
    return QoSProfile(
        depth=depth,
        reliability=ReliabilityPolicy.BEST_EFFORT if best_effort else ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )

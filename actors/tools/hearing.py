"""How to hear a topic of which nothing is known but what the graph says.

    picture = await node.get_graph()
    decode = decoder_of(picture, "/chatter")
    profile = profile_of(picture, "/chatter", depth=10)
    node.create_subscription(None, "/chatter", lambda data: print(decode(data)), profile, raw=True)

Messages are maps that describe themselves, so a type need not be known here to be read. Where the topic has
one type and its class is at hand, it is used all the same: it knows more (how long an array is, say).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actors.interfaces.codec import Codec, codec_for, decode_untyped
from actors.interfaces.errors import InvalidMessageError, UnknownInterfaceError
from actors.interfaces.message import Message, type_hash
from actors.interfaces.registry import find_interface
from actors.qos.profile import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from proto.codes import EntryKind

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.graph.snapshot import GraphSnapshot


def decoder_of(snapshot: GraphSnapshot, topic: str) -> Callable[[bytes], Any]:
    """Return what reads messages of a topic: as its class where that is at hand, as dicts otherwise.

    The function raises InvalidMessageError for bytes that are no message.
    """
    types = {
        (entry.type_name, entry.type_hash)
        for entry in snapshot.of_kind(EntryKind.PUBLISHER, EntryKind.SUBSCRIPTION)
        if entry.name == topic and entry.type_name
    }
    if len(types) != 1:
        return decode_untyped
    name, digest = types.pop()
    try:
        found = find_interface(name)
    except UnknownInterfaceError:
        return decode_untyped
    if not issubclass(found, Message) or type_hash(found) != digest:
        return decode_untyped
    codec: Codec[Message] = codec_for(found)

    def decode(data: bytes) -> Any:
        try:
            return codec.decode(data)
        except InvalidMessageError:  # a publisher of another type has come
            return decode_untyped(data)

    return decode


def profile_of(snapshot: GraphSnapshot, topic: str, *, depth: int) -> QoSProfile:
    """Return a profile that gets all that the topic's publishers offer."""
    offers = [info.qos_profile for info in snapshot.endpoints(EntryKind.PUBLISHER, topic)]
    latched = bool(offers) and all(each.durability is DurabilityPolicy.TRANSIENT_LOCAL for each in offers)
    loose = any(each.reliability is ReliabilityPolicy.BEST_EFFORT for each in offers)
    return QoSProfile(
        depth=depth,
        reliability=ReliabilityPolicy.BEST_EFFORT if loose else ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )

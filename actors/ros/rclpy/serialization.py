"""Messages as bytes, as they travel: msgpack, not CDR."""

from __future__ import annotations

from typing import TypeVar

from actors.interfaces.codec import codec_for
from actors.interfaces.message import Message
from actors.ros.values import convert_assignments, rosidl_values

MsgT = TypeVar("MsgT", bound=Message)


def serialize_message(message: Message) -> bytes:
    """Return a message as bytes.

    Raises:
        InvalidMessageError: A field's value does not fit its type.
    """
    codec = codec_for(type(message))
    convert_assignments(type(message))
    return codec.encode(message)


def deserialize_message(serialized_message: bytes, message_type: type[MsgT]) -> MsgT:
    """Return the message of bytes.

    Args:
        serialized_message: The bytes.
        message_type: The message class.

    Raises:
        InvalidMessageError: They are no such message.
    """
    return rosidl_values(codec_for(message_type).decode(serialized_message))

"""Messages as bytes, as they travel: msgpack, not CDR.

All bytes that programs get or give pass `bytes_of` or `payload_of`: of these functions, of raw subscriptions
and of publishers.
"""

from __future__ import annotations

from typing import TypeVar

from actors.interfaces.codec import codec_for
from actors.interfaces.message import Message
from actors.ros.values import convert_assignments, rosidl_values

MsgT = TypeVar("MsgT", bound=Message)


def bytes_of(payload: bytes, message_type: type[Message]) -> bytes:
    """Return the bytes that programs get for a payload of callboard: the same."""
    del message_type
    return payload


def payload_of(data: bytes, message_type: type[Message]) -> bytes:
    """Return the payload of bytes that programs give: the same."""
    del message_type
    return data


def serialize_message(message: Message) -> bytes:
    """Return a message as bytes.

    Raises:
        InvalidMessageError: A field's value does not fit its type.
    """
    codec = codec_for(type(message))
    convert_assignments(type(message))
    return bytes_of(codec.encode(message), type(message))


def deserialize_message(serialized_message: bytes, message_type: type[MsgT]) -> MsgT:
    """Return the message of bytes.

    Args:
        serialized_message: The bytes.
        message_type: The message class.

    Raises:
        InvalidMessageError: They are no such message.
    """
    payload = payload_of(serialized_message, message_type)
    return rosidl_values(codec_for(message_type).decode(payload))

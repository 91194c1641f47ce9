"""Messages as bytes in CDR, as in ROS 2; between nodes they travel as msgpack."""

from __future__ import annotations

from typing import TypeVar

from actors.interfaces.message import Message
from actors.ros.values import convert_assignments, rosidl_values

MsgT = TypeVar("MsgT", bound=Message)


def serialize_message(message: Message) -> bytes:
    """Return a message as bytes.

    Raises:
        InvalidMessageError: A field's value does not fit its type, or a `string` has a NUL in it.
    """
    from actors.interfaces import cdr  # noqa: PLC0415 - most programs have no use for it

    codec = cdr.codec_for(type(message))
    convert_assignments(type(message))
    return codec.encode(message)


def decode_message(serialized_message: bytes, message_type: type[MsgT]) -> MsgT:
    """Return the message of bytes, with callboard's own values; see `deserialize_message`."""
    from actors.interfaces import cdr  # noqa: PLC0415 - see above

    return cdr.decode(message_type, serialized_message)


def deserialize_message(serialized_message: bytes, message_type: type[MsgT]) -> MsgT:
    """Return the message of bytes.

    Args:
        serialized_message: The bytes.
        message_type: The message class.

    Raises:
        InvalidMessageError: They are no such message.
    """
    return rosidl_values(decode_message(serialized_message, message_type))

"""Messages of topics as clients get them, each encoded once for all clients that want it in the same way."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from actors.interfaces.cdr.codec import encode as encode_cdr
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.message import Message
from actors.web.rosbridge.cbor import cbor_values, encode_cbor
from actors.web.rosbridge.frames import as_png, published
from actors.web.rosbridge.values import SMALL_BYTES, json_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.web.rosbridge.operations import Compression
    from actors.web.topic_feed import Received
    from actors.web.worker import WorkShare

NANOSECONDS: Final = 1_000_000_000


async def publish_frame(
    received: Received, decode: Callable[[bytes], Any], topic: str, compression: Compression, work: WorkShare
) -> bytes:
    """Return the operation `publish` with a message.

    Args:
        received: The message.
        decode: Decodes its bytes.
        topic: The topic as the client calls it.
        compression: How it is sent.
        work: Encodes a large message in a thread.

    Raises:
        InvalidMessageError: It cannot be decoded, or not sent in this way.
        TooMuchWorkError: See `WorkShare.run`.
    """
    frame = received.forms.get(("rosbridge", topic, compression))
    if frame is not None:
        return frame
    if len(received.data) <= SMALL_BYTES and compression != "png":
        return _frame(received, decode, topic, compression)
    return await work.run(_frame, received, decode, topic, compression)


def _frame(received: Received, decode: Callable[[bytes], Any], topic: str, compression: Compression) -> bytes:
    key = ("rosbridge", topic, compression)
    # Again: clients that want it at the same time wait for their turns in the thread.
    frame = received.forms.get(key)
    if frame is None:
        frame = received.forms[key] = _made(received, decode, topic, compression)
    return frame


def _made(received: Received, decode: Callable[[bytes], Any], topic: str, compression: Compression) -> bytes:
    message = decode(received.data)
    if compression == "cbor":
        return encode_cbor({"op": "publish", "topic": topic, "msg": cbor_values(message)})
    if compression == "cbor-raw":
        if not isinstance(message, Message):
            raise InvalidMessageError(
                "The type of the message is not installed here, so there is no CDR of it"
            )
        secs, nsecs = divmod(received.info.received_timestamp, NANOSECONDS)
        raw = {"secs": secs, "nsecs": nsecs, "bytes": encode_cdr(message)}
        return encode_cbor({"op": "publish", "topic": topic, "msg": raw})
    try:
        frame = published(topic, json_of(message, len(received.data)))
    except TypeError as error:
        raise InvalidMessageError(str(error)) from None
    return as_png(frame) if compression == "png" else frame

"""Messages to CDR and back.

The generated encoder only raises for what does not fit. The msgpack codec explains it: it takes the same
messages.
"""

from __future__ import annotations

import math
import struct
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any, Final, Generic, TypeVar, cast

from actors.interfaces import codec as msgpack
from actors.interfaces.cdr.decoder import SPARE_BYTES, decoder
from actors.interfaces.cdr.encoder import encoder
from actors.interfaces.cdr.layout import HEADER_BYTES
from actors.interfaces.cdr.source import check_names
from actors.interfaces.cdr.values import LengthError, UnusualError
from actors.interfaces.decode_budget import FACTOR
from actors.interfaces.errors import InvalidMessageError, MessageBudgetError
from actors.interfaces.fields import fields_of
from actors.interfaces.message import Message, type_name

if TYPE_CHECKING:
    from collections.abc import Callable

    from typing_extensions import Buffer

T = TypeVar("T", bound=Message)

BIG_ENDIAN: Final = b"\0\0"
LITTLE_ENDIAN: Final = b"\0\1"

_ENCODING_ERRORS: Final = (
    ValueError, TypeError, AttributeError, LookupError, OverflowError, struct.error, RecursionError,
    BufferError,
)  # fmt: skip
_DECODING_ERRORS: Final = (ValueError, LookupError, OverflowError, struct.error, RecursionError)


class CdrCodec(Generic[T]):
    """Encodes and decodes the messages of one type; get one with `codec_for`.

    Attributes:
        msg_type: The message class.
    """

    def __init__(self, msg_type: type[T]) -> None:
        self._msgpack = msgpack.codec_for(msg_type)
        self.msg_type = msg_type
        check_names(cast("Any", msg_type))

    # Made on first use: many types are only read or only written.
    @cached_property
    def _encode(self) -> Callable[[Any], bytes]:
        return encoder(cast("Any", self.msg_type))

    @cached_property
    def _decode(self) -> Callable[[bytes], T]:
        return decoder(cast("Any", self.msg_type), "<", is_careful=False)

    @cached_property
    def _decode_carefully(self) -> Callable[[bytes], T]:
        return decoder(cast("Any", self.msg_type), "<", is_careful=True)

    @cached_property
    def _decode_big_endian(self) -> Callable[[bytes], T]:
        return decoder(cast("Any", self.msg_type), ">", is_careful=True)

    def encode(self, message: T) -> bytes:
        """Return a message as CDR, little-endian, with its header.

        Args:
            message: An instance of `msg_type`.

        Raises:
            TypeError: `message` is not a `msg_type`.
            InvalidMessageError: A field's value does not fit its type. Nor does a `string` with a NUL in it,
                which ends it for ROS 2, or a `float32` that ROS 2 would make infinite.
        """
        encode = self._encode
        if isinstance(message, self.msg_type):
            try:
                return encode(message)
            except _ENCODING_ERRORS:
                pass
        # The message as msgpack is checked more thoroughly: it raises the error that says what is wrong, or
        # gives a message with plain values.
        plain = self._msgpack.decode(self._msgpack.encode(message))
        _check(plain, type_name(self.msg_type))
        try:
            return encode(plain)
        except _ENCODING_ERRORS as error:
            raise InvalidMessageError(f"{type_name(self.msg_type)}: {error}") from error

    def decode(self, data: Buffer) -> T:
        """Return the message in `data`.

        A `string` is read as in rclpy: bytes that are not UTF-8 become U+FFFD, and it ends at its first NUL.

        Args:
            data: One message as CDR with its header, in either byte order; more bytes may follow. `uint8[]`
                fields are views that keep it alive.

        Raises:
            InvalidMessageError: The message is shorter than its type and its lengths say, a length is not
                allowed, or it has another representation than plain CDR.
            MessageBudgetError: It would take far more memory than its bytes: it has very many elements that
                consist of a few bytes each.
            TypeError: `data` is no bytes.
        """
        if type(data) is not bytes:
            data = bytes(memoryview(data))
        try:
            return self._decode(data)
        except (UnusualError, UnicodeDecodeError, MessageBudgetError):
            pass
        except _DECODING_ERRORS as error:
            raise self._explained(data, error) from error
        # Not in the `except` block, whose error holds what has been made so far.
        return self._decode_other(data)

    def _decode_other(self, data: bytes) -> T:
        try:
            if data[:2] == LITTLE_ENDIAN:
                return self._decode_carefully(data)
            if data[:2] == BIG_ENDIAN:
                return self._decode_big_endian(data)
        except MessageBudgetError:
            name = type_name(self.msg_type)
            raise MessageBudgetError(
                f"{name}: its {len(data):,} bytes would take more than {FACTOR} times as much memory and"
                f" {SPARE_BYTES >> 20} MiB; it has too many small elements"
            ) from None
        except _DECODING_ERRORS as error:
            raise self._explained(data, error) from error
        raise self._other_representation(data)

    def _other_representation(self, data: bytes) -> InvalidMessageError:
        return InvalidMessageError(
            f"{type_name(self.msg_type)}: Expected plain CDR, whose first bytes are 00 01 or 00 00, got"
            f" {data[:2].hex(' ')}"
        )

    def _explained(self, data: bytes, error: Exception) -> InvalidMessageError:
        name = type_name(self.msg_type)
        if len(data) >= HEADER_BYTES and data[:2] not in {LITTLE_ENDIAN, BIG_ENDIAN}:
            return self._other_representation(data)
        if isinstance(error, LengthError):
            return InvalidMessageError(f"{name}.{error}")
        if isinstance(error, RecursionError):
            return InvalidMessageError(f"{name}: the message is nested too deeply")
        if isinstance(error, OverflowError | UnicodeDecodeError):
            return InvalidMessageError(f"{name}: a wstring is not UTF-16 ({error})")
        return InvalidMessageError(
            f"{name}: {len(data)} bytes are too few: a message of this type, with the lengths in it, has more"
        )


def _check(message: Message, path: str) -> None:
    """Raise InvalidMessageError for values that msgpack has and CDR has not."""
    for field in fields_of(cast("Any", type(message))):
        kind, name = field.type, field.name
        value: Any = getattr(message, name)
        if kind.message is not None:
            items: list[Any] = value if kind.is_array else [value]
            for index, item in enumerate(items):
                _check(item, f"{path}.{name}[{index}]" if kind.is_array else f"{path}.{name}")
        elif kind.base == "string":
            if any("\0" in each for each in (value if kind.is_array else (value,))):
                raise InvalidMessageError(f"{path}.{name}: Expected a string without NUL, got {value!r:.80}")
        elif kind.base == "float32" and not kind.is_array and math.isfinite(value):
            try:
                struct.pack("<f", value)
            except OverflowError:
                raise InvalidMessageError(f"{path}.{name}: Expected float32, got {value!r}") from None


@cache
def _codec(msg_type: type[Message]) -> CdrCodec[Message]:
    return CdrCodec(msg_type)


def codec_for(msg_type: type[T]) -> CdrCodec[T]:
    """Return the codec of a message class; it is made once.

    Args:
        msg_type: The message class; the parts of services and actions are message classes, too.

    Raises:
        TypeError: `msg_type` is not a message class, or one of its fields has no ROS type, or a keyword of
            Python as its name.
    """
    return cast("CdrCodec[T]", _codec(msg_type))


def encode(message: Message) -> bytes:
    """Return a message as CDR; see `CdrCodec.encode`."""
    return codec_for(type(message)).encode(message)


def decode(msg_type: type[T], data: Buffer) -> T:
    """Return the message of a class in `data`; see `CdrCodec.decode`."""
    return codec_for(msg_type).decode(data)

"""Messages to bytes and back: the hot path.

A message travels as a msgpack map of field name to value. msgspec checks nothing while it encodes, so a codec
decodes what it has just encoded with the typed decoder, and a wrong value raises at the line that sent it.
Large binary fields and arrays are not copied by this check.

Fields that a reader does not know are ignored; fields that a writer left out take their defaults.
"""

from __future__ import annotations

from functools import cache
from types import GenericAlias
from typing import TYPE_CHECKING, Any, Generic, TypeVar, cast

import msgspec

from actors.interfaces.arrays import ARRAY_BY_CODE, BIG_ENDIAN, NumericArray, pack
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.explain import explain_decoding, explain_encoding
from actors.interfaces.fields import SequenceWire, wired
from actors.interfaces.message import Message, is_message_type, type_name

if TYPE_CHECKING:
    from typing_extensions import Buffer

T = TypeVar("T", bound=Message)


def _encode_hook(value: object) -> object:
    """Encode what msgspec does not know: arrays, NumPy arrays and NumPy scalars."""
    if isinstance(value, NumericArray) and not BIG_ENDIAN:
        return msgspec.msgpack.Ext(value.code, memoryview(value))  # as `pack` would, without its questions
    # A NumPy scalar is a buffer, too, of no dimension.
    if hasattr(value, "dtype") and getattr(value, "ndim", None) == 0:
        return cast("Any", value).item()
    packed = pack(value)
    if isinstance(packed, tuple):
        return msgspec.msgpack.Ext(*packed)
    if packed is not None:
        return packed
    raise TypeError(f"Expected a field value, got {type(value).__name__}")


def _extension_hook(code: int, data: memoryview) -> object:
    """Build the array of a received extension; what cannot be one is left for the field's hook to refuse."""
    array = ARRAY_BY_CODE.get(code)
    try:
        return array.from_packed(data) if array is not None else msgspec.msgpack.Ext(code, bytes(data))
    except ValueError:
        return msgspec.msgpack.Ext(code, bytes(data))


def _decode_hook(wire: type, value: Any) -> object:
    """Check a received numeric sequence, or turn a plain array of numbers into one."""
    assert isinstance(wire, SequenceWire)
    array = wire.array
    if type(value) is not array:
        if not isinstance(value, list):
            shown = getattr(value, "element", type(value).__name__)
            raise TypeError(f"Expected {wire.field_type}, got {shown}")
        try:
            value = array(cast("Any", value))
        except (TypeError, OverflowError) as error:
            raise ValueError(f"Expected {wire.field_type}: {error}") from None
    assert isinstance(value, array)
    if wire.is_bounded:
        wire.check_length(len(value))
    return value.tolist() if wire.as_list else value


def _measure_extension(code: int, data: memoryview) -> object:
    """Stand in for an array that was just encoded, without copying it."""
    return code, len(data)


def _verify_hook(wire: type, value: Any) -> object:
    """Check a numeric sequence that was just encoded."""
    if not isinstance(value, tuple):
        return _decode_hook(wire, value)
    assert isinstance(wire, SequenceWire)
    code, size = cast("tuple[int, int]", value)
    array = wire.array
    if code != array.code:
        sent = ARRAY_BY_CODE[code]
        raise TypeError(
            f"Expected {wire.field_type}, got {sent.element}[]; convert with {array.__name__}(value)"
        )
    if wire.is_bounded:
        wire.check_length(size // array.item_size)
    return None


# Whatever a message holds or a peer sends, these are the errors that msgspec and the hooks have for it.
_ENCODING_ERRORS = (
    msgspec.MsgspecError, ValueError, TypeError, OverflowError, RecursionError, AttributeError,
    NotImplementedError, BufferError,
)  # fmt: skip
_DECODING_ERRORS = (msgspec.MsgspecError, ValueError, TypeError, OverflowError, RecursionError)


class Codec(Generic[T]):
    """Encodes and decodes the messages of one type; get one with `codec_for`.

    Attributes:
        msg_type: The message class.
    """

    def __init__(self, msg_type: type[T]) -> None:
        if not is_message_type(msg_type):
            type_name(msg_type)  # raises for all but services and actions
            raise TypeError(
                f"Expected a message class, got {msg_type.__name__}; use one of its nested classes"
            )
        self.msg_type = msg_type
        encoder = msgspec.msgpack.Encoder(enc_hook=_encode_hook)

        def decoder(of: Any, *, verify: bool = False) -> msgspec.msgpack.Decoder[Any]:
            return msgspec.msgpack.Decoder(
                of,
                dec_hook=_verify_hook if verify else _decode_hook,
                ext_hook=_measure_extension if verify else _extension_hook,
            )

        one, run, verifier = wired(
            msg_type,
            lambda: (
                decoder(msg_type),
                decoder(GenericAlias(list, (msg_type,))),
                decoder(msg_type, verify=True),
            ),
        )
        # Bound methods as attributes: a lookup less per message.
        self._encode = encoder.encode
        self._encode_into = encoder.encode_into
        self._decode = one.decode
        self._decode_run = run.decode
        self._verify = verifier.decode

    def encode(self, message: T) -> bytes:
        """Return `message` as msgpack, verified.

        Raises:
            TypeError: `message` is not a `msg_type`.
            InvalidMessageError: A field's value does not fit its type.
        """
        if not isinstance(message, self.msg_type):
            raise self._wrong_type(message)
        try:
            data = self._encode(message)
            self._verify(data)
        except _ENCODING_ERRORS as error:
            raise InvalidMessageError(explain_encoding(message, error, self._encode)) from error
        return data

    def encode_behind(self, message: T, room: int) -> bytearray:
        """Return the same behind `room` free bytes: what goes before a large message then costs no copy."""
        if not isinstance(message, self.msg_type):
            raise self._wrong_type(message)
        data = bytearray(room)
        try:
            self._encode_into(message, data, room)
            self._verify(memoryview(data)[room:])
        except _ENCODING_ERRORS as error:
            raise InvalidMessageError(explain_encoding(message, error, self._encode)) from error
        return data

    def decode(self, data: Buffer) -> T:
        """Return the message that `data` holds. `uint8[]` fields are views that keep `data` alive.

        Raises:
            InvalidMessageError: `data` is not one message of this type.
        """
        try:
            return cast("T", self._decode(data))
        except _DECODING_ERRORS as error:
            raise InvalidMessageError(explain_decoding(self.msg_type, error)) from error

    def decode_batch(self, data: Buffer) -> list[T]:
        """Return the messages that `data`, a msgpack array of them, holds.

        Raises:
            InvalidMessageError: Any of them is not a message of this type; `decode` tells which.
        """
        try:
            return cast("list[T]", self._decode_run(data))
        except _DECODING_ERRORS as error:
            raise InvalidMessageError(explain_decoding(self.msg_type, error)) from error

    def _wrong_type(self, message: object) -> TypeError:
        expected = type_name(self.msg_type)
        cls = type(message)
        got = type_name(cls) if is_message_type(cls) else cls.__name__
        return TypeError(f"Expected {expected}, got {got}")


@cache
def _codec(msg_type: type[Message]) -> Codec[Message]:
    return Codec(msg_type)


def codec_for(msg_type: type[T]) -> Codec[T]:
    """Return the codec of a message class; it is made once.

    Raises:
        TypeError: `msg_type` is no message class, or one of its fields has no ROS type.
    """
    return cast("Codec[T]", _codec(msg_type))


_untyped = msgspec.msgpack.Decoder(ext_hook=_extension_hook)


def decode_untyped(data: Buffer) -> dict[str, Any]:
    """Return a message whose type is not at hand as a dict of its fields; numeric sequences are arrays.

    Raises:
        InvalidMessageError: `data` is not a msgpack map with string keys.
    """
    try:
        value = _untyped.decode(data)
    except _DECODING_ERRORS as error:
        raise InvalidMessageError(f"Not a message: {error}") from error
    if not isinstance(value, dict) or not all(
        isinstance(key, str) for key in cast("dict[object, object]", value)
    ):
        raise InvalidMessageError("Not a message: expected a map of field names to values")
    return cast("dict[str, Any]", value)

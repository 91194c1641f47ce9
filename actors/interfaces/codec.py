"""Messages to bytes and back: the hot path.

A message travels as a msgpack map of field name to value. msgspec does not check values while it encodes, so
a codec decodes its own result, and a wrong value raises where the message is sent, as does a nested message
of a class with other fields. This check does not copy large binary fields and arrays.

Unknown fields are ignored when decoding; missing fields have their defaults, within `decode_budget.py`.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache, cached_property
from types import GenericAlias
from typing import TYPE_CHECKING, Any, Final, Generic, TypeVar, cast

import msgspec

from actors.interfaces.arrays import ARRAY_BY_CODE, ARRAY_BY_ELEMENT, BIG_ENDIAN, NumericArray, pack
from actors.interfaces.decode_budget import (
    UNCHECKED_BYTES,
    Allowance,
    budget_of,
    check_untyped,
    shared_allowance,
)
from actors.interfaces.errors import InvalidMessageError, MessageBudgetError
from actors.interfaces.explain import explain_decoding, explain_encoding
from actors.interfaces.fields import BINARY, SequenceWire, fields_of, nested_classes, strict, wired
from actors.interfaces.literals import INTEGER_RANGE
from actors.interfaces.message import Message, is_message_type, type_name
from actors.interfaces.values import bytes_of

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import TypeAlias

    from typing_extensions import Buffer

    from actors.interfaces.fields import FieldType

    Encoded: TypeAlias = bytes | bytearray | memoryview

T = TypeVar("T", bound=Message)


def _encode_hook(value: object) -> object:
    """Encode types that msgspec does not know: arrays, NumPy arrays and NumPy scalars."""
    # The most frequent type goes first: this hook runs for each array in each message.
    if isinstance(value, NumericArray) and not BIG_ENDIAN:
        return msgspec.msgpack.Ext(value.code, memoryview(value))  # as `pack` does, without its checks
    # A NumPy scalar is a buffer without dimensions.
    if hasattr(value, "dtype") and getattr(value, "ndim", None) == 0:
        return cast("Any", value).item()
    packed = pack(value)
    if isinstance(packed, tuple):
        return msgspec.msgpack.Ext(*packed)
    if packed is not None:
        return packed
    if isinstance(value, Sequence):
        return list(cast("Any", value))
    dtype = getattr(value, "dtype", "")
    raise TypeError(f"Expected a field value, got {type(value).__name__}{f' of {dtype}' if dtype else ''}")


def _extension_hook(code: int, data: memoryview) -> object:
    """Return the array of a received extension; the field's hook refuses an invalid one."""
    array = ARRAY_BY_CODE.get(code)
    try:
        # An unknown code is kept as it is: the field's own check then says what it expected.
        return array.from_packed(data) if array is not None else msgspec.msgpack.Ext(code, bytes(data))
    except ValueError:
        return msgspec.msgpack.Ext(code, bytes(data))


def _decode_hook(wire: type, value: Any) -> object:
    """Check a received numeric sequence, or convert a plain array of numbers."""
    assert isinstance(wire, SequenceWire)
    array = wire.array
    # A plain list, which any sender may use instead of an extension (docs/protocol.md), or something wrong.
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
    # A field that its author has declared as `list[float]` gets a list, whatever travelled.
    return value.tolist() if wire.as_list else value


def _measure_extension(code: int, data: memoryview) -> object:
    """Return the code and size of an array that was just encoded, without copying it."""
    # Enough to check type and length. Making the array would copy it only to throw it away.
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
    # msgspec does not look at the value any further, and the message that the verifier makes is dropped.
    return None


def _encodable(message: Any, *, converts: bool) -> Any:
    """Return a copy of a message in which lists in `uint8[]`, `byte[]` and `char[]` fields are bytes.

    A nested message of a subclass becomes one of the field's class, without the fields that only it has.

    Args:
        message: The message.
        converts: As in `Codec`.

    Raises:
        TypeError: An element of a sequence does not fit the field; so do ValueError and OverflowError.
    """
    changed: dict[str, Any] = {}
    for field in fields_of(cast("type[Message]", type(message))):
        name, kind = field.name, field.type
        value = getattr(message, name)
        if converts:
            value = changed[name] = _converted(kind, value)
        if not kind.is_array:
            if isinstance(value, Message):
                changed[name] = _as_field(kind, _encodable(value, converts=converts))
        elif isinstance(value, list | tuple):
            items = cast("list[Any]", value)
            if kind.base in BINARY:
                changed[name] = bytes_of(items)
            elif kind.message is not None:
                changed[name] = [
                    _as_field(kind, _encodable(each, converts=converts))
                    if isinstance(each, Message)
                    else each
                    for each in items
                ]
    return msgspec.structs.replace(message, **changed)


def _as_field(kind: FieldType, message: Message) -> Message:
    """Return an instance of a subclass of a nested message's class as one of that class."""
    cls = cast("Any", kind.message)
    if cls is None or type(message) is cls or not isinstance(message, cls):
        return message
    return cast("Message", cls(**{name: getattr(message, name) for name in cls.__struct_fields__}))


def _converted(kind: FieldType, value: Any) -> Any:
    """Return a bool in a field of integers as one, and an array of another element type as the field's."""
    if not kind.is_array:
        return int(value) if isinstance(value, bool) and kind.base in INTEGER_RANGE else value
    if kind.message is not None or not (isinstance(value, set | range) or hasattr(value, "tolist")):
        return value
    items: list[Any] = list(cast("Any", value)) if isinstance(value, set | range) else value.tolist()
    array = ARRAY_BY_ELEMENT.get(kind.base)
    return items if array is None else array(items)


# All errors that msgspec and the hooks raise for invalid messages and data.
_ENCODING_ERRORS = (
    msgspec.MsgspecError, ValueError, TypeError, OverflowError, RecursionError, AttributeError,
    NotImplementedError, BufferError,
)  # fmt: skip
_DECODING_ERRORS = (msgspec.MsgspecError, ValueError, TypeError, OverflowError, RecursionError)


FIXMAP: Final = 0x8
"""The first four bits of a msgpack map of up to 15 fields."""
MAPS: Final = (0xDE, 0xDF)
"""The first byte of a larger one."""


def encoded_message(data: Buffer) -> bytes | memoryview:
    """Return an encoded message: bytes as they are, anything else as a view.

    Args:
        data: One message as msgpack. Only its first byte is checked.

    Raises:
        TypeError: It is not bytes.
        InvalidMessageError: It is no msgpack map.
    """
    if not isinstance(data, bytes):
        try:
            data = memoryview(data).cast("B")
        except TypeError:
            raise TypeError(f"Expected bytes, one message as msgpack, got {type(data).__name__}") from None
    if not data or not (data[0] >> 4 == FIXMAP or data[0] in MAPS):
        raise InvalidMessageError("An encoded message begins with a msgpack map")
    return data


class EncodedCodec:
    """Takes the place of a `Codec` where messages are passed on as bytes."""

    @staticmethod
    def encode(data: Buffer) -> bytes:
        """Return the message as bytes; raises what `encoded_message` does."""
        return bytes(encoded_message(data))

    @staticmethod
    def decode_held(data: Encoded, others: int) -> bytes:
        """Return the message as bytes, whatever it is."""
        del others
        return bytes(data)


class Codec(Generic[T]):
    """Encodes and decodes the messages of one type; get one with `codec_for`.

    Attributes:
        msg_type: The message class.
        converts: Whether arrays of another element type than the field's are converted if no number is lost,
            and bools in fields of integers. Programs for ROS 2 expect it; in others it is an error.
        budget: What a received message may take.
    """

    def __init__(self, msg_type: type[T]) -> None:
        if not is_message_type(msg_type):
            type_name(msg_type)  # raises for all but services and actions
            raise TypeError(
                f"Expected a message class, got {msg_type.__name__}; use one of its nested classes"
            )
        self.msg_type = msg_type
        self.converts = False
        encoder = msgspec.msgpack.Encoder(enc_hook=_encode_hook)

        def decoder(of: Any) -> msgspec.msgpack.Decoder[Any]:
            return msgspec.msgpack.Decoder(of, dec_hook=_decode_hook, ext_hook=_extension_hook)

        # Two decoders for a type: one message, and a batch of them in one call.
        one, batch = wired(msg_type, lambda: (decoder(msg_type), decoder(GenericAlias(list, (msg_type,)))))
        self.budget = budget_of(cast("Any", msg_type))
        self._unchecked, self._always_decoded = self.budget.unchecked, self.budget.always
        # Bound methods as attributes save a lookup per message.
        self._encode = encoder.encode
        self._encode_into = encoder.encode_into
        self._decode = one.decode
        self._decode_batch = batch.decode
        self._verify: Callable[[Encoded], object] = self._verify_first
        self._verifier: Callable[[Encoded], object] = self._verify_first

    @cached_property
    def _omits(self) -> bool:
        """Whether fields with their defaults are left out."""
        nested = nested_classes(cast("Any", self.msg_type))
        return any(each.__struct_config__.omit_defaults for each in nested)

    def _verify_first(self, data: Encoded) -> None:
        """Check what was just encoded, with a decoder that is made now: most types are only read."""
        cls = cast("Any", self.msg_type)
        self._verifier = wired(
            cls,
            lambda: (
                msgspec.msgpack.Decoder(
                    strict(cls), dec_hook=_verify_hook, ext_hook=_measure_extension
                ).decode
            ),
        )
        self._verify = self._verify_omitted if self._omits else self._verifier
        self._verify(data)

    def encode(self, message: T) -> bytes:
        """Return a message as msgpack, verified.

        Args:
            message: An instance of `msg_type`.

        Raises:
            TypeError: `message` is not a `msg_type`.
            InvalidMessageError: A field's value does not fit its type.
            MessageBudgetError: Its class has `omit_defaults=True`, and so much is left out that readers would
                refuse it.
        """
        if not isinstance(message, self.msg_type):
            raise self._wrong_type(message)
        try:
            data = self._encode(message)
            # msgspec's encoder trusts the annotations. Without this check a str in an int field would be
            # sent, and the error would appear in every subscriber.
            self._verify(data)
        except _ENCODING_ERRORS as error:
            # Only after a failure: most messages have no such list, and looking for one would take longer
            # than encoding.
            data = self._encode_lists(message, error)
        return data

    def _verify_omitted(self, data: Encoded) -> None:
        """Check what was just encoded, from which fields with their defaults were left out."""
        # Readers would refuse it, where its sender does not see it.
        if len(data) > self._unchecked:
            self.budget.check(data, Allowance())
        self._verifier(data)

    def _encode_lists(self, message: T, error: Exception) -> bytes:
        """Encode a message again, with lists in `uint8[]` fields as bytes, or raise for `error`."""
        if isinstance(error, MessageBudgetError):
            raise error
        try:
            data = self._encode(_encodable(message, converts=self.converts))
            self._verify(data)
        except _ENCODING_ERRORS:
            # The first error, which is about the message as the user gave it.
            raise InvalidMessageError(explain_encoding(message, error, self._encode)) from error
        return data

    def encode_decoded(self, message: T) -> bytes:
        """Return a message as msgpack without verifying it, which is most of the work of `encode`.

        Args:
            message: A `msg_type` that a decoder has made, so that all its values fit.

        Raises:
            MessageBudgetError: As for `encode`.
        """
        if self._omits:
            return self.encode(message)
        return self._encode(message)

    def encode_behind(self, message: T, offset: int) -> bytearray:
        """Return a message as `encode` does, after free bytes for a header, which then needs no copy.

        Args:
            message: An instance of `msg_type`.
            offset: Number of free bytes.

        Raises:
            TypeError: `message` is not a `msg_type`.
            InvalidMessageError: A field's value does not fit its type.
        """
        if not isinstance(message, self.msg_type):
            raise self._wrong_type(message)
        data = bytearray(offset)
        try:
            self._encode_into(message, data, offset)
            self._verify(memoryview(data)[offset:])
        except _ENCODING_ERRORS as error:
            data = bytearray(offset) + self._encode_lists(message, error)
        return data

    def decode(self, data: Encoded, allowance: Allowance | None = None) -> T:
        """Return the message in `data`.

        Args:
            data: One message as msgpack; `uint8[]` fields are views that keep it alive.
            allowance: What messages of one reader may leave out together; None for this one alone.

        Raises:
            InvalidMessageError: `data` is not one message of this type.
            MessageBudgetError: It leaves out fields, and would take far more memory than its bytes.
        """
        if allowance is None:
            if len(data) > self._unchecked:
                self.budget.check(data, Allowance())
        elif not self.budget.admits(len(data), 1, allowance):
            self.budget.check(data, allowance)
        try:
            return cast("T", self._decode(data))
        except _DECODING_ERRORS as error:
            raise InvalidMessageError(explain_decoding(self.msg_type, error)) from error

    def decode_held(self, data: Encoded, others: int) -> T:
        """Return the message in `data`, which is held for some time, as others are.

        Args:
            data: As in `decode`; so are the errors.
            others: How many may be held at the same time.
        """
        # An allowance takes longer than decoding a small message, so only those have one that may use it.
        if others and len(data) > self._always_decoded:
            return self.decode(data, shared_allowance(others))
        return self.decode(data)

    def decode_batch(
        self, data: Encoded, count: int | None = None, allowance: Allowance | None = None
    ) -> list[T]:
        """Return the messages in `data`.

        Args:
            data: A msgpack array of messages.
            count: How many it has; None if unknown.
            allowance: What messages of one reader may leave out together; None for these alone.

        Raises:
            InvalidMessageError: One of them is not a message of this type; `decode` finds out which.
            MessageBudgetError: One leaves out fields, and may take too much; `decode` finds out which.
        """
        budget, size = self.budget, len(data)
        admitted = budget.admits(size, size if count is None else count, allowance or Allowance())
        if not admitted and not budget.is_proportionate(data, batch=True):
            raise MessageBudgetError(f"{type_name(self.msg_type)}: a message leaves out fields")
        return self.decode_admitted(data)

    def decode_admitted(self, data: Encoded) -> list[T]:
        """Return the messages in `data`, which the budget admits; see `decode_batch`."""
        try:
            return cast("list[T]", self._decode_batch(data))
        except _DECODING_ERRORS as error:
            raise InvalidMessageError(explain_decoding(self.msg_type, error)) from error

    def _wrong_type(self, message: object) -> TypeError:
        expected = type_name(self.msg_type)
        cls = type(message)
        got = type_name(cls) if is_message_type(cls) else cls.__name__
        if got == expected:  # two classes of one type
            expected, got = repr(self.msg_type), repr(cls)
        return TypeError(f"Expected {expected}, got {got}")


@cache
def _codec(msg_type: type[Message]) -> Codec[Message]:
    return Codec(msg_type)


def codec_for(msg_type: type[T]) -> Codec[T]:
    """Return the codec of a message class; it is made once.

    Args:
        msg_type: The message class.

    Raises:
        TypeError: `msg_type` is not a message class, or one of its fields has no ROS type.
    """
    return cast("Codec[T]", _codec(msg_type))


_untyped = msgspec.msgpack.Decoder(ext_hook=_extension_hook)


def decode_untyped(data: Encoded) -> dict[str, Any]:
    """Return a message of unknown type as a dict of its fields; numeric sequences are arrays.

    Args:
        data: One message as msgpack.

    Raises:
        InvalidMessageError: `data` is not a msgpack map with string keys.
        MessageBudgetError: It has so many empty or small parts that it would take far more than its bytes.
    """
    if len(data) > UNCHECKED_BYTES:
        check_untyped(data)
    try:
        value = _untyped.decode(data)
    except _DECODING_ERRORS as error:
        raise InvalidMessageError(f"Not a message: {error}") from error
    if not isinstance(value, dict) or not all(
        isinstance(key, str) for key in cast("dict[object, object]", value)
    ):
        raise InvalidMessageError("Not a message: expected a map of field names to values")
    return cast("dict[str, Any]", value)

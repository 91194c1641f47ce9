"""The decode budget: the memory of a received message stays in proportion to its bytes.

A field that is not written has its default, so an element of a sequence may be one byte, an empty map, and
take hundreds of bytes of memory. A message in which every field is written takes a small multiple of its
bytes and is never refused. Any other may take `FACTOR` times its bytes and `SPARE_BYTES`, and is charged
before it is built.

There are three steps, and nearly every message ends at the first:

1. A bound: the memory of the type's defaults, and the most for which one byte can ask. Types without
   sequences of messages mostly have nothing that is worth a look; of the others, small messages have not.
2. A skeleton: msgspec decodes the message as a class that has only those fields without which a message takes
   more than `FACTOR` times its bytes, and requires them. It sees each element, and each repetition of a key,
   stops at the first that is too small, and takes half the time of decoding.
3. A walk over messages without these fields, which charges each default, and stops where the budget ends.
   Of the sequences in them, those that pass a skeleton are charged by their bytes and not visited.

Only fields that are left out are charged. Strings, bin and packed numbers take memory in proportion to their
bytes, and fields cannot be of any type: there are no sequences of sequences, maps or optional values. A plain
array in place of packed numbers can have any element, and is checked for it.
"""

from __future__ import annotations

from contextlib import suppress
from functools import cache, cached_property
from sys import getsizeof
from types import GenericAlias
from typing import TYPE_CHECKING, Any, Final, NamedTuple, cast

import msgpack
import msgspec

from actors.interfaces.arrays import ARRAY_BY_ELEMENT, NumericArray
from actors.interfaces.errors import InvalidMessageError, MessageBudgetError
from actors.interfaces.fields import BINARY, fields_of
from actors.interfaces.literals import INTEGER_RANGE
from actors.interfaces.naming import message_name

if TYPE_CHECKING:
    from collections.abc import Callable

    from typing_extensions import Buffer

    from actors.interfaces.fields import FieldType
    from actors.interfaces.naming import MessageType

FACTOR: Final = 16
"""Memory for each received byte. Messages with every field written take 3 to 11, a few kinds of text more."""

SPARE_BYTES: Final = 4 * 1024 * 1024
"""Memory beyond that, so that small messages may leave out what they like. Making it takes about 25 ms."""

LEAST_SPARE_BYTES: Final = 16 * 1024
"""The same for each of many messages that wait: a thousand of them then take 16 MiB."""

UNCHECKED_BYTES: Final = 48 * 1024
"""Bytes of a message without a type, or with plain arrays in place of packed numbers, that need no look.
Empty maps and arrays take up to 92 times their bytes."""

MAX_STEPS: Final = 25_000
"""Fields and elements that a walk visits, in about 20 ms: it is the only step whose speed is Python's."""

MAX_NEW_BYTES: Final = 1024 * 1024 * 1024
"""Memory of a new message that a tool makes: a definition in a few lines can ask for more than there is."""

_GC_BYTES: Final = 16
_SLOT_BYTES: Final = 8
LIST_BYTES: Final = 56 + _GC_BYTES
ARRAY_BYTES: Final = 96
_EMPTY_MAP_BYTES: Final = 64
_PIECE_BYTES: Final = 64 * 1024
_LOOK_STEPS: Final = 10
"""Steps that a sequence takes which does not pass its skeleton: it is read again, by another unpacker."""

_OBJECT_BYTES: Final = 64
"""An element of a default that its author has written out, about."""

_SCALARS: Final[dict[str, Any]] = {
    **dict.fromkeys(INTEGER_RANGE.keys() - {"byte"}, int), "bool": bool, "float32": float, "float64": float
}  # fmt: skip
_Numbers: Final = list[int | float | bool]
_numbers: Final = msgspec.msgpack.Decoder(_Numbers)


def struct_bytes(cls: MessageType) -> int:
    """Return the memory of a message without the values of its fields."""
    # Python's allocator rounds up to 16.
    return (cls.__basicsize__ + _GC_BYTES + 15) // 16 * 16


def _is_numeric(kind: FieldType) -> bool:
    return kind.is_array and kind.base in ARRAY_BY_ELEMENT


def _made_bytes(factory: Any, element: int) -> int:
    """Return the memory of the default of a sequence that may have any length."""
    if isinstance(factory, type) and issubclass(factory, NumericArray):
        return ARRAY_BYTES
    # Elements that the author of the class has written out, or a function of his.
    return ARRAY_BYTES + len(factory()) * element


def _sequence_bytes(kind: FieldType, default: Any) -> int:
    """Return the memory of the default of a sequence. A fixed array is never made to be measured."""
    if not hasattr(default, "factory"):
        return 0  # a value that all messages share
    # A type that contains itself has no defaults for elements.
    if kind.low == 0 and (default.factory is list or isinstance(default.factory, GenericAlias)):
        return LIST_BYTES
    nested = kind.message
    array = ARRAY_BY_ELEMENT.get(kind.base)
    if nested is not None:
        element = _SLOT_BYTES + default_bytes(nested)
    elif array is not None:
        element = _SLOT_BYTES + array.item_size  # numbers are made as a list, and then packed
    else:
        element = 1 if kind.base in BINARY else _SLOT_BYTES
    if kind.low:
        return ARRAY_BYTES + kind.low * element
    return _made_bytes(default.factory, element if nested is not None else _OBJECT_BYTES)


@cache
def _omitted_bytes(cls: MessageType) -> dict[str, int]:
    """Return how much memory each field's default takes that is made for each message."""
    fields = fields_of(cls)
    written = cls.__struct_defaults__
    defaults = (msgspec.NODEFAULT,) * (len(fields) - len(written)) + written
    found: dict[str, int] = {}
    for field, default in zip(fields, defaults, strict=True):
        kind = field.type
        if default is msgspec.NODEFAULT:
            found[field.name] = 0  # msgspec refuses a message without it
        elif kind.is_array:
            found[field.name] = _sequence_bytes(kind, default)
        else:
            # A class whose default contains itself has no instances.
            found[field.name] = 0 if kind.message is None else default_bytes(kind.message)
    return found


@cache
def default_bytes(cls: MessageType) -> int:
    """Return about how much memory a new message takes, with all that it contains. None is made for it."""
    return struct_bytes(cls) + sum(_omitted_bytes(cls).values())


def _worst_bytes(cls: MessageType) -> tuple[int, bool]:
    """Return the most memory for which one byte inside a message can ask, and whether it has numbers."""
    worst, numeric = 0, False
    seen: set[MessageType] = set()
    pending = [cls]
    while pending:
        this = pending.pop()
        if this in seen:
            continue
        seen.add(this)
        for name, kind in ((field.name, field.type) for field in fields_of(this)):
            numeric |= _is_numeric(kind)
            if kind.message is None:
                continue
            pending.append(kind.message)
            made = default_bytes(kind.message)
            # An element may be one byte. Another field has its name before it, but may be repeated: each
            # value replaces the one before, and all take time.
            worst = max(worst, made + _SLOT_BYTES if kind.is_array else made // (len(name) + 2))
    return worst, numeric


class _Part(NamedTuple):
    """A message class as the walk sees it."""

    own: int  # memory without the fields
    plain: bool  # nothing in its fields is charged
    fields: dict[bytes, FieldType]
    omitted: dict[bytes, int]


@cache
def _part(cls: MessageType) -> _Part:
    omitted = _omitted_bytes(cls)
    return _Part(
        struct_bytes(cls) + _SLOT_BYTES,
        not any(omitted.values()),
        {field.name.encode(): field.type for field in fields_of(cls)},
        {name.encode(): size for name, size in omitted.items() if size},
    )


def _required(cls: MessageType) -> set[str]:
    """Return fields with which a message, without those in it, takes at most `FACTOR` times its bytes."""
    fields, omitted = fields_of(cls), _omitted_bytes(cls)
    # A nested message is always required, since it is a part with bytes and memory of its own.
    required = {field.name for field in fields if field.type.message is not None and not field.type.is_array}
    size = 1 + sum(len(name) + 1 for name in required)
    others = {name: cost for name, cost in omitted.items() if name not in required}
    memory = struct_bytes(cls) + _SLOT_BYTES + sum(others.values())
    for name in sorted(others, key=lambda name: (others[name], len(name)), reverse=True):
        if memory <= FACTOR * size:
            break
        required.add(name)
        memory -= others[name]
        size += len(name) + 2
    return required


def _skeleton(cls: MessageType, made: dict[MessageType, Any]) -> Any:
    """Return the skeleton of a message class.

    Args:
        cls: The message class.
        made: Those made so far, to which it is added: messages may contain one another in a circle.
    """
    if cls in made:
        return made[cls]
    required = _required(cls)
    # Fields that are neither required nor can hide anything are left out, and msgspec skips them.
    kept = [
        field
        for field in fields_of(cls)
        if field.name in required or field.type.message is not None or _is_numeric(field.type)
    ]
    kept.sort(key=lambda field: field.name not in required)
    skeleton: Any = msgspec.defstruct(
        f"_{cls.__name__}",
        [(field.name, Any) if field.name in required else (field.name, Any, None) for field in kept],
        gc=False,
    )
    made[cls] = skeleton
    # As in `fields.wired`: msgspec reads them when it makes the decoder.
    skeleton.__annotations__ = {field.name: _skeleton_type(field.type, made) for field in kept}
    return skeleton


def _skeleton_type(kind: FieldType, made: dict[MessageType, Any]) -> Any:
    if kind.message is not None:
        nested = _skeleton(kind.message, made)
        return GenericAlias(list, (nested,)) if kind.is_array else nested
    if _is_numeric(kind):
        return msgspec.msgpack.Ext | _Numbers
    # A scalar as what msgspec makes the fastest; of anything else a view, and no copy. The typed decoder
    # checks the value.
    return _SCALARS.get(kind.base, msgspec.Raw) if not kind.is_array else msgspec.Raw


class Allowance:
    """What messages that leave out fields may take until their reader has caught up.

    Attributes:
        memory: Memory beyond `FACTOR` times their bytes.
        steps: Fields and elements that are visited to charge them.
    """

    __slots__ = ("memory", "steps")

    def __init__(self, memory: int = SPARE_BYTES, steps: int = MAX_STEPS) -> None:
        self.memory = memory
        self.steps = steps


def shared_allowance(waiting: int) -> Allowance:
    """Return the allowance of a message while `waiting` others are held that had allowances.

    As the sum of 1/n² has a limit, all together take at most 1.7 times `SPARE_BYTES`, and
    `LEAST_SPARE_BYTES` each.
    """
    return Allowance(max(LEAST_SPARE_BYTES, SPARE_BYTES // (waiting + 1) ** 2))


class _Walk:
    """Charges the messages in `data` for what they leave out.

    What has been visited has to be in proportion at each moment. Otherwise most of the budget of a large
    message would be charged, element by element, before it is refused.

    Args:
        data: The bytes.
        memory: Memory at most, beyond `FACTOR` times the bytes.
        steps: Fields and elements at most.

    Attributes:
        steps: What is left of them.
    """

    def __init__(self, data: Buffer, memory: int, steps: int) -> None:
        self._read(memoryview(data), 0)
        self._memory = memory
        self.steps = steps
        # Sequences are looked at as a whole at about two levels. Each level costs the time of a skeleton, and
        # types that contain themselves may have any number of them.
        self._look_bytes = 2 * self._view.nbytes

    def _read(self, view: memoryview, start: int) -> None:
        self._view, self._start = view, start
        self._unpacker = _unpacker()
        self._unpacker.feed(view)

    @property
    def memory(self) -> int:
        """What is left of it."""
        left: int = self._memory + FACTOR * (self._start + self._unpacker.tell())
        return left

    def messages(self, cls: MessageType) -> None:
        """Charge an array of messages.

        Raises:
            _ExceededError: They take more than the limit.
            ValueError: They are no messages of this class; so does InvalidMessageError, with the reason.
        """
        if self._look_bytes > 0:
            start = self._unpacker.tell()
            self._unpacker.skip()
            part = self._view[start : self._unpacker.tell()]
            self._look_bytes -= part.nbytes
            if self._look_bytes >= 0 and budget_of(cls).is_proportionate(part, batch=True):
                self._charge(FACTOR * part.nbytes)
                return
            self.steps -= _LOOK_STEPS
            whole = self._view, self._start, self._unpacker
            self._read(part, self._start + start)
            self._walk(cls)
            self._view, self._start, self._unpacker = whole
        else:
            self._walk(cls)

    def _walk(self, cls: MessageType) -> None:
        for _ in range(self._unpacker.read_array_header()):
            self.message(cls)

    def message(self, cls: MessageType) -> None:
        """Charge one message; raises as `messages`."""
        own, plain, fields, omitted = _part(cls)
        self._charge(own)
        if plain:
            self._unpacker.skip()
            return
        written: set[bytes] = set()
        for _ in range(self._unpacker.read_map_header()):
            name = self._key()
            written.add(name)
            self._charge(0)
            kind = fields.get(name)
            if kind is not None and kind.message is not None:
                if kind.is_array:
                    self.messages(kind.message)
                else:
                    self.message(kind.message)
            elif kind is not None and _is_numeric(kind):
                self._numbers(kind)
            else:
                self._unpacker.skip()
        self._charge(sum(size for name, size in omitted.items() if name not in written))

    def _charge(self, memory: int) -> None:
        self._memory -= memory
        self.steps -= 1
        if self.memory < 0 or self.steps < 0:
            raise _ExceededError

    def _key(self) -> bytes:
        """Return the next key, which has to be a string: another kind may be of any size when it is built."""
        read: Callable[[int], bytes] = self._unpacker.read_bytes
        head = int.from_bytes(read(1), "big")
        if head & 0xE0 == 0xA0:
            return read(head & 0x1F)
        if not 0xD9 <= head <= 0xDB:
            raise ValueError("a key is not a string")
        return read(int.from_bytes(read(1 << (head - 0xD9)), "big"))

    def _numbers(self, kind: FieldType) -> None:
        start = self._unpacker.tell()
        self._unpacker.skip()
        head = self._view[start : start + 1].tobytes()[0]
        if head & 0xF0 == 0x90 or head in {0xDC, 0xDD}:
            try:
                _numbers.decode(self._view[start : self._unpacker.tell()])
            except msgspec.MsgspecError as error:
                raise InvalidMessageError(f"expected {kind}: {error}") from error
        elif head & 0xF0 == 0x80 or head in {0xDE, 0xDF}:
            raise InvalidMessageError(f"expected {kind}, got a map")


class _ExceededError(Exception):
    """The messages take more than the limit."""


_WALK_ERRORS: Final = (ValueError, RecursionError, msgpack.UnpackException)


class DecodeBudget:
    """What messages of one type may cost a reader; get one with `budget_of`.

    Attributes:
        default_bytes: Memory of a message without its bytes.
        excess: Memory beyond `FACTOR` for which one byte can ask; negative if there is none.
        most: Bytes of a message, or of a batch, above which it always needs a look.
        unchecked: Bytes of a message that need no look if it has `SPARE_BYTES`.
        always: The same if it has `LEAST_SPARE_BYTES`, which each message has.
    """

    def __init__(self, cls: MessageType) -> None:
        self._cls = cls
        self.default_bytes = default_bytes(cls) + _SLOT_BYTES
        worst, numeric = _worst_bytes(cls)
        self.excess = worst - FACTOR
        self.most = UNCHECKED_BYTES if numeric else 1 << 62
        self.unchecked = self._bytes_within(SPARE_BYTES)
        self.always = self._bytes_within(LEAST_SPARE_BYTES)

    def _bytes_within(self, spare: int) -> int:
        left = spare - self.default_bytes
        return -1 if left < 0 else min(self.most, left // max(1, self.excess))

    @cached_property
    def _skeletons(self) -> tuple[msgspec.msgpack.Decoder[Any], msgspec.msgpack.Decoder[Any]]:
        """Decoders of one message and of a batch."""
        # Made for the first message that is large enough. Most types never have one.
        skeleton = _skeleton(self._cls, {})
        return msgspec.msgpack.Decoder(skeleton), msgspec.msgpack.Decoder(GenericAlias(list, (skeleton,)))

    def admits(self, size: int, count: int, allowance: Allowance) -> bool:
        """Return whether messages need no look; if so, use up what they could take of the allowance.

        Args:
            size: Their bytes.
            count: How many they are.
            allowance: The reader's.
        """
        needed = count * self.default_bytes + size * self.excess
        if needed > allowance.memory or size > self.most:
            return False
        if needed > 0:
            allowance.memory -= needed
        return True

    def is_proportionate(self, data: Buffer, *, batch: bool = False) -> bool:
        """Return whether each message has the fields that it needs to take at most `FACTOR` times its bytes.

        Args:
            data: One message as msgpack.
            batch: It is an array of messages.
        """
        try:
            self._skeletons[batch].decode(data)
        except (msgspec.MsgspecError, RecursionError):
            return False
        return True

    def check(self, data: Buffer, allowance: Allowance) -> None:
        """Raise unless a message can be decoded within the budget.

        Args:
            data: One message as msgpack.
            allowance: The reader's; what the message takes of it is used up.

        Raises:
            MessageBudgetError: It leaves out fields, and would take more.
            InvalidMessageError: It is not a message of this type.
        """
        if self.is_proportionate(data):
            return
        size = memoryview(data).nbytes
        name = message_name(self._cls)
        walk = _Walk(data, allowance.memory, allowance.steps)
        try:
            walk.message(self._cls)
        except _ExceededError:
            raise MessageBudgetError(
                f"{name}: its {size:,} bytes leave out fields (or are invalid), and with their defaults would"
                f" take more than {FACTOR} times as much memory and {allowance.memory >> 10:,} KiB, or"
                f" {MAX_STEPS:,} steps; write every field of a large message"
            ) from None
        except InvalidMessageError as error:
            raise InvalidMessageError(f"{name}: {error}") from error.__cause__
        except _WALK_ERRORS as error:
            raise InvalidMessageError(f"{name}: not a message of this type ({error})") from error
        finally:
            allowance.steps = walk.steps
        allowance.memory = min(allowance.memory, walk.memory)


def require_possible(cls: MessageType) -> None:
    """Raise MessageBudgetError if a new message of a class takes more than `MAX_NEW_BYTES`."""
    size = default_bytes(cls)
    if size > MAX_NEW_BYTES:
        raise MessageBudgetError(
            f"A new {message_name(cls)} would take {size >> 20:,} MiB, for its arrays of fixed size;"
            f" at most {MAX_NEW_BYTES >> 20:,} MiB are possible"
        )


@cache
def budget_of(cls: MessageType) -> DecodeBudget:
    """Return the decode budget of a message class; it is made once."""
    return DecodeBudget(cls)


def check_untyped(data: Buffer) -> None:
    """Raise unless a message of unknown type can be decoded within the budget.

    Maps, arrays, and packed numbers in arrays are charged. Texts and numbers are not: they take at most 24
    times their bytes, and messages of some types hold nothing else.

    Args:
        data: One message as msgpack.

    Raises:
        MessageBudgetError: It would take more.
        InvalidMessageError: It is not msgpack.
    """
    view = memoryview(data).cast("B")
    charges = _UntypedCharges()
    try:
        # First without making anything: arrays that claim to be longer than they are would have memory
        # reserved.
        whole = _unpacker()
        whole.feed(view)
        whole.skip()
        parts = _unpacker(object_hook=charges.map, list_hook=charges.array, ext_hook=charges.packed)
        # In pieces, as each has to be in proportion: what is not, is found at once, and not after a part of
        # the whole.
        for start in range(0, len(view), _PIECE_BYTES):
            piece = view[start : start + _PIECE_BYTES]
            charges.left += FACTOR * len(piece)
            parts.feed(piece)
            with suppress(msgpack.OutOfData):
                parts.unpack()
    except _ExceededError:
        raise MessageBudgetError(
            f"A message of {len(view):,} bytes without a known type would take more than {FACTOR} times as "
            "much memory; it has too many empty or small parts"
        ) from None
    except (*_WALK_ERRORS, TypeError) as error:
        raise InvalidMessageError(f"Not a message: {str(error) or type(error).__name__}") from error


class _UntypedCharges:
    """Charges what msgpack makes, and has it freed: what a hook returns takes its place.

    Attributes:
        left: Memory that is left.
    """

    def __init__(self) -> None:
        self.left = SPARE_BYTES
        self._packed = 0
        """Packed numbers since the last map or array."""

    def map(self, made: dict[object, object]) -> None:
        # Packed numbers that are fields are not charged: a map with one field that is an empty sequence is
        # the smallest of all standard messages.
        if self._packed:
            self.left += min(self._packed, len(made)) * ARRAY_BYTES
            self._packed = 0
        self._charge(getsizeof(made) - _GC_BYTES if made else _EMPTY_MAP_BYTES)

    def array(self, made: list[object]) -> None:
        self._packed = 0
        self._charge(getsizeof(made))

    def packed(self, code: int, content: bytes) -> None:
        del code, content
        self._packed += 1
        self._charge(ARRAY_BYTES)

    def _charge(self, memory: int) -> None:
        self.left -= memory
        if self.left < 0:
            raise _ExceededError


def _unpacker(**options: Any) -> Any:
    """Return an unpacker for data of any size; the type stubs of msgpack.Unpacker lack most of it."""
    # By default it begins with a buffer of 1 MiB.
    return msgpack.Unpacker(
        read_size=_PIECE_BYTES, max_buffer_size=0, strict_map_key=False, **cast("Any", options)
    )

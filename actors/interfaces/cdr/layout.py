"""Where the fields of a message are in CDR, and how much memory it takes once it is decoded.

A primitive is aligned to its size, counted from behind the header. After a string or a sequence the alignment
of the next field depends on the message, so that what follows has a format for each place where it may begin.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from actors.interfaces.arrays import ARRAY_BY_ELEMENT
from actors.interfaces.decode_budget import ARRAY_BYTES, FACTOR, LIST_BYTES, struct_bytes
from actors.interfaces.fields import BINARY, SequenceWire, fields_of, wires_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from actors.interfaces.fields import FieldType
    from actors.interfaces.naming import MessageType

HEADER_BYTES: Final = 4
ANYWHERE: Final = frozenset(range(8))
"""All places of a field, modulo the greatest alignment."""

_FLOAT_BYTES: Final = 24
_INT_BYTES: Final = 32
_VIEW_BYTES: Final = 208
LIST_SLOT_BYTES: Final = 9
"""Of an element of a list, with the space for more that a growing list has."""
_TEXT_EXCESS: Final = -32
"""Of a string in UTF-8 with its NUL: of all, one character of two bytes takes the most for its bytes."""


class Item(NamedTuple):
    """A value of fixed size.

    Attributes:
        format: Its format for `struct`.
        size: Its bytes.
        align: Its alignment.
    """

    format: str
    size: int
    align: int


PRIMITIVES: Final = {
    name: Item(code, size, size)
    for names, code, size in (
        ("bool", "?", 1), ("byte", "c", 1), ("char uint8", "B", 1), ("int8", "b", 1),
        ("int16", "h", 2), ("uint16", "H", 2), ("int32", "i", 4), ("uint32", "I", 4),
        ("int64", "q", 8), ("uint64", "Q", 8), ("float32", "f", 4), ("float64", "d", 8),
    )
    for name in names.split()
}  # fmt: skip
LENGTH: Final = PRIMITIVES["uint32"]
NOTHING: Final = PRIMITIVES["uint8"]
"""What a message without fields consists of."""


def padding(place: int, align: int) -> int:
    """Return the number of bytes before a value that begins at `place` or later; the header counts."""
    return (HEADER_BYTES - place) % align


def packed(
    order: str, place: int, items: Iterable[Item], *, is_behind_text: bool = False, last_align: int = 1
) -> tuple[str, int]:
    """Return the format of consecutive values, with the padding before and between them, and its size.

    Args:
        order: "<" or ">".
        place: Where they begin.
        items: The values.
        is_behind_text: Whether a string is before them, whose terminator is still missing.
        last_align: To which alignment there is padding after them.
    """
    parts = [order, "x" * is_behind_text]
    end = place + is_behind_text
    for item in (*items, Item("", 0, last_align)):
        gap = padding(end, item.align)
        parts += ["x" * gap, item.format]
        end += gap + item.size
    return "".join(parts), end - place


def repeatable(items: Sequence[Item]) -> bool:
    """Return whether an element of these values is followed by the next without padding, in one format."""
    first = items[0].align
    found = {packed("<", place, items) for place in range(8) if not padding(place, first)}
    return len(found) == 1 and not found.pop()[1] % first


def array_item(kind: FieldType) -> Item:
    """Return an array of fixed size, of primitives, as one value: its bytes."""
    element = PRIMITIVES[kind.base]
    return Item(f"{kind.low * element.size}s", kind.low * element.size, element.align)


def flat_items(cls: MessageType) -> list[tuple[Item, tuple[str, ...], FieldType]] | None:
    """Return the values of a message of a class whose size is fixed, and the paths to them; None for others.

    Only scalars, and few: such messages are read and written by the thousand, as points of a polygon.
    """
    fields = fields_of(cls)
    found: list[tuple[Item, tuple[str, ...], FieldType]] = []
    for field in fields:
        kind = field.type
        if kind.is_array or len(found) > 64:
            return None
        if kind.base in PRIMITIVES:
            found.append((PRIMITIVES[kind.base], (field.name,), kind))
            continue
        nested = None if kind.message is None else flat_items(kind.message)
        if nested is None:
            return None
        found += [(item, (field.name, *path), leaf) for item, path, leaf in nested]
    return found or None


@cache
def least_bytes(cls: MessageType) -> int:
    """Return the fewest bytes of a message, without padding."""
    return sum(_least(field.type) for field in fields_of(cls)) or NOTHING.size


def _least(kind: FieldType) -> int:
    if kind.is_array and not kind.is_fixed:
        return LENGTH.size
    count = kind.low if kind.is_array else 1
    if kind.message is not None:
        return count * least_bytes(kind.message)
    return count * PRIMITIVES.get(kind.base, LENGTH).size


@cache
def excess_bytes(cls: MessageType, *, is_exact: bool) -> int:
    """Return how much memory an element of a sequence takes beyond `FACTOR` times its bytes.

    Args:
        cls: The class of the element.
        is_exact: Without strings and sequences, whose size depends on the message. Otherwise at worst: all
            sequences are empty, whose elements are not counted.
    """
    wires = wires_of(cls)
    fields = fields_of(cls)
    own = struct_bytes(cls) - (0 if fields else FACTOR * NOTHING.size)
    return own + sum(_excess(field.type, wires[field.name], is_exact=is_exact) for field in fields)


def _excess(kind: FieldType, wire: Any, *, is_exact: bool) -> int:
    if not kind.is_array:
        if kind.message is not None:
            return excess_bytes(kind.message, is_exact=is_exact)
        if kind.base in PRIMITIVES:
            return number_bytes(kind) - FACTOR * PRIMITIVES[kind.base].size
        return 0 if is_exact else _TEXT_EXCESS
    if not kind.is_fixed:
        return 0 if is_exact else held_bytes(kind, wire) - FACTOR * LENGTH.size
    if kind.base not in PRIMITIVES:
        return LIST_BYTES
    element = element_bytes(kind, wire) - FACTOR * PRIMITIVES[kind.base].size
    return held_bytes(kind, wire) + kind.low * element


def held_bytes(kind: FieldType, wire: Any) -> int:
    """Return the memory of an empty sequence."""
    if kind.base in BINARY:
        return _VIEW_BYTES
    return LIST_BYTES if kind.base not in ARRAY_BY_ELEMENT or is_list(wire) else ARRAY_BYTES


def element_bytes(kind: FieldType, wire: Any) -> int:
    """Return the memory of a primitive in a sequence."""
    if kind.base in BINARY or (kind.base in ARRAY_BY_ELEMENT and not is_list(wire)):
        return PRIMITIVES[kind.base].size
    return LIST_SLOT_BYTES + number_bytes(kind)


def is_list(wire: Any) -> bool:
    """Return whether the field of a sequence of numbers has a plain list."""
    return isinstance(wire, SequenceWire) and wire.as_list


def number_bytes(kind: FieldType) -> int:
    """Return the memory of a number; there are only so many of one byte, and Python has them all."""
    if kind.base in BINARY or kind.base == "bool":
        return 0
    return _FLOAT_BYTES if kind.base in {"float32", "float64"} else _INT_BYTES

"""Strings and sequences in CDR: what the generated encoders and decoders call."""

from __future__ import annotations

import sys
from array import array
from functools import partial
from itertools import repeat
from struct import Struct
from sys import getsizeof
from typing import TYPE_CHECKING, Any, Final, cast

from actors.interfaces.arrays import BIG_ENDIAN, NumericArray, pack
from actors.interfaces.values import bytes_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from typing_extensions import Buffer

_HOST: Final = f"utf-16-{sys.byteorder[0]}e"


_ROUNDING_BYTES: Final = 8
"""By how much Python's allocator rounds up a size, on average."""


class TooShortError(ValueError):
    """The bytes end before the message does."""


class UnusualError(ValueError):
    """A message has another representation, or a string that ends in the middle or has no end."""


class LengthError(ValueError):
    """A field has more or fewer elements than its type allows; the text begins with its name."""


def text(data: bytes) -> str:
    """Return a string as rclpy does: up to the first NUL, and with a mark for each byte that is not UTF-8."""
    return str(data.partition(b"\0")[0], "utf-8", "replace")


def text_bytes(value: str) -> int:
    """Return the memory of a string; Python has the empty one and those of one Latin character."""
    return getsizeof(value) + _ROUNDING_BYTES if len(value) > 1 or value > "\xff" else 0


def read_wide(data: bytes, order: str) -> str:
    """Return a `wstring`: ROS 2 writes four bytes for each UTF-16 unit, and no terminator."""
    units = array("I", data)
    if (order == ">") != BIG_ENDIAN:
        units.byteswap()
    # A unit that has more than 16 bits raises OverflowError, half a pair of surrogates UnicodeDecodeError.
    return array("H", units).tobytes().decode(_HOST)


def write_wide(value: str) -> bytes:
    """Return a `wstring` as four bytes for each UTF-16 unit."""
    units = array("I", array("H", value.encode(_HOST)))
    if BIG_ENDIAN:
        units.byteswap()
    return units.tobytes()


def text_reader(order: str, *, is_careful: bool, is_wide: bool) -> Callable[[bytes, int, int], Any]:
    """Return a function that reads consecutive strings.

    Args:
        order: "<" or ">".
        is_careful: Whether they may have NUL in them, no end, or bytes that are not UTF-8.
        is_wide: Whether they are `wstring`.

    Returns:
        A function of the message, the place of the first string, and their number; it returns the strings and
        the place behind them.
    """
    length_at = Struct(f"{order}I").unpack_from
    if not is_careful and not is_wide:
        return partial(_read_texts, length_at)
    convert, unit = (partial(read_wide, order=order), 4) if is_wide else (text, 1)

    def read(data: bytes, place: int, count: int) -> tuple[list[str], int]:
        if 4 * count > len(data) - place:
            raise TooShortError
        found: list[str] = []
        for _ in repeat(None, count):
            start = place + 7 & -4
            (size,) = length_at(data, start - 4)
            place = start + size * unit
            found.append(convert(data[start:place]))
        return found, place

    return read


def _read_texts(length_at: Any, data: bytes, place: int, count: int) -> tuple[list[str], int]:
    """Do the same for usual strings, in half the time."""
    if 4 * count > len(data) - place:
        raise TooShortError
    found: list[str] = []
    add = found.append
    for _ in repeat(None, count):
        start = place + 7 & -4
        (size,) = length_at(data, start - 4)
        place = start + size
        add(data[start : place - 1].decode())
        if data[place - 1]:
            raise UnusualError
    if "\0" in "".join(found):
        raise UnusualError
    return found, place


_LENGTH_BEHIND: Final = tuple((Struct(f"<x{'x' * (3 - place)}I").pack, 8 - place) for place in range(4))
"""How the length of a string is written behind the string before it, by the place where that ends."""
_LENGTH: Final = Struct("<I").pack


def _require_list(values: object) -> None:
    """Raise TypeError for other sequences, such as a string, which would be one of its characters."""
    if not isinstance(values, list | tuple):
        raise TypeError("expected a list")


def write_texts(out: list[Any], values: Iterable[str], place: int) -> int:
    """Write consecutive strings.

    Args:
        out: The parts of the message, to which they are added.
        values: The strings.
        place: Where they begin; a multiple of four.

    Returns:
        The place behind them.
    """
    _require_list(values)
    add = out.append
    pack_length, size = _LENGTH, 4
    for value in values:
        data = value.encode()
        if 0 in data:
            raise ValueError("a string has a NUL in it")
        add(pack_length(len(data) + 1))
        add(data)
        place += size + len(data)
        pack_length, size = _LENGTH_BEHIND[place & 3]
    if pack_length is not _LENGTH:
        add(b"\0")
        place += 1
    return place


def write_wide_texts(out: list[Any], values: Iterable[str], place: int) -> int:
    """Write consecutive strings of the type `wstring`; see `write_texts`."""
    _require_list(values)
    for value in values:
        data = write_wide(value)
        out += (_LENGTH(len(data) >> 2), data)
        place += 4 + len(data)
    return place


def swapped_array(cls: type[NumericArray], data: Buffer) -> NumericArray:
    """Return the array of elements in the other byte order than this machine's."""
    made = cls()
    made.frombytes(data)
    made.byteswap()
    return made


def large_array(cls: type[NumericArray], data: bytes, start: int, end: int) -> NumericArray:
    """Return the array of the elements in a part of a message, which is copied once only."""
    made = cls()
    made.frombytes(memoryview(data)[start:end])
    return made


def numbers(cls: type[NumericArray], value: Any) -> Any:
    """Return the value of a field of numbers as a buffer of its elements.

    Raises:
        TypeError: It is no sequence of such numbers; so do ValueError and OverflowError.
    """
    if isinstance(value, list | tuple):
        value = cls(value)  # pyright: ignore[reportUnknownArgumentType]
    found = pack(value)
    if not isinstance(found, tuple) or found[0] != cls.code:
        raise TypeError(f"expected {cls.element}[]")
    return cast("Any", found[1]).cast(cls.format)


def binary(value: Any) -> Any:
    """Return the value of a field of bytes as a buffer; raise as `numbers`."""
    found = pack(value)
    if found is None and isinstance(value, list | tuple):
        return bytes_of(value)
    if not isinstance(found, memoryview):
        raise TypeError("expected bytes")
    return found


def bools(values: Sequence[bool]) -> bytes:
    """Return bools as bytes; raise TypeError for other values."""
    if not isinstance(values, list | tuple) or not {bool}.issuperset(map(type, values)):
        raise TypeError("expected a list of bools")
    return bytes(values)


def no_bool() -> bool:
    """Raise TypeError: a field of the type `bool` has another value."""
    raise TypeError("expected a bool")

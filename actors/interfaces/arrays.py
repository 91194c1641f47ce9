"""Numeric sequences: packed arrays, each encoded as one msgpack extension.

The code of an extension is the element type; its bytes are the elements, little-endian, without padding:

    1 int8      2 int16     3 int32     4 int64
    5 (unused: `uint8[]`, `byte[]` and `char[]` are encoded as bin)
    6 uint16    7 uint32    8 uint64
    9 float32  10 float64

A sender may also encode such a field as a plain msgpack array of numbers; a reader accepts both. `bool[]`,
strings and messages are always plain arrays. Codes 11 to 31 are reserved for more element types.
"""

from __future__ import annotations

import array
import struct
import sys
from typing import TYPE_CHECKING, Any, ClassVar, cast

if TYPE_CHECKING:
    from collections.abc import Iterable
    from typing import Self, SupportsFloat

    from typing_extensions import Buffer

    # Only typing knows this type parameter before Python 3.12.
    _Base = array.array[Any]
else:
    _Base = array.array

BIG_ENDIAN = sys.byteorder == "big"
_KIND_BY_CODE = {"n": "int", "N": "uint", "f": "float", "d": "float"}
_KIND_BY_CODE.update(dict.fromkeys("bhilq", "int"), **dict.fromkeys("BHILQ", "uint"))


def element_of(view: memoryview[Any]) -> str:
    """Return "int64", "float32", … for the elements of a buffer of any byte order, "" for anything else."""
    kind = _KIND_BY_CODE.get(view.format.lstrip("@=<>!"), "")
    return f"{kind}{8 * view.itemsize}" if kind else ""


def _is_big_endian(view: memoryview[Any]) -> bool:
    return view.format[0] in ">!" or (BIG_ENDIAN and view.format[0] != "<")


class NumericArray(_Base):
    """An `array.array` with the element type of its class: base of `Float64Array` and the others.

    A buffer of the same element type, such as a NumPy array of any byte order, is copied without a loop.
    Arrays are equal to lists of equal numbers.

    Args:
        values: An iterable of numbers, or a buffer; bytes are numbers from 0 to 255.

    Raises:
        TypeError: An element is not a number of the right kind, or a buffer has more than one dimension.
        OverflowError: An integer is out of the element type's range. (A float beyond float32 becomes inf.)
    """

    element: ClassVar[str]
    """The ROS name of the element type."""
    code: ClassVar[int]
    """The msgpack extension code."""
    format: ClassVar[str]
    """The `array` and `struct` format character."""
    item_size: ClassVar[int]
    """Bytes per element."""

    __slots__ = ()

    def __init_subclass__(cls) -> None:
        cls.item_size = struct.calcsize(f"={cls.format}")

    def __new__(cls, values: Iterable[SupportsFloat] | Buffer = ()) -> Self:
        """Make an array of `values`."""
        # The usual case, which `array` itself makes the fastest.
        if isinstance(values, list | tuple):
            return super().__new__(cls, cls.format, values)
        made = super().__new__(cls, cls.format)
        try:
            view = memoryview(cast("Buffer", values))
        except TypeError:
            made.extend(cast("Iterable[Any]", values))
            return made
        with view:
            if view.ndim != 1:
                raise TypeError(f"Expected a one-dimensional sequence, got {view.ndim} dimensions")
            # Bytes are copied only if the elements have the same type. Otherwise the numbers are converted
            # one by one, with the range checks of `array`.
            if element_of(view) == cls.element:
                made.frombytes(view.tobytes())
                if _is_big_endian(view) != BIG_ENDIAN:
                    made.byteswap()
                return made
        made.extend(array.array(cls.format, list(cast("Iterable[Any]", values))))
        return made

    @classmethod
    def from_packed(cls, data: Buffer) -> Self:
        """Return the array of little-endian packed elements.

        Raises:
            ValueError: The length is not a multiple of the element's size.
        """
        made = super().__new__(cls, cls.format)
        made.frombytes(data)
        if BIG_ENDIAN:
            made.byteswap()
        return made

    def __repr__(self) -> str:
        # As the base class: programs written for ROS 2 show it, and other programs read what they print.
        return f"array({self.format!r}, {self.tolist()!r})" if self else f"array({self.format!r})"

    def __eq__(self, other: object) -> bool:
        if isinstance(other, list | tuple):
            return self.tolist() == list(cast("list[Any]", other))
        return super().__eq__(other)

    def __ne__(self, other: object) -> bool:
        if isinstance(other, list | tuple):
            return self.tolist() != list(cast("list[Any]", other))
        return super().__ne__(other)

    # Mutable, and equal to lists, which have no hash either.
    __hash__ = None  # pyright: ignore[reportAssignmentType]

    def __copy__(self) -> Self:
        # Written out, since the base class would return a plain `array.array`.
        return type(self)(self)

    def __deepcopy__(self, memo: dict[int, object]) -> Self:
        return type(self)(self)

    def __reduce__(self) -> tuple[type[Self], tuple[list[Any]]]:
        return type(self), (self.tolist(),)

    def __reduce_ex__(self, protocol: object) -> tuple[type[Self], tuple[list[Any]]]:
        return self.__reduce__()


class Int8Array(NumericArray):
    """`int8[]`."""

    __slots__ = ()
    element, code, format = "int8", 1, "b"


class Int16Array(NumericArray):
    """`int16[]`."""

    __slots__ = ()
    element, code, format = "int16", 2, "h"


class Int32Array(NumericArray):
    """`int32[]`."""

    __slots__ = ()
    element, code, format = "int32", 3, "i"


class Int64Array(NumericArray):
    """`int64[]`."""

    __slots__ = ()
    element, code, format = "int64", 4, "q"


class UInt16Array(NumericArray):
    """`uint16[]`."""

    __slots__ = ()
    element, code, format = "uint16", 6, "H"


class UInt32Array(NumericArray):
    """`uint32[]`."""

    __slots__ = ()
    element, code, format = "uint32", 7, "I"


class UInt64Array(NumericArray):
    """`uint64[]`."""

    __slots__ = ()
    element, code, format = "uint64", 8, "Q"


class Float32Array(NumericArray):
    """`float32[]`. A finite number beyond float32's range becomes infinite, as in C."""

    __slots__ = ()
    element, code, format = "float32", 9, "f"


class Float64Array(NumericArray):
    """`float64[]`."""

    __slots__ = ()
    element, code, format = "float64", 10, "d"


ARRAYS: tuple[type[NumericArray], ...] = (
    Int8Array, Int16Array, Int32Array, Int64Array, UInt16Array, UInt32Array, UInt64Array,
    Float32Array, Float64Array,
)  # fmt: skip
ARRAY_BY_CODE: dict[int, type[NumericArray]] = {cls.code: cls for cls in ARRAYS}
ARRAY_BY_ELEMENT: dict[str, type[NumericArray]] = {cls.element: cls for cls in ARRAYS}


def pack(value: object) -> tuple[int, memoryview] | memoryview | None:
    """Return the encoding of a buffer: (extension code, bytes), a view for bin, or None without numbers.

    Raises:
        TypeError: The buffer has more than one dimension.
    """
    try:
        view: memoryview[Any] = memoryview(cast("Buffer", value))
    except TypeError:
        return None
    if view.ndim != 1:
        raise TypeError(f"Expected a one-dimensional sequence, got {view.ndim} dimensions")
    element = element_of(view)
    # No extension: `uint8[]` travels as msgpack bin, which readers in every language have.
    if element == "uint8":
        return view if view.c_contiguous else memoryview(view.tobytes())
    found = ARRAY_BY_ELEMENT.get(element)
    if found is None:
        return None
    big_endian = _is_big_endian(view)
    # A NumPy view of every second element, for example. Only these need a copy.
    if big_endian or not view.c_contiguous or not view.format.isalpha():
        packed = array.array(found.format, view.tobytes())
        if big_endian:
            packed.byteswap()
        view = memoryview(packed)
    return found.code, view.cast("B")

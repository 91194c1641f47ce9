"""Numeric sequences."""

from __future__ import annotations

import array
import copy
import math
import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors.interfaces.arrays import (
    ARRAYS,
    Float32Array,
    Float64Array,
    Int8Array,
    Int64Array,
    NumericArray,
    UInt16Array,
    pack,
)


@pytest.mark.parametrize("cls", ARRAYS)
def test_each_element_type_survives_packing(cls: type[NumericArray]) -> None:
    """What `pack` says is what `from_packed` reads back, and the codes are those of the protocol."""
    made = cls([1, 2, 3])
    packed = pack(made)
    assert isinstance(packed, tuple)
    code, data = packed
    assert code == cls.code
    assert len(data) == 3 * cls.item_size
    assert cls.from_packed(data) == made


@pytest.mark.parametrize("kind", [list, tuple, Float64Array])
def test_an_array_is_equal_or_not(kind: type[Any]) -> None:
    """`!=` is the opposite of `==`, on both sides, also with lists and tuples."""
    made = Float64Array([1, 2])
    for values, equal in ((kind([1, 2]), True), (kind([1, 3]), False), (kind([1]), False)):
        assert (made == values, values == made) == (equal, equal)
        assert (made != values, values != made) == (not equal, not equal)


def test_codes_are_the_protocols() -> None:
    """The extension codes never change: they are on the wire."""
    assert {cls.element: cls.code for cls in ARRAYS} == {
        "int8": 1,
        "int16": 2,
        "int32": 3,
        "int64": 4,
        "uint16": 6,
        "uint32": 7,
        "uint64": 8,
        "float32": 9,
        "float64": 10,
    }


def test_packed_bytes_are_little_endian() -> None:
    """A client in another language reads the elements with the least significant byte first."""
    packed = pack(UInt16Array([0x0102]))
    assert isinstance(packed, tuple)
    assert bytes(packed[1]) == b"\x02\x01"


@pytest.mark.parametrize(
    "source",
    [
        [1, 2],
        (1, 2),
        range(1, 3),
        iter([1, 2]),
        array.array("d", [1, 2]),
        np.array([1, 2]),
        b"\x01\x02",
        np.array([1.0, 2.0]),
        np.array([1.0, 9.0, 2.0])[::2],
        Int8Array([1, 2]),
    ],
)
def test_takes_iterables_and_buffers(source: Any) -> None:
    """Lists, iterators, arrays and NumPy arrays of any element type and stride make the same array."""
    assert Float64Array(source) == [1.0, 2.0]


def test_refuses_what_does_not_fit() -> None:
    """Text, integers out of range and two dimensions raise."""
    with pytest.raises(TypeError):
        Float64Array(["x"])  # type: ignore[list-item]
    with pytest.raises(OverflowError):
        Int8Array([128])
    with pytest.raises(TypeError, match="one-dimensional"):
        Float64Array(np.zeros((2, 2)))
    with pytest.raises(TypeError, match="one-dimensional"):
        pack(np.zeros((2, 2)))
    with pytest.raises(ValueError, match="multiple"):
        Int64Array.from_packed(b"123")


def test_float32_overflow_is_infinite() -> None:
    """A number beyond float32 becomes infinite, as documented."""
    assert Float32Array([1e300])[0] == math.inf


def test_copies_keep_the_class() -> None:
    """copy, deepcopy and pickle give the same class and elements."""
    made = Int64Array([1, -2])
    for other in (copy.copy(made), copy.deepcopy(made), pickle.loads(pickle.dumps(made))):
        assert type(other) is Int64Array
        assert other == made
    assert made != [1]
    assert made != "x"


def test_arrays_print_as_the_array_module_prints_them() -> None:
    """ROS 2's programs print sequences so."""
    for values in ([], [1, -2]):
        assert repr(Int64Array(values)) == repr(array.array("q", values))


def test_pack_knows_binary_and_refuses_the_rest() -> None:
    """uint8 buffers go as bin; what is no buffer of numbers is not packed."""
    assert bytes(pack(np.array([1, 9, 2], dtype=np.uint8)[::2])) == b"\x01\x02"  # type: ignore[arg-type]
    assert pack(object()) is None
    assert pack(np.array([True])) is None


@given(st.lists(st.floats(allow_nan=False)))
def test_any_floats_survive(values: list[float]) -> None:
    """float64 loses nothing."""
    packed = pack(Float64Array(values))
    assert isinstance(packed, tuple)
    assert Float64Array.from_packed(packed[1]) == values

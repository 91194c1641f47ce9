"""Depth: found in place, for any msgpack, without decoding."""

from __future__ import annotations

from typing import Any

import msgpack
import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto.wire.depth import check_depth

VALUES: st.SearchStrategy[Any] = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**63), 2**64 - 1)
    | st.floats()
    | st.text(max_size=300)
    | st.binary(max_size=300),
    lambda inner: st.lists(inner, max_size=20) | st.dictionaries(st.text(max_size=40), inner, max_size=20),
    max_leaves=60,
)


def depth(value: object) -> int:
    """Return how deep a value nests."""
    if isinstance(value, dict):
        return 1 + max(map(depth, value.values()), default=0)
    return 1 + max(map(depth, value), default=0) if isinstance(value, list) else 0


@given(VALUES, st.binary(max_size=3))
def test_a_value_passes_at_its_depth_and_not_below(value: object, rest: bytes) -> None:
    """The limit is exact, whatever the value consists of and whatever follows it."""
    raw = msgpack.packb(value)
    check_depth(raw + rest, depth(value))
    if depth(value):
        with pytest.raises(ValueError, match="levels"):
            check_depth(raw + rest, depth(value) - 1)
    with pytest.raises(ValueError, match="cut off"):
        check_depth(raw[:-1], depth(value))


@pytest.mark.parametrize("raw", [b"\xd4\x05\x00", b"\xc7\x01\x05\x00"])
def test_extension_types_are_refused(raw: bytes) -> None:
    """No header has one."""
    with pytest.raises(ValueError, match="extension"):
        check_depth(raw, 4)

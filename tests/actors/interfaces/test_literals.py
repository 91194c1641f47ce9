"""Values in interface text."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors.interfaces.fields import FieldType
from actors.interfaces.literals import parse_value, render_value


@pytest.mark.parametrize("text", ["true", "TRUE", "True", "1"])
def test_true(text: str) -> None:
    """Any case."""
    assert parse_value(FieldType("bool"), text) is True


@pytest.mark.parametrize("text", ["false", "False", "0"])
def test_false(text: str) -> None:
    """Any case."""
    assert parse_value(FieldType("bool"), text) is False


@pytest.mark.parametrize(
    ("base", "text"),
    [
        ("bool", "true "),
        ("bool", "5"),
        ("bool", ""),
        ("int8", "128"),
        ("int8", "-129"),
        ("uint8", "-1"),
        ("uint64", "18446744073709551616"),
        ("int8", "1.0"),
        ("int8", "x"),
        ("byte", "256"),
        ("char", "-1"),
        ("float32", "x"),
        ("string", '"open'),
        ("string", "'"),
        ("string", '"in "side"'),
    ],
)
def test_refused(base: str, text: str) -> None:
    """Out of range or of another kind."""
    with pytest.raises(ValueError, match=r".+"):
        parse_value(FieldType(base), text)


@pytest.mark.parametrize(
    ("base", "text", "value"),
    [
        ("int8", "0x10", 16),
        ("int8", "0b11", 3),
        ("int8", "0o17", 15),
        ("int8", "-5", -5),
        ("byte", "7", b"\x07"),
        ("char", "65", 65),
        ("uint8", "08", 8),
        ("uint8", "010", 10),
        ("int8", "-0_8", -8),
        ("int8", "+0x_f", 15),
        ("float64", "1e3", 1000.0),
        ("float32", "1", 1.0),
        ("string", "plain text", "plain text"),
        ("string", '"quo\\"ted"', 'quo"ted'),
        ("string", "'it\\'s'", "it's"),
        ("wstring", '"é\\n"', "é\n"),
        ("string", r"C:\x41\u0042\103\d", r"C:ABC\d"),
        ("string", r'"two \\\\ for one"', r"two \ for one"),
    ],
)
def test_accepted(base: str, text: str, value: object) -> None:
    """Hex, octal, binary, quotes and escapes."""
    assert parse_value(FieldType(base), text) == value


def test_arrays() -> None:
    """Commas in quotes do not split; an empty array is one."""
    texts = FieldType("string", is_array=True)
    assert parse_value(texts, "[\"a, b\", 'c', d]") == ["a, b", "c", "d"]
    assert parse_value(texts, "[it's, 5\"]") == ["it's", '5"']
    assert parse_value(texts, "[]") == []
    # Escapes are read once; those of a string alone twice.
    assert parse_value(texts, r"[\\n, 'a\\b', \x41]") == [r"\n", r"a\b", "A"]
    assert parse_value(FieldType("string"), r"\\n") == "\n"
    assert parse_value(FieldType("int8", is_array=True), "[1, 0x2,3]") == [1, 2, 3]
    for bad in ("1, 2", '["a]', "[1 2]"):
        with pytest.raises(ValueError, match=r".+"):
            parse_value(FieldType("int8", is_array=True), bad)


@given(
    st.one_of(
        st.tuples(st.just(FieldType("string")), st.one_of(st.text(), st.text("\\\"'nx41\t\u2028"))),
        st.tuples(st.just(FieldType("int64")), st.integers(-(2**63), 2**63 - 1)),
        st.tuples(st.just(FieldType("float64")), st.floats(allow_nan=False)),
        st.tuples(st.just(FieldType("bool")), st.booleans()),
        st.tuples(st.just(FieldType("string", is_array=True)), st.lists(st.text())),
        st.tuples(st.just(FieldType("byte")), st.binary(min_size=1, max_size=1)),
    )
)
def test_what_is_rendered_is_read_back(case: tuple[FieldType, Any]) -> None:
    """render_value and parse_value are inverse."""
    field_type, value = case
    text = render_value(field_type, value)
    assert parse_value(field_type, text) == value
    assert len(text.splitlines()) == 1

"""Strategies for parameter files and `-p` rules."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hypothesis import strategies as st

if TYPE_CHECKING:
    from hypothesis.strategies import SearchStrategy

WORDS = (
    "true", "True", "TRUE", "tRue", "false", "False", "yes", "Yes", "YES", "no", "on", "On", "ON", "off",
    "y", "Y", "n", "N", "null", "Null", "NULL", "~", "nan", "NaN", ".nan", ".NaN", ".NAN", "inf", "Inf",
    ".inf", "-.inf", "+.inf", ".Inf", "-inf", "infinity", "hello", "a b", "a:b", "a#b", "a #b", "é", "-",
    "+", ".", "..", "e", "1e", "0x", "--", "''", '""', "'1'", '"1"', "'true'", "'it''s'", '"a\\nb"',
    '"\\x41"', "' '", "2001-01-01", "12:30", "1:2:3", "1,2", "=", "<<", "!!str 1", "!!int '1'", "!!float 1",
    "!!bool 'yes'", "!x 1", "*a", "&a 1", "%a", "@a", "`a`", "?", "? a"
)  # fmt: skip
"""Scalars for which YAML 1.1, YAML 1.2 and rcl have rules, or which look like others."""
INTEGERS = (
    "0", "-0", "+0", "1", "-1", "+1", "01", "08", "010", "-010", "0x10", "0X1f", "-0x1", "0o17", "0b101",
    "1_000", "_1", "1_", "9223372036854775807", "9223372036854775808", "-9223372036854775808",
    "-9223372036854775809", "99999999999999999999", "0x8000000000000000",
    "01777777777777777777777", "1 000", "٣", "0x", "0xg", "1l", "1u"
)  # fmt: skip
DOUBLES = (
    "0.0", "-0.0", "1.", ".5", "-.5", "+.5", "1.5", "1e3", "1E3", "1e+3", "1e-3", "1.e3", ".5e3", "e3",
    "1e3.0", "1.5.2", "1e400", "-1e400", "1e-400", "0x1p3", "0x1.8", "1.0f", "1d", "1_0.5", "1.0 ",
    "4.9e-324", "1.7976931348623157e308"
)  # fmt: skip

MIXED = st.text("0123456789+-.eExob_naif", min_size=1, max_size=6)
SCALARS = st.sampled_from((*WORDS, *INTEGERS, *DOUBLES)) | MIXED
# In brackets ROS 2's YAML parser refuses plain scalars with a colon, and an empty list has no type: these are
# cases of `test_parameters.py`.
ITEMS = SCALARS.filter(lambda text: ":" not in text)


def flow_lists(elements: SearchStrategy[str]) -> SearchStrategy[str]:
    """Return texts of lists in brackets."""
    return st.lists(elements, min_size=1, max_size=3).map(lambda each: f"[{', '.join(each)}]")


LISTS = st.one_of(
    flow_lists(st.sampled_from(("1", "2", "-3", "0x10", "010"))),
    flow_lists(st.sampled_from(("1.5", ".5", "1e3", "1", ".nan"))),
    flow_lists(st.sampled_from(("true", "yes", "False", "1", "y"))),
    flow_lists(st.sampled_from(("a", "'1'", '"b"', "1", "true", "''", "null", "a b"))),
    flow_lists(ITEMS),
)
VALUES = SCALARS | LISTS

NODES = st.sampled_from(
    (
        *(
            "/**",
            "/*",
            "n",
            "/n",
            "*",
            "**",
            "/**/n",
            "/*/n",
            "other",
            "/other",
            "n*",
            "*n",
            "/ns/n",
            "''",
            "/",
        ),
        *("//n", "1", "true", "~", "n/", "/**/**", "ns"),
    )
)
NAMES = st.sampled_from(
    (
        *(
            "a",
            "b",
            "on",
            "off",
            "yes",
            "010",
            "1",
            "1.5",
            "null",
            "~",
            "'q'",
            '"p"',
            "é",
            "a-b",
            "A",
            "a b",
            "a.",
        ),
        *(".a", "2001-01-01", "''", "ros__parameters", "x" * 300, "c.d"),
    )
)


@st.composite
def parameters(draw: st.DrawFn, indent: str, depth: int = 0) -> str:
    """Return lines with parameters, and with parameters within parameters."""
    lines: list[str] = []
    for name in draw(st.lists(NAMES, min_size=1, max_size=3, unique=True)):
        kind = draw(st.sampled_from(("value", "value", "value", "items", "parameters")))
        if kind == "parameters" and depth < 2:
            lines += [f"{indent}{name}:", draw(parameters(indent + "  ", depth + 1))]
        elif kind == "items":
            items = draw(st.lists(ITEMS, min_size=1, max_size=3))
            lines += [f"{indent}{name}:", *(f"{indent}- {item}" for item in items)]
        else:
            value = draw(st.sampled_from(("1", "1.5", "text", "true")) | VALUES)
            lines.append(f"{indent}{name}: {value}{draw(st.sampled_from(('', '', ' # why', '  ')))}")
    return "\n".join(lines)


@st.composite
def files(draw: st.DrawFn) -> str:
    """Return the text of a parameter file."""
    lines = [draw(st.sampled_from(("", "", "", "# why", "---", "- a")))]
    for node in draw(st.lists(NODES, min_size=1, max_size=3, unique=True)):
        inner = draw(
            st.sampled_from(("ros__parameters", "ros__parameters", "ros__parameters", "parameters", "n"))
        )
        layout = draw(st.sampled_from(("node", "node", "node", "namespace", "empty")))
        if layout == "namespace":
            lines += [f"{node}:", "  n:", f"    {inner}:", draw(parameters("      "))]
        elif layout == "empty":
            lines += [f"{node}:", f"  {inner}:{draw(st.sampled_from(('', ' {}', ' 1', ' ~')))}"]
        else:
            lines += [f"{node}:", f"  {inner}:", draw(parameters("    "))]
    return "\n".join(lines) + draw(st.sampled_from(("\n", "", "\n...\n", "\n---\n")))

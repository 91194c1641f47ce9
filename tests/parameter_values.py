"""Values and names of parameters for property tests: all kinds, and texts that look like others in YAML."""

from __future__ import annotations

from typing import Any, Final

from hypothesis import strategies as st

_INT64: Final = 1 << 63
_WORDS: Final = """
    y n Y N on off yes no true False null ~ Null 1 010 08 0x1F 0x1p3 1e3 1e-3 .5 -.5 5. 12:30 1_000 0b11 0o17
    nan inf -Infinity .inf .NAN nan(1) = << - -- --- ... ? : , [ ] { } # & * ! | > % @ ` ' "
"""
WORDS: Final = (
    *_WORDS.split(),
    *("a:", "-a", "a#b", "a #b", "a: b", "- a", "2020-01-01", "x:y", "!!str 1", "*a", "", " ", "a ", " a"),
    *(
        "\n",
        "\t",
        "a\nb",
        "a\n\nb\n",
        "\r",
        "\x7f",
        "\x85",
        "\xa0",
        "\u2028",
        "\ufeff",
        "é",
        "😀",
        "\U000e0001",
    ),
    *("ros__parameters", "9" * 30, "4e-320", "/**", "a" * 2000),
)
_characters: Final = st.characters(exclude_categories=["Cs"], exclude_characters="\0")
texts: Final = st.sampled_from(WORDS) | st.text(_characters) | st.text("01.eExX+-_ynaif:#, []'", max_size=6)
"""Without NUL, at which rcl cuts strings."""
_integers: Final = st.integers(-_INT64, _INT64 - 1)
_scalars: Final = st.booleans() | _integers | st.floats() | texts
values: Final[st.SearchStrategy[Any]] = _scalars | st.one_of(
    *(st.lists(each, min_size=1, max_size=5) for each in (st.booleans(), _integers, st.floats(), texts))
)
"""Not empty lists, which rcl takes for no value, and no bytes, which it does not know."""
_levels: Final = st.sampled_from(["a", "b", "on", "1", "", "<<", "x y", "ros__parameters", "k" * 1100])
names: Final = (
    st.lists(_levels | st.text(_characters, min_size=1, max_size=4), min_size=1, max_size=4)
    .map(".".join)
    .filter(bool)
)
parameters: Final = st.dictionaries(names, values, min_size=1, max_size=5)

"""Patterns of names: whole tokens, one or any number of them, at a cost independent of their number."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from broker.access.patterns import MAX_PATTERN_LENGTH, PatternSet, pattern_fault
from tests.calls import calls_of


@pytest.mark.parametrize(
    ("pattern", "name", "matches"),
    [
        ("/a", "/a", True),
        ("/a", "/ab", False),
        ("/a", "/a/b", False),
        ("/robot1/*/pose", "/robot1/arm/pose", True),
        ("/robot1/*/pose", "/robot1/pose", False),
        ("/robot1/*/pose", "/robot1/arm/left/pose", False),
        ("/robot1/**", "/robot1", True),
        ("/robot1/**", "/robot1/arm/left/pose", True),
        ("/robot1/**", "/robot10/pose", False),
        ("/**/pose", "/pose", True),
        ("/**/pose", "/a/b/pose", True),
        ("/**/pose", "/a/pose/b", False),
        ("/**", "/anything/at/all", True),
        ("/**/**/a", "/a", True),
        ("/*", "/a", True),
        ("/*", "/a/b", False),
    ],
)
def test_a_pattern_matches_by_whole_tokens(pattern: str, name: str, matches: bool) -> None:
    """`*` is one token, `**` any number; a literal is never a prefix."""
    assert pattern_fault(pattern) == ""
    assert (PatternSet((pattern,)).find(name) == pattern) is matches


@pytest.mark.parametrize(
    "pattern",
    [
        "",
        "a",
        "a/b",
        "/",
        "/a/",
        "//a",
        "/a*",
        "/***",
        "/a b",
        "/1a",
        "/ä",
        "/a\n",
        "/{ns}",
        "/~",
        "/" + "a" * 300,
    ],
)
def test_an_invalid_pattern_has_a_fault(pattern: str) -> None:
    """Parts of tokens, empty tokens and everything that no name has are refused."""
    assert pattern_fault(pattern)


TOKENS = st.sampled_from(["a", "b", "c"])
NAMES = st.lists(TOKENS, min_size=1, max_size=6).map(lambda tokens: "/" + "/".join(tokens))
PATTERNS = st.lists(st.sampled_from(["a", "b", "*", "**"]), min_size=1, max_size=5).map(
    lambda tokens: "/" + "/".join(tokens)
)


def _expression(pattern: str) -> re.Pattern[str]:
    parts = {"**": "(?:/[^/]+)*", "*": "/[^/]+"}
    return re.compile("".join(parts.get(token, f"/{token}") for token in pattern[1:].split("/")))


@given(st.lists(PATTERNS, max_size=6).map(tuple), NAMES)
def test_a_set_matches_like_its_patterns_one_by_one(patterns: tuple[str, ...], name: str) -> None:
    """The tree finds a pattern exactly if one of them matches as a regular expression, and one that does."""
    fitting = {pattern for pattern in patterns if _expression(pattern).fullmatch(name)}
    found = PatternSet(patterns).find(name)
    assert (found in fitting) if fitting else found is None


def _calls(patterns: tuple[str, ...], name: str) -> int:
    """Count the function calls of one search."""
    tree = PatternSet(patterns)
    return calls_of(lambda: tree.find(name))


def test_a_search_costs_the_same_among_a_thousand_patterns() -> None:
    """A thousand namespaces cost no more than one."""
    many = tuple(f"/robot{number}/**" for number in range(1000))
    assert _calls(many, "/robot7/arm/pose") == _calls(("/robot7/**",), "/robot7/arm/pose")


def test_no_pattern_can_backtrack() -> None:
    """Case 19: a pattern of many `**` costs at most its length times the name's."""
    pattern = "/" + "/".join(["**", "a"] * 40)
    assert len(pattern) <= MAX_PATTERN_LENGTH
    name = "/" + "/".join("a" * 120) + "/b"
    assert PatternSet((pattern,)).find(name) is None
    assert _calls((pattern,), name) < 80 * 4 * 121

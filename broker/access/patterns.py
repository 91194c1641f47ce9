"""Patterns of names, token by token: `/robot1/*/pose`, `/robot1/**`.

`*` stands for exactly one token, `**` for any number of tokens, none included. A set of patterns is kept as a
tree, so that a name costs the same among a thousand patterns as among ten, and no pattern can backtrack.
"""

from __future__ import annotations

import re
from typing import Final

MAX_PATTERN_LENGTH: Final = 300
"""Characters of a pattern; names are shorter."""

ONE: Final = "*"
ANY: Final = "**"

_TOKEN: Final = re.compile(r"\*\*?|[A-Za-z_][A-Za-z0-9_]*")


def pattern_fault(pattern: str) -> str:
    """Return what is wrong with a pattern, in words; "" if it is valid."""
    if not pattern.startswith("/"):
        return "it must begin with '/'"
    if len(pattern) > MAX_PATTERN_LENGTH:
        return f"it must not be longer than {MAX_PATTERN_LENGTH} characters"
    if not all(_TOKEN.fullmatch(token) for token in pattern[1:].split("/")):
        return "between slashes it needs a name (letters, digits and '_', no digit first), '*' or '**'"
    return ""


class _Branch:
    """One node of the tree: the patterns that have the same tokens up to here."""

    __slots__ = ("pattern", "repeats", "tokens")

    def __init__(self, *, repeats: bool = False) -> None:
        self.tokens: dict[str, _Branch] = {}
        self.repeats = repeats
        """Whether it was reached by `**`, and so remains after every further token."""
        self.pattern = ""
        """The pattern that ends here."""


class PatternSet:
    """A set of valid patterns.

    Args:
        patterns: The patterns.
    """

    def __init__(self, patterns: tuple[str, ...]) -> None:
        self._root = _Branch()
        for pattern in patterns:
            branch = self._root
            for token in pattern[1:].split("/"):
                branch = branch.tokens.setdefault(token, _Branch(repeats=token == ANY))
            branch.pattern = pattern

    def find(self, name: str) -> str | None:
        """Return a pattern that matches a full name, or None."""
        branches: dict[_Branch, None] = {}
        _enter(self._root, branches)
        for token in name[1:].split("/"):
            following: dict[_Branch, None] = {}
            for branch in branches:
                if branch.repeats:
                    _enter(branch, following)
                for key in (token, ONE):
                    if (further := branch.tokens.get(key)) is not None:
                        _enter(further, following)
            if not following:
                return None
            branches = following
        return next((branch.pattern for branch in branches if branch.pattern), None)


def _enter(branch: _Branch | None, branches: dict[_Branch, None]) -> None:
    """Add a branch, and those that a `**` without a token leads to."""
    while branch is not None and branch not in branches:
        branches[branch] = None
        branch = branch.tokens.get(ANY)

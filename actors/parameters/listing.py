"""Lists parameter names, all or those at and below prefixes: ROS 2's `list_parameters`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.parameters.types import ListParametersResult

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

SEPARATOR: Final = "."
"""The separator between the levels of a parameter's name."""


def list_names(names: Iterable[str], prefixes: Sequence[str], depth: int) -> ListParametersResult:
    """List all names, or those at and below the prefixes.

    Args:
        names: The names.
        prefixes: Without a dot at the end; none means all names.
        depth: Levels below each prefix, or from the top without prefixes; 0 for all.

    Returns:
        The names, and what precedes the last dot of each.

    Raises:
        TypeError: `prefixes` is a str.
        ValueError: `depth` is negative.
    """
    # A str is a sequence of str, too: "abc" would list the parameters below a, b and c.
    if isinstance(prefixes, str):
        raise TypeError("prefixes must be a sequence of str, not a str")
    if depth < 0:
        raise ValueError("depth must not be negative")
    wanted = frozenset(prefixes)
    found = [name for name in names if _is_listed(name, wanted, depth)]
    parents = (name.rpartition(SEPARATOR)[0] for name in found)
    return ListParametersResult(found, [*dict.fromkeys(filter(None, parents))])


def _is_listed(name: str, prefixes: frozenset[str], depth: int) -> bool:
    """Return whether a name is listed: one look-up for each level, however many prefixes are wanted."""
    if not prefixes:
        return not depth or name.count(SEPARATOR) < depth
    if name in prefixes:
        return True
    levels, (parent, dot, _) = 1, name.rpartition(SEPARATOR)
    while dot and (not depth or levels <= depth):
        if parent in prefixes:
            return True
        levels, (parent, dot, _) = levels + 1, parent.rpartition(SEPARATOR)
    return False

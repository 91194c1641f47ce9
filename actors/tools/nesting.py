"""The nesting depth of YAML, checked before PyYAML, which recurses for each level, builds objects."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable


def deeper_than(levels: int, events: Iterable[Any]) -> Any:
    """Return the first event that is nested too deeply; None if there is none.

    Args:
        levels: The levels that are allowed.
        events: PyYAML's parse events.
    """
    depth = 0
    for event in events:
        kind = type(event).__name__
        if kind in {"SequenceStartEvent", "MappingStartEvent"}:
            depth += 1
            if depth > levels:
                return event
        elif kind in {"SequenceEndEvent", "MappingEndEvent"}:
            depth -= 1
    return None

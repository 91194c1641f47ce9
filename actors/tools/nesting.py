"""How deeply YAML is nested: looked at before PyYAML, which recurses for each level, builds anything."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable


def deeper_than(levels: int, events: Iterable[Any]) -> Any:
    """Return the first of PyYAML's events that is nested deeper than so many levels; None: there is none."""
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

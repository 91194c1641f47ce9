"""How deeply YAML is nested."""

from __future__ import annotations

import pytest
import yaml

from actors.tools.nesting import deeper_than


@pytest.mark.parametrize("text", ["[[[]]]", "{a: {b: {c: 1}}}", "- [{}]", "[a, [[]], b]"])
def test_levels_are_counted(text: str) -> None:
    """Lists and maps alike; the first that is too deep is reported, and where it is."""
    assert deeper_than(3, yaml.parse(text)) is None
    found = deeper_than(2, yaml.parse(text))
    assert text[found.start_mark.index] in "[{c"


def test_what_stands_side_by_side_is_not_deep() -> None:
    """However much of it there is."""
    assert deeper_than(2, yaml.parse(f"[{'[1], ' * 1000}]")) is None

"""Findings of one kind stay few."""

from __future__ import annotations

import pytest

from actors.tools.check import MAX_LISTED, Check, Status, summed_up


def test_nothing_found_is_ok() -> None:
    """Then there is one line that says so."""
    assert summed_up("types", [], "all agree") == [Check("types", "ok", "all agree")]


@pytest.mark.parametrize("last", ["warn", "fail"])
def test_many_findings_are_counted(last: Status) -> None:
    """The first are reported; the count of the others is as bad as the worst of them."""
    found = [Check("types", "warn", str(number)) for number in range(MAX_LISTED + 2)]
    found.append(Check("types", last, "last"))
    shown = summed_up("types", found, "all agree")
    assert shown[:-1] == found[:MAX_LISTED]
    assert shown[-1] == Check("types", last, "and 3 more of this kind")

"""The result of one check: a finding, its status, and a remedy."""

from __future__ import annotations

from typing import Final, Literal, NamedTuple

Status = Literal["ok", "warn", "fail", "skip"]

MAX_LISTED: Final = 10
"""Findings of one kind that are listed; further ones are counted."""


class Check(NamedTuple):
    """The result of one check.

    Attributes:
        name: The subject of the check, in a word or two.
        status: "ok"; "warn" for possible and "fail" for certain trouble; "skip" if it was not checked.
        finding: One line of text.
        remedy: How to correct it; empty if nothing needs to be done.
    """

    name: str
    status: Status
    finding: str
    remedy: str = ""


def summed_up(name: str, found: list[Check], otherwise: str) -> list[Check]:
    """Return the findings of one kind, shortened to the first ones and a count if there are many.

    Args:
        name: What was checked.
        found: The findings.
        otherwise: The finding of the "ok" to return if there are none.
    """
    if not found:
        return [Check(name, "ok", otherwise)]
    if len(found) > MAX_LISTED:
        rest = len(found) - MAX_LISTED
        worst: Status = "fail" if any(each.status == "fail" for each in found[MAX_LISTED:]) else "warn"
        return [*found[:MAX_LISTED], Check(name, worst, f"and {rest} more of this kind")]
    return found

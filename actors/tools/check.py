"""One thing that was looked at: what was found, how bad it is, and what to do about it."""

from __future__ import annotations

from typing import Final, Literal, NamedTuple

Status = Literal["ok", "warn", "fail", "skip"]

MAX_LISTED: Final = 10
"""Findings of one kind that are told one by one; the rest are counted."""


class Check(NamedTuple):
    """What was found.

    Attributes:
        name: What was looked at: a word or two.
        status: "ok"; "warn", it may hurt; "fail", it will; "skip", it could not be looked at.
        finding: One line.
        remedy: What to do about it; empty if there is nothing to do.
    """

    name: str
    status: Status
    finding: str
    remedy: str = ""


def summed_up(name: str, found: list[Check], otherwise: str) -> list[Check]:
    """Return findings of one kind: an "ok" if there are none, the first and a count if there are many."""
    if not found:
        return [Check(name, "ok", otherwise)]
    if len(found) > MAX_LISTED:
        rest = len(found) - MAX_LISTED
        worst: Status = "fail" if any(each.status == "fail" for each in found[MAX_LISTED:]) else "warn"
        return [*found[:MAX_LISTED], Check(name, worst, f"and {rest} more of this kind")]
    return found

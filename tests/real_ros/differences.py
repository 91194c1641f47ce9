"""Where callboard is different from real ROS 2 on purpose, and the comparison of their answers."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import dataclass
from difflib import unified_diff
from typing import Final

import pytest


@dataclass(frozen=True)
class Difference:
    """A case in which callboard's answer is another one.

    Attributes:
        kind: What is compared, such as "program": a test has one kind.
        case: The program, line or value, or a name for a class of them.
        reason: What callboard does instead, and why; a sentence for users.
    """

    kind: str
    case: str
    reason: str


DIFFERENCES: Final[tuple[Difference, ...]] = ()

_CASES: Final = {(each.kind, each.case) for each in DIFFERENCES}
_equal: Final[Counter[str]] = Counter()
_listed: Final[Counter[str]] = Counter()


def agree(kind: str, case: str, *, real: object, callboard: object) -> None:
    """Fail unless two answers are equal, or differ and are listed.

    1, 1.0 and True are different answers, and NaN is equal to itself.

    Args:
        kind: What is compared.
        case: Of which question: as it is in `DIFFERENCES` if it is there.
        real: Real ROS 2's answer, of what JSON has.
        callboard: Callboard's.
    """
    truth, answer = (
        json.dumps(each, indent=1, sort_keys=True, default=list).splitlines() for each in (real, callboard)
    )
    if (kind, case) in _CASES:
        assert answer != truth, f"{kind} {case} is equal: remove it from DIFFERENCES"
        _listed[kind] += 1
        return
    if answer != truth:
        text = "\n".join(unified_diff(truth, answer, "real ROS 2", "callboard", lineterm=""))
        pytest.fail(f"{kind} {case}:\n{text}", pytrace=False)
    _equal[kind] += 1


def counts() -> dict[str, tuple[int, int]]:
    """Return for each kind how many cases of this process were equal, and how many are listed."""
    return {kind: (_equal[kind], _listed[kind]) for kind in _equal | _listed}


def reference() -> str:
    """Return the list as a section in Markdown."""
    rows = [f"| {each.kind} | {each.case} | {each.reason} |" for each in DIFFERENCES]
    return "\n".join(["| kind | case | callboard |", "|---|---|---|", *rows]) + "\n"

"""The threat model names options and limits that exist, with their values."""

from __future__ import annotations

import re
from pathlib import Path

from broker.access import admission
from broker.daemon.configuration import SETTINGS
from proto import limited_log, limits
from proto.aio import read_budget
from tests.hostile.numbers import HIGHEST, find_tests, numbers_in

ROOT = Path(__file__).resolve().parent.parent
TEXT = (ROOT / "docs" / "security.md").read_text(encoding="utf-8")
TITLE = "## What is protected against whom"
HEADER = "| attacker | tries to | what protects | options | proved by |\n|---|---|---|---|---|\n"
TABLE = TEXT.partition(HEADER)[2].partition("\n\n")[0]
ROWS = [[cell.strip() for cell in line.strip("|").split("|")] for line in TABLE.splitlines()]


def test_each_row_names_its_proof() -> None:
    """Numbers of cases that have tests, or files of tests; each case is in some row."""
    tests, cases = find_tests(), set[int]()
    assert len(ROWS) > 20
    for row in ROWS:
        assert len(row) == 5, row
        numbers = numbers_in(f"Case {row[-1]}")
        files = re.findall(r"`([^`]+)`", row[-1])
        assert numbers | set(files), row
        assert [number for number in numbers if not tests.get(number)] == [], row
        assert [file for file in files if not (ROOT / file).is_file()] == [], row
        cases |= numbers
    assert cases >= set(range(1, HIGHEST + 1))


def test_each_attacker_is_introduced() -> None:
    """The list above the table has the kind of attacker of each row."""
    introduced = re.findall(r"\*\*([a-z ]+)\*\*", TEXT.partition(TITLE)[2].partition(HEADER)[0])
    pattern = re.compile(f"(?:{'|'.join(introduced)})s?(?: .*)?|nobody")
    assert [row[0] for row in ROWS if not pattern.fullmatch(row[0])] == []


def test_the_threat_model_names_options_that_exist() -> None:
    """Each option in it is one of the broker's."""
    named = set(re.findall(r"`(--[a-z-]+)", TEXT.partition(TITLE)[2]))
    assert len(named) > 15
    assert named <= {each.flag for each in SETTINGS.values()} | {"--json", "--config"}


def test_the_threat_model_has_the_limits_of_the_code() -> None:
    """Its numbers are those of the constants."""
    assert f"at most {limits.MAX_HELLO_BYTES // 1024} KiB" in TEXT
    failures, period = admission.MAX_FAILURES, admission.FAILURE_PERIOD_SEC
    assert f"after {failures} failures of one address within {period:g} s" in TEXT
    share, frames, budget = read_budget.SHARE_SEC, read_budget.SHARE_FRAMES, read_budget.BUDGET_SEC
    assert f"{share * 1000:g} ms or {frames} frames of a turn of the event loop" in TEXT
    assert f"all together {budget * 1000:g} ms" in TEXT
    lines, sums = limited_log.MAX_LINES, limited_log.PERIOD_SEC
    assert f"at most {lines} for one reason, and then a sum\nevery {sums:g} s" in TEXT


def test_the_links_of_the_policy_resolve() -> None:
    """SECURITY.md is not below docs."""
    policy = (ROOT / "SECURITY.md").read_text(encoding="utf-8")
    links = re.findall(r"\]\(([^)\s]+)\)", policy)
    assert links
    assert [link for link in links if not (ROOT / link).is_file()] == []

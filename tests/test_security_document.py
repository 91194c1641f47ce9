"""The threat model names options and limits that exist, with their values."""

from __future__ import annotations

import re
from pathlib import Path

from broker.access import admission
from broker.daemon.configuration import SETTINGS
from proto import limited_log, limits
from proto.aio import read_budget

ROOT = Path(__file__).resolve().parent.parent
TEXT = (ROOT / "docs" / "security.md").read_text(encoding="utf-8")


def test_the_threat_model_names_options_that_exist() -> None:
    """Each option in it is one of the broker's."""
    named = set(re.findall(r"`(--[a-z-]+)", TEXT.partition("## Who may attack")[2]))
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

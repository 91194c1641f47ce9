"""A small run of each measurement that only a checkout has; speed is not checked."""

from __future__ import annotations

import argparse
import asyncio
import sys
from typing import Any

import pytest

from benchmarks import resilience
from benchmarks.faults import freeze, presence, restart
from benchmarks.harness import processes
from benchmarks.harness.own import callboard
from benchmarks.harness.results import Entrant, Results
from benchmarks.harness.runner import plan, run
from benchmarks.harness.workloads import WORKLOADS
from tests.fork_server.client import FORKED


@pytest.fixture
def _forked(monkeypatch: pytest.MonkeyPatch) -> None:
    """The fork server starts brokers and roles; there is no launcher, which it cannot replace."""
    start = asyncio.create_subprocess_exec

    def fork(*command: str, **options: Any) -> Any:
        executable = FORKED if command[0] == sys.executable else None
        return start(*command, executable=executable, **options)

    monkeypatch.setattr(asyncio, "create_subprocess_exec", fork)
    monkeypatch.setattr(processes, "killed_with_parent", lambda command: command)


@pytest.mark.long
@pytest.mark.usefixtures("_forked")
async def test_nodes_of_one_process_and_messages_at_a_pace_are_measured() -> None:
    """W11 and W12: both roles of a process are counted once."""
    contender = callboard()
    workloads = [each for each in WORKLOADS if each.id in {"W11", "W12"}]
    for seconds in (0.1, 1.0, 10.0):  # a busy machine needs longer for messages enough
        results = Results(
            machine={}, date="", command="", seconds=seconds, repetitions=1, entrants=[Entrant.of(contender)]
        )
        await run(plan(workloads, [contender], 1), results, lambda progress: None)
        if not results.failures:
            break
    assert results.failures == []
    measured = {f"{each.workload} {each.case}": each.figures for each in results.samples}
    assert {"rate", "mb_s", "cpu_us.stream_together"} <= measured["W11 1 MiB"].keys()
    assert {"rate", "p50_us", "cpu_us.calls_together"} <= measured["W11 one call at a time"].keys()
    for size in ("256 B", "64 KiB", "1 MiB"):
        assert "rate" in measured[f"W12 {size}"]


async def test_a_round_measures_a_death_and_a_start() -> None:
    """One process is waited for, called and killed."""
    found = await presence.measure(1, busy=False)
    assert len(found.errors) == len(found.waits) == len(found.starts) == 1
    assert 0 < found.waits[0] < found.starts[0]
    assert presence.presence_section({"idle": found}).rows[0][:2] == ["idle", "1"]
    assert len(presence.wait_section({"idle": found}).rows) == 2


async def test_a_frozen_server_is_measured_both_ways() -> None:
    """Suspension after the keepalive limit and return are measured."""
    (found,) = await freeze.measure(1, [0.3])
    assert len(found.errors) == len(found.returns) == 1
    assert found.errors[0] > 0.1


@pytest.mark.usefixtures("_forked")
async def test_a_small_ring_survives_its_broker(capsys: pytest.CaptureFixture[str]) -> None:
    """All nodes return, every message is accounted for, and no call hangs."""
    plan = restart.Plan(nodes=4, processes=2, rate=20, pauses_s=[0.0], settle_s=0.1)
    found = restart.section(await restart.measure(plan))
    assert found.failures == []
    assert found.figures["restarts"][0]["failed"]["count"] == 4
    assert found.figures["totals"]["published"] > 4


@pytest.mark.usefixtures("_forked")
async def test_a_short_churn_is_sampled(capsys: pytest.CaptureFixture[str]) -> None:
    """All reset connections are restored at the end, so that open files can be compared."""
    options = argparse.Namespace(what="churn", lives=40)
    (section,) = await resilience.measure(options)
    assert section.figures["resets"] > 0
    assert [sample["lives"] for sample in section.figures["samples"]][:3] == [0, 1, 2]
    assert not any("open" in failure for failure in section.failures)
    assert capsys.readouterr().out.startswith("churn  ")

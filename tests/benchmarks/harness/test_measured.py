"""A short run of workloads that only a checkout has; speed is not checked."""

from __future__ import annotations

from benchmarks.harness.own import callboard
from benchmarks.harness.results import Entrant, Results
from benchmarks.harness.runner import plan, run
from benchmarks.harness.workloads import WORKLOADS


async def test_nodes_of_one_process_and_messages_at_a_pace_are_measured() -> None:
    """W11 and W12: both roles of a process are counted once."""
    contender = callboard()
    results = Results(
        machine={}, date="", command="", seconds=0.1, repetitions=1, entrants=[Entrant.of(contender)]
    )
    workloads = [each for each in WORKLOADS if each.id in {"W11", "W12"}]
    await run(plan(workloads, [contender], 1), results, lambda progress: None)
    assert results.failures == []
    measured = {f"{each.workload} {each.case}": each.figures for each in results.samples}
    assert {"rate", "mb_s", "cpu_us.stream_together"} <= measured["W11 1 MiB"].keys()
    assert {"rate", "p50_us", "cpu_us.calls_together"} <= measured["W11 one call at a time"].keys()
    for size in ("256 B", "64 KiB", "1 MiB"):
        assert "rate" in measured[f"W12 {size}"]

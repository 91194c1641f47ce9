"""The benchmark of the page: its arithmetic and its judgements, without a browser."""

from __future__ import annotations

import pytest

from benchmarks import web
from benchmarks.browser import interaction, loading, memory, node_cost, throughput
from benchmarks.browser.site import Memory, percent


def samples(mb_per_minute: float) -> list[memory.Sample]:
    """Return samples of ten minutes; the first one is far from the line of the others."""
    heaps = [10e6, *(20e6 + minute * mb_per_minute * 1e6 for minute in range(1, 10))]
    return [memory.Sample(minute, Memory(round(heap), 100, 10)) for minute, heap in enumerate(heaps)]


def test_ratios_are_summarized_as_differences_in_percent() -> None:
    """The median with its error, and quartiles, in any order."""
    assert percent([1.1, 0.9, 1.0, 1.05, 0.95]) == ["+0.0 ± 4.2 %", "-5.0 %", "+5.0 %"]


def test_a_heap_that_grows_is_a_failure() -> None:
    """A plot that fills its buffer in the first minute is none."""
    assert memory.growth(samples(0.5)[1:]) == pytest.approx({"heap_bytes": 4e6, "nodes": 0, "listeners": 0})
    assert memory.section({"plot": samples(0.0)}).failures == []
    (failure,) = memory.section({"plot": samples(0.5)}).failures
    assert failure.startswith("plot: the heap grows by 40.0 %")


def test_a_slow_answer_to_inputs_is_a_failure() -> None:
    """By the 95th percentile."""
    found = interaction.section({"zoom": [20.0] * 20, "sort": [90.0] * 10 + [120.0] * 10}, {"graph": []}, 500)
    assert [failure.partition(":")[0] for failure in found.failures] == ["sort"]


def test_a_page_that_costs_the_broker_throughput_is_a_failure() -> None:
    """By the median of the ratios of pairs, whatever the speed of the machine does meanwhile."""
    speeds = [1.0, 0.5, 0.8]
    pairs = [(throughput.Round(1000 * speed, 1.0), throughput.Round(960 * speed, 1.0)) for speed in speeds]
    assert throughput.section(pairs).failures == []
    slower = [(without, with_page._replace(rate=0.98 * with_page.rate)) for without, with_page in pairs]
    assert len(throughput.section(slower).failures) == 1


def test_a_page_that_is_too_large_is_a_failure() -> None:
    """All files together."""
    loads = loading.Loads(cold=[400.0], warm=[300.0], cold_bytes=[200_000], warm_bytes=[10_000])
    assert loading.section(loading.Loading({"demo": loads}, 400 * 1024)).failures == []
    assert len(loading.section(loading.Loading({"demo": loads}, 401 * 1024)).failures) == 1


def test_costs_of_a_node_are_compared_in_pairs() -> None:
    """The difference is the median of the ratios."""
    pairs = {name: [(1.0, 1.02), (2.0, 2.04), (4.0, 4.08)] for name in node_cost.FIGURES}
    assert all(row[4] == "+2.0 ± 0.0 %" for row in node_cost.section(pairs).rows)


def test_an_unknown_measurement_is_refused() -> None:
    """With the exit code of a usage error."""
    assert web.parse(["memory", "--minutes", "2"]).minutes == 2
    with pytest.raises(SystemExit):
        web.parse(["everything"])

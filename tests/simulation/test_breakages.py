"""The checks can fail: they find each deliberate breakage within a few histories."""

from __future__ import annotations

import warnings

import pytest

from tests.simulation.killing_seeds import BREAKAGES, read_table


@pytest.mark.timeout(900)  # all seeds, where the table's does not find it any more
@pytest.mark.filterwarnings("default:.*killing_seeds:UserWarning")
@pytest.mark.parametrize("promise", BREAKAGES)
def test_a_broken_promise_is_found(promise: str) -> None:
    """For each promise, a product that breaks it is detected; if not by the table's seed, then by another."""
    breakage, known = BREAKAGES[promise], read_table().get(promise)
    others = (seed for seed in breakage.seeds if seed != known)
    if known is not None and breakage.found_after(known) is not None:
        return
    seed = next((seed for seed in others if breakage.found_after(seed) is not None), None)
    assert seed is not None, f"{promise!r} may fail unseen"
    warnings.warn(
        f"Seed {seed} finds a breakage of {promise!r}, and {known} does not: write it to killing_seeds.json,"
        " or run python -m tests.simulation.killing_seeds",
        stacklevel=1,
    )

"""The checks can fail: they find each deliberate breakage within a few histories."""

from __future__ import annotations

import pytest

from tests.simulation.breakages import BREAKAGES
from tests.simulation.histories import live

SEEDS = 30
"""Histories in which a breakage has to show."""


@pytest.mark.parametrize("promise", BREAKAGES)
def test_a_broken_promise_is_found(promise: str) -> None:
    """For each promise, a product that breaks it is detected."""
    breakage, calm = BREAKAGES[promise]
    with breakage():
        assert any(live(seed, calm=calm).wrong for seed in range(SEEDS)), f"{promise!r} may fail unseen"

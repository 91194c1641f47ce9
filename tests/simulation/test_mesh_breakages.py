"""The checks of a mesh can fail: they find each deliberate breakage within a few histories."""

from __future__ import annotations

import pytest

from tests.simulation.histories import live_in_mesh
from tests.simulation.mesh_breakages import BREAKAGES

SEEDS = 15
"""Histories in which a breakage has to show."""


@pytest.mark.parametrize("promise", BREAKAGES)
def test_a_broken_promise_of_a_mesh_is_found(promise: str) -> None:
    """For each promise, a mesh that breaks it is detected."""
    breakage, calm = BREAKAGES[promise]
    with breakage():
        found = any(live_in_mesh(seed, calm=calm).wrong for seed in range(1, 1 + SEEDS))
    assert found, f"{promise!r} may fail unseen"

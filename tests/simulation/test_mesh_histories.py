"""Histories of several brokers in a mesh: together they keep the promises of one."""

from __future__ import annotations

import pytest

from tests.simulation.histories import live_in_mesh


@pytest.mark.parametrize("calm", [True, False], ids=["calm", "troubled"])
def test_a_history_of_a_mesh_keeps_every_promise(mesh_seed: int, *, calm: bool) -> None:
    """Calm ones lose nothing with KEEP_ALL; troubled ones count every loss; all agree in the end."""
    history = live_in_mesh(mesh_seed, calm=calm)
    assert not history.wrong, history.wrong


@pytest.mark.long
def test_the_same_seed_gives_the_same_history_of_a_mesh() -> None:
    """A history is reproducible: every byte travels at the same time."""
    assert live_in_mesh(7, calm=False) == live_in_mesh(7, calm=False)

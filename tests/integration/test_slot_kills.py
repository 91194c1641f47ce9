"""Processes that are killed at each step of a slot's life in shared memory leave nothing, and mix nothing."""

from __future__ import annotations

import random
import sys
from typing import TYPE_CHECKING, Final

import pytest

from tests.integration.slot_kills import calls_before_death, survivors
from tests.integration.slot_victims import STEPS
from tests.seams.limits import set_limits

if TYPE_CHECKING:
    from tests.integration.conftest import System

pytestmark = [
    pytest.mark.skipif(sys.platform != "linux", reason="arenas are memfds"),
    pytest.mark.timeout(300),
]


OF_BROKERS: Final = [name for name, step in STEPS.items() if step.role == "broker"]


@pytest.mark.parametrize(
    "names",
    [
        [name for name, step in STEPS.items() if step.role == "publisher"],
        [name for name, step in STEPS.items() if step.role == "reader"],
        OF_BROKERS[::3],  # nodes take a while to return; `make slot-kills` has all of them
    ],
    ids=["publisher", "reader", "broker"],
)
async def test_one_dies_at_each_step(
    system: System, names: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The others go on by reference; what arrives is whole, in order, and nothing of the dead is mapped."""
    set_limits(monkeypatch, reconnect_sec=0.1)
    chance = random.Random(0)
    async with survivors(system) as living:
        for name in names:
            await living.outlive(name, calls_before_death(name, chance))

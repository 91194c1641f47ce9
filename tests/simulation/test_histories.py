"""Whole histories of random worlds: the real broker and the real nodes keep their promises in each."""

from __future__ import annotations

import gc
import logging
import random
from contextlib import contextmanager
from typing import TYPE_CHECKING

from tests.simulation.checks import check
from tests.simulation.loop import SimulatedLoop, simulate
from tests.simulation.world import World, determined

if TYPE_CHECKING:
    from collections.abc import Iterator

TAIL = 60
"""Events that a failed history shows."""


def live(seed: int, *, calm: bool) -> str:
    """Live through one history; return its hash, or fail with what went wrong and how to see it again."""
    worlds: list[World] = []

    async def main(loop: SimulatedLoop) -> str:
        world = World(loop, seed, calm=calm)
        worlds.append(world)
        with determined(loop, seed), noted(world), world.steps.taken():
            await world.run()
            await check(world)
            return loop.network.digest

    state = random.getstate()
    random.seed(seed)
    # Collecting garbage closes abandoned generators: when, must not depend on what ran before.
    gc.collect()
    gc.disable()
    try:
        digest = simulate(main, seed)
    except Exception as error:
        raise AssertionError(_report(worlds[0], repr(error))) from error
    finally:
        gc.enable()
        random.setstate(state)
    if worlds[0].journal.complaints:
        raise AssertionError(_report(worlds[0], worlds[0].journal.complaints[0]))
    return digest


@contextmanager
def noted(world: World) -> Iterator[None]:
    """What is logged is part of the history, and is shown nowhere else."""

    class Notes(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            if not record.exc_info:
                world.journal.events.append(f"{world.loop.time():10.6f} {record.name}: {record.getMessage()}")

    log, notes = logging.getLogger("callboard"), Notes()
    propagate, log.propagate = log.propagate, False
    log.addHandler(notes)
    try:
        yield
    finally:
        log.removeHandler(notes)
        log.propagate = propagate


def _report(world: World, error: str) -> str:
    journal = world.journal
    name = "calm" if world.calm else "troubled"
    again = f"python -m pytest tests/simulation -k {name} --first-seed {world.seed} --seeds 1"
    lines = [f"seed {world.seed}: {error}", "", "the last events:", *journal.events[-TAIL:]]
    lines += ["", "complaints:", *journal.complaints[:10], "", f"to see it again: {again}"]
    return "\n".join(lines)


def test_a_calm_history_keeps_every_promise(history_seed: int) -> None:
    """Without faults: order, no loss where both keep all, sums that add up, latched values, a clean end."""
    live(history_seed, calm=True)


def test_a_troubled_history_keeps_every_promise(history_seed: int) -> None:
    """With faults: order, no duplicates, no hang, losses counted, and everything works again at the end."""
    live(history_seed, calm=False)


def test_the_same_seed_gives_the_same_history() -> None:
    """A history can be seen again: every byte travels at the same time."""
    assert live(7, calm=False) == live(7, calm=False)

"""One history from a seed: run it, check it, and report violations."""

from __future__ import annotations

import gc
import logging
import random
import re
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from actors.callbacks.budget import SHARE_SEC
from tests.simulation.checks import check
from tests.simulation.loop import SimulatedLoop, simulate
from tests.simulation.mesh_world import MeshWorld
from tests.simulation.world import World, determined

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

TAIL: Final = 60
"""Events that a failed history shows."""

FOLDERS: Final = re.compile('(?<=File ").*/')
"""Of a file in a traceback."""


@dataclass(frozen=True)
class History:
    """What one history was.

    Attributes:
        digest: A hash of every byte that has travelled, and when.
        turns: Turns of its loop.
        seconds: Virtual time that has passed.
        checks: Times that the sums were checked.
        struck: Faults, by kind.
        wrong: What broke a promise and how to see it again; empty if nothing did.
    """

    digest: str = ""
    turns: int = 0
    seconds: float = 0.0
    checks: int = 0
    struck: dict[str, int] = field(default_factory=dict)
    wrong: str = ""


def kind_of(*, calm: bool) -> str:
    """Return what histories with or without faults are called."""
    return "calm" if calm else "troubled"


def replay(seed: int, *, calm: bool, mesh: bool = False) -> str:
    """Return the command that shows a history again."""
    kind, name = kind_of(calm=calm), "test_mesh_histories" if mesh else "test_histories"
    return f"python -m pytest tests/simulation/{name}.py -k {kind} --first-seed {seed} --seeds 1"


def live_in_mesh(seed: int, *, calm: bool, until_complaint: bool = False) -> History:
    """Live through one history of a mesh."""
    return live(seed, calm=calm, make_world=MeshWorld, until_complaint=until_complaint)


def live(seed: int, *, calm: bool, make_world: type[World] = World, until_complaint: bool = False) -> History:
    """Live through one history; if asked to, only until its first complaint."""
    worlds: list[World] = []
    error = ""

    async def main(loop: SimulatedLoop) -> None:
        world = make_world(loop, seed, calm=calm)
        worlds.append(world)
        world.steps.until_complaint = until_complaint
        with determined(loop, seed), world.limits(), logged_to_journal(world), world.steps.installed():
            await world.run()
            await check(world)

    with _alone(seed):
        try:
            simulate(main, seed, clock_step_sec=SHARE_SEC / 10)
        except Exception as failure:  # noqa: BLE001 - whatever ends a history is what is wrong with it
            error = repr(failure)
    world = worlds[0]
    complaints = world.journal.complaints
    if complaints and (until_complaint or not error):
        error = complaints[0]
    return History(
        world.network.digest,
        world.loop.turns,
        world.loop.time(),
        world.steps.checks,
        dict(world.journal.struck),
        _report(world, error) if error else "",
    )


@contextmanager
def _alone(seed: int) -> Iterator[None]:
    """Chance is the seed's, and garbage is not collected: that closes abandoned generators at any time.

    What is logged is shown nowhere. It names files without their folders: log lines travel, and a seed's
    history shall be the same in each checkout.
    """
    make = logging.getLogRecordFactory()
    logging.setLogRecordFactory(partial(_record_without_folders, make))
    log = logging.getLogger("callboard")
    propagate, log.propagate = log.propagate, False
    silent = logging.NullHandler()
    log.addHandler(silent)
    state = random.getstate()
    random.seed(seed)
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
        random.setstate(state)
        log.removeHandler(silent)
        log.propagate = propagate
        logging.setLogRecordFactory(make)


def _record_without_folders(
    make: Callable[..., logging.LogRecord], *arguments: Any, **options: Any
) -> logging.LogRecord:
    record = make(*arguments, **options)
    record.pathname = record.filename
    if record.exc_info:
        record.exc_text = FOLDERS.sub("", logging.Formatter().formatException(record.exc_info))
        record.exc_info = None
    return record


@contextmanager
def logged_to_journal(world: World) -> Iterator[None]:
    """What is logged is part of the history."""

    class JournalHandler(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            if not record.exc_text:
                world.journal.events.append(f"{world.loop.time():10.6f} {record.name}: {record.getMessage()}")

    log, handler = logging.getLogger("callboard"), JournalHandler()
    log.addHandler(handler)
    try:
        yield
    finally:
        log.removeHandler(handler)


def _report(world: World, error: str) -> str:
    journal = world.journal
    lines = [f"seed {world.seed}: {error}", "", "the last events:", *journal.events[-TAIL:]]
    lines += ["", "complaints:", *journal.complaints[:10]]
    again = replay(world.seed, calm=world.calm, mesh=isinstance(world, MeshWorld))
    lines += ["", f"to see it again: {again}"]
    return "\n".join(lines)

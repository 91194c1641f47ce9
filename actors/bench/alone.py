"""Measures callboard alone, for `callboard bench`."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import TYPE_CHECKING

from actors.bench import machine
from actors.bench.own import callboard
from actors.bench.progress import ProgressBar
from actors.bench.results import Entrant, Results
from actors.bench.runner import plan, run

if TYPE_CHECKING:
    from collections.abc import Sequence

    from actors.bench.own import Loop, Transport
    from actors.bench.workloads import Workload


async def measure(
    workloads: Sequence[Workload],
    *,
    seconds: float,
    repetitions: int,
    loop: Loop,
    transport: Transport,
    rules: int,
    command: str,
) -> Results:
    """Run the workloads with a progress bar and return their results."""
    contender = callboard(loop=loop, transport=transport, rules=rules)
    results = Results(
        machine=machine.describe(),
        date=datetime.now(UTC).isoformat(timespec="seconds"),
        command=command,
        seconds=seconds,
        repetitions=repetitions,
        entrants=[Entrant.of(contender)],
    )
    with ProgressBar() as bar:
        await run(plan(workloads, [contender], repetitions), results, bar.draw)
    return results

"""The seed whose history finds each breakage: a table, because looking for it takes most of the time.

What happens in a history depends on the product, too: when the table's seed does not find a breakage any
more, others are tried. This command tries all, and writes the table again with the seeds that need the fewest
turns of the loop:

    python -m tests.simulation.killing_seeds
"""

from __future__ import annotations

import json
import multiprocessing
import sys
from collections import defaultdict
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

from tests.simulation import breakages, mesh_breakages
from tests.simulation.histories import live, live_in_mesh

if TYPE_CHECKING:
    from collections.abc import Callable
    from contextlib import AbstractContextManager

    from tests.simulation.histories import History

TABLE: Final = Path(__file__).with_suffix(".json")


class Breakage(NamedTuple):
    """How to break a promise, and the histories in which that has to show."""

    broken: Callable[[], AbstractContextManager[object]]
    calm: bool
    live: Callable[..., History]
    seeds: range

    def found_after(self, seed: int) -> int | None:
        """Return after how many turns of the loop this seed's history finds it; None if it does not."""
        with self.broken():
            history = self.live(seed, calm=self.calm, until_complaint=True)
        return history.turns if history.wrong else None


RARE: Final = "latched messages are for those who want them"
"""One history in thirty finds it: a volatile subscription has to appear while its publisher is away."""

BREAKAGES: Final = {
    **{
        promise: Breakage(*how, live, range(150 if promise == RARE else 30))
        for promise, how in breakages.BREAKAGES.items()
    },
    **{
        promise: Breakage(*how, live_in_mesh, range(1, 16))
        for promise, how in mesh_breakages.BREAKAGES.items()
    },
}
"""By promise: all of them."""


def read_table() -> dict[str, int]:
    """Return the seed by promise."""
    table: dict[str, int] = json.loads(TABLE.read_text())
    return table


def _found_after(job: tuple[str, int]) -> tuple[str, int, int | None]:
    promise, seed = job
    return promise, seed, BREAKAGES[promise].found_after(seed)


def main() -> int:
    """Try each seed with each breakage and write the table; return 1 if a breakage is not found."""
    found: dict[str, list[tuple[int, int]]] = defaultdict(list)
    jobs = [job for promise, breakage in BREAKAGES.items() for job in product([promise], breakage.seeds)]
    # Each in a process of its own: what a history that was cut off leaves behind must not reach another one.
    with multiprocessing.Pool(maxtasksperchild=1) as pool:
        for promise, seed, turns in pool.imap_unordered(_found_after, jobs):
            if turns is not None:
                found[promise].append((turns, seed))
    for promise, breakage in BREAKAGES.items():
        sys.stdout.write(f"{len(found[promise]):3} of {len(breakage.seeds)} seeds find it: {promise}\n")
    table = {promise: min(found[promise])[1] for promise in BREAKAGES if found[promise]}
    TABLE.write_text(json.dumps(table, indent=2) + "\n")
    return len(table) < len(BREAKAGES)


if __name__ == "__main__":
    sys.exit(main())

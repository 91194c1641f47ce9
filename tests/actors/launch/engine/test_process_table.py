"""Who is there, and in which state."""

from __future__ import annotations

from typing import Any

import pytest

from actors.launch.engine.process_table import ProcessEntry, ProcessState, ProcessTable
from actors.launch.planning.process_spec import MAX_PROCESSES, ProcessSpec


def spec(label: str = "a-1", **options: Any) -> ProcessSpec:
    """Return a process."""
    return ProcessSpec(label=label, name="a", command=("a",), shown="a", **options)


def test_the_living_are_counted() -> None:
    """In whatever state they live."""
    table = ProcessTable()
    first, second = table.add(spec("a-1")), table.add(spec("a-2"))
    assert first is not None
    assert second is not None
    for state, living in [("UP", 1), ("RESTARTING", 1), ("DEAD", 0), ("WAITING", 1)]:
        table.move(first, ProcessState[state], 5.0)
        assert table.living == living
    table.move(second, ProcessState.UP, 6.0)
    assert table.living == 2
    assert (first.since, first.generation) == (5.0, 4)


def test_the_dead_make_room() -> None:
    """The one that came first; the living do not."""
    table = ProcessTable()
    for number in range(MAX_PROCESSES):
        process = table.add(spec(f"a-{number}"))
        assert process is not None
        if number != 7:
            table.move(process, ProcessState.UP, 0.0)
    last = table.add(spec("b-1"))
    assert last is not None
    assert table.get("a-7") is None
    table.move(last, ProcessState.UP, 0.0)
    assert table.add(spec("b-2")) is None


@pytest.mark.parametrize("retries", [0, 2, -1])
def test_a_process_comes_again_as_often_as_it_may(retries: int) -> None:
    """Until it is forgiven; then as often again."""
    process = ProcessEntry(spec(respawn=True, respawn_max_retries=retries))
    for _ in range(2):
        times = sum(process.respawn_delay(0.0) is not None for _ in range(10))
        assert times == (retries if retries >= 0 else 10)
        process.reset_respawns()
    assert ProcessEntry(spec()).respawn_delay(0.0) is None

"""Documents that are made once for a state of the graph, and not all the time."""

from __future__ import annotations

import asyncio
from types import SimpleNamespace

import pytest

from actors.web import documents
from actors.web.documents import Documents
from actors.web.worker import Worker


async def test_a_graph_that_changes_all_the_time_is_described_at_times(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Case 77: a pause follows; who asks meanwhile gets what is there at its end, made once."""
    spent = iter([0.0, 0.001, 0.0, 0.001])
    clock = SimpleNamespace(thread_time=lambda: next(spent), monotonic=lambda: 0.0)
    monkeypatch.setattr(documents, "time", clock)
    worker = Worker()
    made, found = Documents(worker.share()), list[int]()
    states = [object(), object(), object()]
    now = states[0]

    def make(state: object) -> int:
        found.append(states.index(state))
        return found[-1]

    monkeypatch.setattr(documents, "PAUSE", 50)
    assert await made.encoded("graph", lambda: (now,), make) == b"0"
    now = states[1]
    second = asyncio.create_task(made.encoded("graph", lambda: (now,), make))
    await asyncio.sleep(0)
    now = states[2]
    third = asyncio.create_task(made.encoded("graph", lambda: (now,), make))
    await asyncio.sleep(0)
    assert not second.done()
    assert [await second, await third] == [b"2", b"2"]
    assert found == [0, 2]
    assert await made.encoded("graph", lambda: (now,), make) == b"2"
    assert found == [0, 2]
    worker.close()


async def test_a_document_that_could_not_be_made_is_made_again() -> None:
    """Case 77: by the next who asks."""
    worker, fails = Worker(), True

    def make(_: object) -> str:
        if fails:
            raise ValueError("too large")
        return "found"

    made, state = Documents(worker.share()), object()
    with pytest.raises(ValueError, match="too large"):
        await made.encoded("graph", lambda: (state,), make)
    fails = False
    assert await made.encoded("graph", lambda: (state,), make) == b'"found"'
    worker.close()

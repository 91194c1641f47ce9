"""Fixtures for tests of the node runtime; nothing of it may be left when a test has ended."""

from __future__ import annotations

import asyncio
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING

import pytest

from tests.actors.meeting import Meeting, stop_budget_clock
from tests.actors.site_packages import Site
from tests.seams.limits import be_patient

if TYPE_CHECKING:
    from collections.abc import AsyncIterator
    from pathlib import Path


@pytest.fixture
async def meeting(monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[Meeting]:
    """A broker on a free port and nodes, all in the test's loop; no task of theirs outlives them.

    The budget of callbacks measures no time unless the test gives it a clock.
    """
    be_patient(monkeypatch)
    before = asyncio.all_tasks()
    stop_budget_clock()
    async with AsyncExitStack() as stack:
        place = Meeting(stack)
        await place.open()
        stack.push_async_callback(place.stop_broker)
        yield place
    left = asyncio.all_tasks() - before - {asyncio.current_task()}
    assert not left


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Site:
    """A folder of installed packages that Python looks into first; it is empty."""
    made = Site(tmp_path / "environment")
    monkeypatch.syspath_prepend(str(made.path))
    return made

"""Background tasks that fail are logged and started again."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import pytest

from proto.aio.tasks import keep_running

if TYPE_CHECKING:
    from collections.abc import Awaitable


async def test_a_failed_job_is_logged_with_its_traceback_and_started_again(
    caplog: pytest.LogCaptureFixture,
) -> None:
    """It runs until it returns, and each failure is in the log."""
    left = [ValueError("first"), KeyError("second")]

    async def job() -> None:
        await asyncio.sleep(0)
        if left:
            raise left.pop(0)

    await keep_running("The job", job, pause_sec=0)
    assert [record.getMessage() for record in caplog.records] == [
        "The job failed; it starts again in 0 s"
    ] * 2
    assert "ValueError: first" in caplog.text
    assert "KeyError: 'second'" in caplog.text


async def test_a_cancelled_job_ends() -> None:
    """Cancellation is no failure."""

    def job() -> Awaitable[None]:
        return asyncio.get_running_loop().create_future()

    task = asyncio.ensure_future(keep_running("The job", job))
    await asyncio.sleep(0)
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task

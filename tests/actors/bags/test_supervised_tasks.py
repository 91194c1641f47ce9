"""How the work of a recorder or a player ends."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import pytest

from actors.bags.errors import BagError
from actors.bags.supervised_tasks import SupervisedTasks
from actors.logging.logger import get_logger

if TYPE_CHECKING:
    from collections.abc import Callable


def supervised(on_failed: Callable[[], object] | None = None) -> SupervisedTasks:
    """Return tasks that record."""
    return SupervisedTasks("Recording", get_logger("callboard.supervised_tasks"), on_failed=on_failed)


async def failing(error: Exception) -> None:
    """Raise an error."""
    raise error


async def test_the_first_error_is_raised_once() -> None:
    """`wait` raises it; leaving does not raise it again. Each error stops what else belongs to the work."""
    failures: list[str] = []
    tasks = supervised(lambda: failures.append("failed"))
    tasks.start(failing(BagError("first")))
    with pytest.raises(BagError, match="first"):
        await tasks.wait()
    tasks.fail(BagError("second"))
    tasks.raise_error(is_failing=False)
    assert len(failures) == 2


async def test_leaving_raises_an_error_that_nobody_has_seen() -> None:
    """`raise_error` raises it if `wait` has not."""
    tasks = supervised()
    tasks.fail(BagError("damaged"))
    with pytest.raises(BagError, match="damaged"):
        tasks.raise_error(is_failing=False)


async def test_an_error_does_not_replace_another(caplog: pytest.LogCaptureFixture) -> None:
    """If another exception is being raised, the error is logged instead."""
    tasks = supervised()
    tasks.fail(BagError("the disk is full"))
    tasks.raise_error(is_failing=True)
    assert "the disk is full" in caplog.text


async def test_a_bug_is_logged_with_its_traceback(caplog: pytest.LogCaptureFixture) -> None:
    """The text of an unexpected error does not say where it comes from."""
    tasks = supervised()
    tasks.start(failing(ZeroDivisionError()))
    with pytest.raises(ZeroDivisionError):
        await tasks.wait()
    assert "Recording has failed" in caplog.text
    assert "in failing" in caplog.text


async def test_an_end_is_no_error() -> None:
    """`wait` returns; tasks go on until they are cancelled, and the work can begin again."""
    tasks = supervised()
    task = tasks.start(asyncio.sleep(3600))
    tasks.end()
    await tasks.wait()
    assert not task.done()
    await tasks.cancel()
    assert task.cancelled()
    tasks.begin()
    waiting = asyncio.create_task(tasks.wait())
    tasks.end()
    await waiting
    tasks.raise_error(is_failing=False)

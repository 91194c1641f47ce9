"""Futures and tasks."""

from __future__ import annotations

import asyncio
import threading
from typing import TYPE_CHECKING, Any, cast

import pytest

from actors.ros.rclpy.task import Future, Task

if TYPE_CHECKING:
    from collections.abc import Generator


def test_a_future_is_completed_once_for_all_who_wait() -> None:
    """Callbacks get the future, those added later at once."""
    future, seen = Future[int](), list[Future[int]]()
    future.add_done_callback(seen.append)
    assert not future.done()
    assert future.result() is None
    future.set_result(8)
    future.add_done_callback(seen.append)
    assert (future.done(), future.cancelled(), future.result()) == (True, False, 8)
    assert seen == [future, future]


def test_an_exception_is_raised_by_result() -> None:
    """`exception` returns it."""
    future, error = Future[int](), ValueError("wrong")
    future.set_exception(error)
    assert future.exception() is error
    with pytest.raises(ValueError, match="wrong"):
        future.result()


def test_an_exception_that_nobody_asked_for_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    """When the future is forgotten, rclpy's line appears on stderr."""
    future = Future[int]()
    future.set_exception(ValueError("wrong"))
    del future
    assert capsys.readouterr().err == "The following exception was never retrieved: wrong\n"


def test_a_cancelled_future_is_done() -> None:
    """It has no result; one that is done stays as it was."""
    future = Future[int]()
    future.cancel()
    assert (future.done(), future.cancelled(), future.result()) == (True, True, None)
    done = Future[int]()
    done.set_result(1)
    done.cancel()
    assert (done.cancelled(), done.result()) == (False, 1)


def test_a_failing_callback_does_not_keep_others_from_being_called() -> None:
    """Its error becomes a warning."""
    future, seen = Future[int](), list[Future[int]]()

    def fail(future: Future[int]) -> None:
        raise ValueError("in a callback")

    future.add_done_callback(fail)
    future.add_done_callback(seen.append)
    with pytest.warns(UserWarning, match="Unhandled exception in done callback: in a callback"):
        future.set_result(1)
    assert seen == [future]


def test_a_task_runs_a_function_or_a_coroutine() -> None:
    """Arguments are passed on; the result and the exception are the task's."""

    async def add(a: int, b: int) -> int:
        return a + b

    for handler in (add, lambda a, b: a + b):
        task = Task[int](handler, (1,), {"b": 2})
        task()
        assert (task.result(), task.executing()) == (3, False)
    failing = Task[float](lambda: 1 / 0)
    failing()
    with pytest.raises(ZeroDivisionError):
        failing.result()


def test_a_task_goes_on_when_it_is_called_again() -> None:
    """It waits for a future of another thread; the next call resumes it."""
    future = Future[int]()

    async def wait() -> int:
        return (await future or 0) + 1

    task = Task[int](wait)
    task()
    assert not task.done()
    thread = threading.Thread(target=future.set_result, args=(1,))
    thread.start()
    thread.join()
    task()
    assert task.result() == 2


def test_a_cancelled_task_closes_its_coroutine() -> None:
    """Where it waits, or at once if it has not begun; and in itself, when it waits next."""
    seen, future = list[str](), Future[None]()

    async def wait(name: str) -> None:
        try:
            if name == "itself":
                tasks[-1].cancel()
            await future
        finally:
            seen.append(name)

    tasks = list[Task[None]]()
    for name in ("waits", "itself"):
        tasks.append(Task[None](wait, (name,)))
        tasks[-1]()
        tasks[-1].cancel()
        assert tasks[-1].cancelled()
    tasks.append(Task[None](wait, ("not begun",)))
    tasks[-1].cancel()
    future.set_result(None)
    for task in tasks:
        task()
    assert seen == ["waits", "itself"]


class Counted:
    """Awaits a future, and counts how often it is suspended."""

    def __init__(self, future: Future[int]) -> None:
        self.future, self.suspended = future, 0

    def __await__(self) -> Generator[Any, None, int | None]:
        waiting = self.future.__await__()
        while True:
            try:
                yielded = next(waiting)
            except StopIteration as end:
                return cast("int | None", end.value)
            self.suspended += 1
            yield yielded


async def test_a_task_of_asyncio_waits_for_a_future() -> None:
    """It does not run again before another thread completes the future."""
    waits = Counted(Future[int]())

    async def wait() -> int | None:
        return await waits

    waiting = asyncio.create_task(wait())
    for _ in range(5):
        await asyncio.sleep(0)
    await asyncio.to_thread(waits.future.set_result, 8)
    assert await waiting == 8
    assert waits.suspended == 1


async def test_a_task_of_asyncio_that_waits_for_a_future_can_be_cancelled() -> None:
    """The future stays as it is."""
    future = Future[int]()

    async def wait() -> int | None:
        return await future

    waiting = asyncio.create_task(wait())
    await asyncio.sleep(0)
    waiting.cancel()
    with pytest.raises(asyncio.CancelledError):
        await waiting
    future.set_result(8)
    assert future.result() == 8


async def test_an_executor_resumes_coroutines_in_a_task_of_asyncio() -> None:
    """A program may spin in a coroutine: what the executor runs does not wait for the loop."""
    future = Future[int]()

    async def wait() -> int | None:
        return await future

    task = Task[int](wait)
    task()
    assert not task.done()
    future.set_result(8)
    task()
    assert task.result() == 8

"""Signals: recorded_signal while no loop runs, cancelling what runs on one."""

from __future__ import annotations

import asyncio
import signal
import sys
from contextlib import suppress
from typing import TYPE_CHECKING

import pytest

from actors.cli import loop
from actors.cli.interrupts import (
    Interrupted,
    raise_at_once,
    raise_if_signalled,
    record_signals,
    restore_handlers,
)
from actors.cli.loop import exit_asked_for, run_async

if TYPE_CHECKING:
    from collections.abc import Iterator

SIGNALS = pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda number: number.name)


@pytest.fixture(autouse=True)
def _handlers() -> Iterator[None]:
    """As `main` does around a verb."""
    before = record_signals()
    yield
    record_signals()  # forgets what was recorded_signal
    restore_handlers(before)


def test_the_result_comes_back() -> None:
    """Without a signal, run_async is asyncio.run."""

    async def main() -> int:
        return 42

    assert run_async(main) == 42


@SIGNALS
def test_a_signal_cancels_and_is_reported(number: signal.Signals) -> None:
    """What runs can clean up; then the signal's number comes out."""
    cleaned: list[int] = []

    async def main() -> None:
        signal.raise_signal(number)
        try:
            await asyncio.Event().wait()
        finally:
            cleaned.append(number)

    with pytest.raises(Interrupted) as stop:
        run_async(main)
    assert (stop.value.number, cleaned) == (number, [number])


@SIGNALS
def test_a_signal_before_the_loop_is_not_lost(number: signal.Signals) -> None:
    """It is recorded_signal where it comes, and ends the command before the coroutine starts."""
    signal.raise_signal(number)

    async def main() -> None:
        raise AssertionError

    with pytest.raises(Interrupted) as stop:
        run_async(main)
    assert stop.value.number == number


def test_a_second_signal_raises_at_once() -> None:
    """So that nothing can hang."""
    signal.raise_signal(signal.SIGINT)
    with pytest.raises(Interrupted):
        signal.raise_signal(signal.SIGTERM)
    with pytest.raises(Interrupted, match="2"):
        raise_if_signalled()


def test_signals_may_raise_where_they_come() -> None:
    """From raise_at_once on; an earlier one raises there."""
    raise_at_once()
    with pytest.raises(Interrupted):
        signal.raise_signal(signal.SIGINT)
    with pytest.raises(Interrupted):
        raise_at_once()


def test_a_cancellation_without_a_signal_is_one() -> None:
    """It is not taken for a signal."""

    async def main() -> None:
        raise asyncio.CancelledError

    with pytest.raises(asyncio.CancelledError):
        run_async(main)


def test_what_ignores_being_cancelled_is_left(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """The command ends all the same, and names it."""
    monkeypatch.setattr(loop, "LAST_TASKS_SEC", 0.05)
    tasks: list[asyncio.Task[None]] = []

    async def stubborn() -> None:
        while True:
            with suppress(asyncio.CancelledError):
                await asyncio.Event().wait()

    async def main() -> int:
        tasks.append(asyncio.get_running_loop().create_task(stubborn()))
        await asyncio.sleep(0)
        return 42

    assert run_async(main) == 42
    assert "stubborn ignores being cancelled" in caplog.text


def test_an_exit_beside_the_command_lets_it_clean_up_first() -> None:
    """It is cancelled alone, and knows the exit code; what it still needs goes on meanwhile."""
    done: list[object] = []

    async def main() -> None:
        needed = asyncio.get_running_loop().create_task(asyncio.sleep(0.01, "worked"))
        asyncio.get_running_loop().call_soon(sys.exit, 3)
        try:
            await asyncio.Event().wait()
        finally:
            done.append(await needed)
            done.append(exit_asked_for())

    with pytest.raises(SystemExit) as caught:
        run_async(main)
    assert caught.value.code == 3
    assert done == ["worked", 3]
    assert run_async(lambda: asyncio.sleep(0, 42)) == 42
    assert exit_asked_for() is None

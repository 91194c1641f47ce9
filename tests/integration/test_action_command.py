"""Ctrl-C in `callboard action send_goal`, in a process of its own."""

from __future__ import annotations

import asyncio
import signal
import sys
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors import CancelResponse
from actors.interfaces.example_interfaces.action import Fibonacci

if TYPE_CHECKING:
    from tests.integration.conftest import System


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda number: number.name)
async def test_a_signal_cancels_the_goal(system: System, number: signal.Signals) -> None:
    """The goal is cancelled, its end reported, and the exit code is the signal's."""
    await system.broker()
    cancelled = asyncio.Event()

    async def execute(goal: actors.ServerGoalHandle[Any, Any, Any]) -> Fibonacci.Result:
        await cancelled.wait()
        goal.canceled()
        return Fibonacci.Result()

    def on_cancel(goal: object) -> CancelResponse:
        cancelled.set()
        return CancelResponse.ACCEPT

    async with actors.Node("server", url=system.url) as node:
        node.create_action_server(Fibonacci, "fibonacci", execute, cancel_callback=on_cancel)
        goal = ("/fibonacci", "example_interfaces/action/Fibonacci")
        command = await system.program(
            sys.executable, "-m", "actors", "action", "send_goal", *goal, "--url", system.url
        )
        await command.wait_for_line("Goal accepted with ID:")
        command.send_signal(number)
        assert await command.wait_for_exit() == 128 + number
    assert cancelled.is_set()
    assert command.lines[-2:] == ["Canceling goal...", "Goal finished with status: CANCELED"]

"""Case 89: a callback that never returns is named in the log, and signals end its program all the same."""

from __future__ import annotations

import signal
from typing import TYPE_CHECKING, Final

import pytest

if TYPE_CHECKING:
    from pathlib import Path

    from tests.integration.conftest import System

NODE: Final = """
import asyncio, signal, time
import actors

class Hang(actors.Node):
    def __init__(self):
        super().__init__("hang", stop_timeout_sec={limit})
        self.create_timer(0.01, self.tick)

    {kind} tick(self):
        print("blocked", flush=True)
        {body}
"""
RUN: Final = """
actors.run(Hang)
print("returned", flush=True)
"""
ASYNCIO: Final = """
async def main():
    async with Hang():
        await asyncio.sleep(3600)

asyncio.run(main())
"""
SLEEPING: Final = "time.sleep(3600)  # here"
INTERRUPTING: Final = "while True: signal.raise_signal(signal.SIGINT)"
SLOWLY_INTERRUPTING: Final = "while True: time.sleep(1.5); signal.raise_signal(signal.SIGINT)"
SPINNING: Final = "while True: pass  # here"
STUBBORN: Final = """
        while True:
            try:
                time.sleep(3600)  # here
            except BaseException:
                print("ignored", flush=True)
"""
RCLPY: Final = """
import time
import rclpy
from rclpy.node import Node

def tick():
    print("blocked", flush=True)
    while True: pass  # here

rclpy.init()
node = Node("hang")
node.create_timer(0.01, tick)
rclpy.spin(node)
"""
LAUNCH: Final = """
from actors.launch import LaunchDescription
from actors.launch import Node as Run

def generate_launch_description():
    return LaunchDescription([Run(node=Hang)])
"""


def program(body: str, end: str = RUN, kind: str = "def", limit: float = 3600) -> str:
    """Return a program with a node whose timer does not return."""
    return NODE.format(body=body, kind=kind, limit=limit) + end


@pytest.mark.parametrize("kind", ["def", "async def"])
@pytest.mark.parametrize("body", [SLEEPING, SPINNING], ids=["sleeping", "spinning"])
async def test_the_second_interrupt_ends_it(system: System, body: str, kind: str) -> None:
    """Case 89: in the callback, with the line where it was; after a second the log names that line, too."""
    running = await system.python("-c", program(body, kind=kind))
    await running.wait_for_line("blocked")
    running.send_signal(signal.SIGINT)
    assert "Hang.tick" in await running.wait_for_line("held the event loop for more than")
    running.send_signal(signal.SIGINT)
    assert await running.wait_for_exit() == 0
    assert "Interrupted a callback that did not return, at <string>" in running.output
    assert running.lines[-1] == "returned"


async def test_two_signals_at_once_end_it_a_little_later(system: System) -> None:
    """Case 89: they may be one, sent twice; but if nothing happens for a second, they were meant."""
    running = await system.python("-c", program(SPINNING))
    await running.wait_for_line("blocked")
    running.send_signal(signal.SIGINT)
    running.send_signal(signal.SIGTERM)
    assert await running.wait_for_exit() == 0
    assert running.lines[-1] == "returned"


async def test_a_termination_ends_it_within_its_time(system: System) -> None:
    """Case 89: a single SIGTERM interrupts the callback before `stop_timeout_sec` is over."""
    running = await system.python("-c", program(SLEEPING, limit=0.5))
    await running.wait_for_line("blocked")
    running.send_signal(signal.SIGTERM)
    assert await running.wait_for_exit() == 0
    assert "Interrupted a callback" in running.output
    assert running.lines[-1] == "returned"


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT], ids=lambda number: number.name)
async def test_a_callback_that_ignores_the_interrupt_is_ended(system: System, number: signal.Signals) -> None:
    """Case 89: the process ends, says where the callback was, and shows by its code that it was ended."""
    running = await system.python("-c", program(STUBBORN, limit=0.5))
    await running.wait_for_line("blocked")
    running.send_signal(number)
    if number is signal.SIGINT:
        await running.wait_for_line("held the event loop")
        running.send_signal(number)
    assert await running.wait_for_exit() == 128 + number
    assert "ignored" in running.output
    assert "Ending at once, because a callback does not end" in running.output


async def test_an_asyncio_program_ends_at_the_second_interrupt(system: System) -> None:
    """Case 89: asyncio's own handler does that."""
    running = await system.python("-c", program(INTERRUPTING, ASYNCIO))
    await running.wait_for_line("blocked")
    assert await running.wait_for_exit() != 0
    assert "in tick" in running.output


async def test_an_rclpy_program_ends_at_the_first_interrupt(system: System, tmp_path: Path) -> None:
    """Case 89: as with rclpy."""
    await system.broker()
    file = tmp_path / "hang.py"
    file.write_text(RCLPY, encoding="utf-8")
    running = await system.python("-m", "actors.ros", str(file))
    await running.wait_for_line("blocked")
    running.send_signal(signal.SIGINT)
    assert await running.wait_for_exit() != 0
    assert "in tick" in running.output


async def test_nodes_in_a_launch_are_interrupted(system: System, tmp_path: Path) -> None:
    """Case 89: the second Ctrl-C ends the launch, and says which node's line it was."""
    file = tmp_path / "hang.launch.py"
    file.write_text(program(SLOWLY_INTERRUPTING, LAUNCH), encoding="utf-8")
    running = await system.python("-m", "actors", "launch", str(file))
    await running.wait_for_line("held the event loop for more than")
    await running.wait_for_exit()
    assert "Interrupted a callback" in running.output
    assert f"{file}:" in running.output

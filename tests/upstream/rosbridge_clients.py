"""Run clients of rosbridge against callboard: a part of `make judges`.

roslibpy brings its own integration tests, in its source distribution; npm's roslib runs `roslib.mjs` in
Node.js. Both are installed below build/; nothing of them is copied here.
"""

from __future__ import annotations

import asyncio
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Final

import actors
from actors.interfaces.example_interfaces.action import Fibonacci
from broker import Broker, BrokerOptions
from tests.upstream.distributions import ROOT, WORK, environment, unpacked

if TYPE_CHECKING:
    from collections.abc import Mapping

ROSLIBPY: Final = "roslibpy==2.1.0"
TRANSPORTS: Final = ("twisted", "asyncio")
"""Each in a process of its own, as roslibpy says."""
NPM: Final = ROOT / "build" / "npm"
SCRIPT: Final = Path(__file__).with_name("roslib.mjs")
PORT: Final = "9090"
"""In roslibpy's tests; replaced by that of the server."""
STEP_SEC: Final = 0.4
"""Of the action: a goal of ten steps is still there when roslibpy cancels it after two seconds."""
TIMEOUT_SEC: Final = 300.0


async def serve_goals(url: str) -> None:
    """Execute goals of `/fibonacci`, as roslibpy's tests expect it from the container that they start.

    Args:
        url: The broker's.
    """

    async def execute(
        goal: actors.ServerGoalHandle[Fibonacci.Goal, Fibonacci.Result, Fibonacci.Feedback],
    ) -> object:
        sequence = [0, 1]
        while len(sequence) <= goal.request.order:
            await asyncio.sleep(STEP_SEC)
            if goal.is_cancel_requested:
                goal.canceled()
                break
            sequence.append(sequence[-1] + sequence[-2])
            goal.publish_feedback(Fibonacci.Feedback(sequence=sequence))
        else:
            goal.succeed()
        return Fibonacci.Result(sequence=sequence)

    def cancel(_: object) -> actors.CancelResponse:
        return actors.CancelResponse.ACCEPT

    async with actors.Node("fibonacci", url=url) as node:
        node.declare_parameter("speed", 1.5)
        node.create_action_server(Fibonacci, "/fibonacci", execute, cancel_callback=cancel)
        await asyncio.Event().wait()


async def started(url: str) -> tuple[asyncio.subprocess.Process, str]:
    """Start `callboard rosbridge` at a free port.

    Args:
        url: The broker's.

    Returns:
        Its process, and its address.
    """
    words = ("-m", "actors", "rosbridge", "--allow-control", "--listen", "127.0.0.1:0", "--url", url)
    process = await asyncio.create_subprocess_exec(
        sys.executable, *words, cwd=ROOT, stdout=asyncio.subprocess.PIPE
    )
    assert process.stdout is not None
    line = (await asyncio.wait_for(process.stdout.readline(), TIMEOUT_SEC)).decode()
    return process, line.split()[-1]


async def run(*command: str, folder: Path, variables: Mapping[str, str] | None = None) -> int:
    """Run a command; return its exit code.

    Args:
        command: The program and its arguments.
        folder: Where it runs.
        variables: Further environment variables.
    """
    process = await asyncio.create_subprocess_exec(
        *command, cwd=folder, env={**os.environ, **(variables or {})}, stdin=asyncio.subprocess.DEVNULL
    )
    async with asyncio.timeout(TIMEOUT_SEC):
        return await process.wait()


async def roslib(address: str) -> int:
    """Let npm's roslib do what it can; return 0 if all of it works.

    Args:
        address: The server's.
    """
    # From its standard input, so that the packages of build/npm are found.
    source = SCRIPT.read_text(encoding="utf-8")
    return await run("node", "--input-type=module", "--eval", source, "--", address, folder=NPM)


async def roslibpy(address: str) -> int:
    """Run roslibpy's tests for ROS 2 with each of its transports; return 0 if all pass.

    Args:
        address: The server's.
    """
    python = environment(ROSLIBPY)
    folder = unpacked(ROSLIBPY, python)
    port = address.rstrip("/").rpartition(":")[2]
    for path in (folder / "tests" / "ros2").glob("*.py"):
        text = path.read_text(encoding="utf-8")
        path.write_text(text.replace(PORT, port), encoding="utf-8")
    command = (str(python), "-m", "pytest", "-q", "-p", "no:callboard", "tests/ros2")
    codes = [
        await run(*command, folder=folder, variables={"ROSLIBPY_TRANSPORT": each}) for each in TRANSPORTS
    ]
    return max(codes)


async def judged() -> int:
    """Run all clients; return 0 if all are content."""
    async with Broker(BrokerOptions(port=0)) as broker, asyncio.TaskGroup() as group:
        serving = group.create_task(serve_goals(broker.url))
        server, address = await started(broker.url)
        try:
            codes = [await roslib(address), await roslibpy(address)]
        finally:
            server.terminate()
            await server.wait()
            serving.cancel()
    print(f"roslib and {ROSLIBPY}: {'content' if not any(codes) else 'not content'}")
    return max(codes)


if __name__ == "__main__":
    WORK.mkdir(parents=True, exist_ok=True)
    sys.exit(asyncio.run(judged()))

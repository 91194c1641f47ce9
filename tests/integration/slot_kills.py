"""Kill processes at each step of a slot's life: `python -m tests.integration.slot_kills --rounds 1000`.

In each round a publisher, a reader or a broker kills itself at some step (`slot_victims.py`), while a
publisher and a reader of this process go on. What arrives must be whole and in order, and after the round
nothing of the victim may be left: no mapping, no descriptor, no slot that nobody can release.
"""

from __future__ import annotations

import argparse
import asyncio
import gc
import random
import sys
import time
from contextlib import asynccontextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Final

import actors
from actors.interfaces.std_msgs.msg import UInt8MultiArray
from tests.integration.conftest import System
from tests.integration.slot_victims import BURST, STEPS, content, number_of
from tests.seams.nodes import link_of
from tests.seams.simulation import arena_of
from tests.waiting import until

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from tests.integration.conftest import Program

# ruff: noqa: T201 - a program that prints what it has done

MOST_CALLS: Final = 12
"""A victim dies at the latest when it reaches its step for this time."""

SIGKILLED: Final = -9
NAME: Final = "/memfd:callboard"


def mappings(process: int | str = "self") -> int:
    """Return how many arenas a process has mapped; one of a broker's is its own, with its secret."""
    return Path(f"/proc/{process}/maps").read_text("utf-8").count(NAME)


def descriptors(process: int | str = "self") -> int:
    """Return how many descriptors of arenas a process has."""
    found = 0
    for each in Path(f"/proc/{process}/fd").iterdir():
        try:
            found += str(each.readlink()).startswith(NAME)
        except FileNotFoundError:  # the one with which the directory is read
            continue
    return found


class Survivors:
    """A broker, and in this process a publisher and a reader that go on whoever dies.

    Attributes:
        broker: The broker's process.
    """

    def __init__(self, system: System, talker: actors.Node, listener: actors.Node) -> None:
        self._system = system
        self._talker, self._listener = talker, listener
        self._publisher = talker.create_publisher(UInt8MultiArray, "survivors", 10)
        listener.create_subscription(UInt8MultiArray, "survivors", self._take, 10)
        self._victims = listener.create_subscription(UInt8MultiArray, "victims", number_of, 10)
        self._number = self._last = -1
        self._published = asyncio.Event()
        self._published.set()
        self._task: asyncio.Task[None] | None = None
        self._own_mappings = self._own_descriptors = 0
        self.broker: Program

    def _take(self, message: UInt8MultiArray) -> None:
        number = number_of(message)
        assert number > self._last, "out of order"
        self._last = number

    async def start(self) -> None:
        """Start the broker and publish; note what this process has mapped."""
        self.broker = await self._system.broker()
        self._task = asyncio.create_task(self._publish())
        await self._go_on()
        gc.collect()  # what others have left
        self._own_mappings, self._own_descriptors = mappings(), descriptors()

    async def stop(self) -> None:
        """Publish no more."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.wait([self._task])

    async def _publish(self) -> None:
        while True:
            await self._published.wait()
            for _ in range(BURST):
                self._number += 1
                self._publisher.publish(UInt8MultiArray(data=content(self._number)))
            await asyncio.sleep(0.001)

    async def _go_on(self) -> None:
        """Wait for messages by reference that are published from now on."""
        assert self._task is not None
        received = self._listener.diagnostics().shared_memory.received
        number = self._number

        def went_on() -> bool:
            assert self._task is None or not self._task.done()
            shared = self._listener.diagnostics().shared_memory
            return self._last > number and shared.received >= received + BURST

        await until(went_on, "messages by reference")

    async def outlive(self, name: str, count: int) -> None:
        """Start the victim of a step, and wait for its death; nothing of it may be left.

        Args:
            name: The step.
            count: It dies when it gets there for this time.
        """
        command = "-m", "tests.integration.slot_victims", name, str(count)
        if STEPS[name].role == "broker":
            await self.broker.kill()
            victim = await self._system.python(*command, "--port", str(self._system.port))
            visitor = asyncio.create_task(self._visit())
            assert await victim.wait_for_exit() == SIGKILLED, victim.output
            self.broker = await self._system.broker()
            await visitor
        else:
            victim = await self._system.python(*command)
            assert await victim.wait_for_exit() == SIGKILLED, victim.output
            await until(lambda: not self._victims.get_publisher_count(), "the victim's publisher is gone")
        await self._go_on()
        await self._check_rest()

    async def _visit(self) -> None:
        """Be another publisher that leaves when messages have gone by reference: its arena is forgotten."""
        async with actors.Node("visitor", url=self._system.url, use_global_arguments=False) as node:
            publisher = node.create_publisher(UInt8MultiArray, "victims", 10)
            number = 0
            while not node.diagnostics().shared_memory.sent:
                await publisher.wait_for_subscriptions()
                publisher.publish(UInt8MultiArray(data=content(number)))
                number += 1
                await asyncio.sleep(0.001)

    async def _check_rest(self) -> None:
        self._published.clear()
        arena = arena_of(link_of(self._talker).shared_memory)
        assert arena is not None
        await until(lambda: not arena.used_bytes, "all slots are released")
        broker = self.broker.process.pid
        await until(lambda: mappings(broker) == 2, "the broker has mapped its own and the survivor's")
        await until(
            lambda: descriptors(broker) == 3, "the broker has open these (mmap has copies), and its own"
        )
        gc.collect()
        await until(lambda: mappings() <= self._own_mappings, "nothing else is mapped here")
        await until(lambda: descriptors() <= self._own_descriptors, "nothing else is open here")
        for node in (self._talker, self._listener):
            diagnostics = node.diagnostics()
            assert diagnostics.callback_errors == 0
            assert diagnostics.shared_memory.stale == 0
        self._published.set()


@asynccontextmanager
async def survivors(system: System) -> AsyncIterator[Survivors]:
    """Have processes that survive."""
    async with (
        actors.Node("talker", url=system.url, use_global_arguments=False) as talker,
        actors.Node("listener", url=system.url, use_global_arguments=False) as listener,
    ):
        made = Survivors(system, talker, listener)
        try:
            await made.start()
            yield made
        finally:
            await made.stop()


def calls_before_death(name: str, chance: random.Random) -> int:
    """Return how often a step is reached in a round."""
    return chance.randint(1, MOST_CALLS) if STEPS[name].often else 1


async def soak(rounds: int, seed: int) -> None:
    """Kill one process a round, each step as often as any other."""
    chance = random.Random(seed)
    names = [*STEPS] * -(-rounds // len(STEPS))
    system, began = System(), time.monotonic()
    try:
        async with survivors(system) as living:
            for number, name in enumerate(names[:rounds], 1):
                count = calls_before_death(name, chance)
                try:
                    await living.outlive(name, count)
                except BaseException:
                    print(f"round {number}, {name!r}, {count}:", file=sys.stderr)
                    raise
                if not number % 50:
                    print(f"{number} rounds in {time.monotonic() - began:.0f} s", flush=True)
    finally:
        await system.close()
    print(f"{rounds} rounds, {len(STEPS)} steps: nothing was mixed, lost in silence or left")


def main() -> None:
    """Read the command line."""
    parser = argparse.ArgumentParser(description="Kill processes at each step of a slot's life.")
    parser.add_argument("--rounds", type=int, default=1000, help="how many processes to kill (default 1000)")
    parser.add_argument("--seed", type=int, default=0, help="selects when victims die (default 0)")
    arguments = parser.parse_args()
    asyncio.run(soak(arguments.rounds, arguments.seed))


if __name__ == "__main__":
    main()

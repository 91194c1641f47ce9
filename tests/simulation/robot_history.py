"""A history of a robot and its operators: processes that fail at random, like their links and the broker."""

from __future__ import annotations

import asyncio
from random import Random
from typing import TYPE_CHECKING, Final

import actors
from tests.simulation.network import BROKER, LinkFaults, on_host
from tests.simulation.robots import Operator, Robot
from tests.simulation.world import LINK_FAULTS

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.simulation.stage import Stage

CHAOS_SEC: Final = 15.0
"""How long operators begin new things, and faults occur."""

HEALED_SEC: Final = 40.0
"""After the faults everybody is connected, and everything has ended, within this."""


class Process:
    """A process with one node: a host of its own, which can be frozen, and a task that runs the node.

    Attributes:
        host: Its host.
        node: Its node.
        work: What it does beside its callbacks.
    """

    def __init__(self, stage: Stage, host: str, make: Callable[[], Robot | Operator]) -> None:
        self.host = host
        self._stage = stage
        self._make = make
        self._stop = asyncio.Event()
        self.node = make()
        self.work: list[asyncio.Task[None]] = []
        with on_host(host):
            self._task = asyncio.create_task(self._live(), name=host)

    async def _live(self) -> None:
        while True:
            try:
                async with self.node:
                    if isinstance(self.node, Operator):
                        self.work = self.node.work()
                    await self._stop.wait()
                    return
            except actors.NodeNameTaken:
                # The broker has not noticed the earlier process's death yet.
                await asyncio.sleep(1)
                self.node = self._make()

    async def stop(self) -> None:
        """End it in order."""
        self._stop.set()
        await self._task
        await self.ended(10)

    async def kill(self, *, silent: bool) -> None:
        """End it at once; its peers see a reset, or nothing."""
        self._stage.network.crash(self.host, silent=silent)
        self._stage.loop.thaw(self.host)
        for task in (self._task, *self.work):
            task.cancel()
        await asyncio.wait({self._task})
        await self.ended(0.01)

    async def ended(self, limit_sec: float) -> None:
        """Wait until its work has ended, which must not raise."""
        if self.work:
            _, running = await asyncio.wait(self.work, timeout=limit_sec)
            assert not running, f"{self.host}: {running} hang"
            errors = [task.exception() for task in self.work if not task.cancelling()]
            assert not any(errors), errors


class History:
    """What happens with one robot at a time, and some operators.

    Args:
        stage: The broker and the network.
        seed: Of everything that happens by chance.

    Attributes:
        active: Whether operators begin new things.
        lost_sec: For how long some process did not run.
        number: The value that was set last.
        robots: The robot that runs, after those that have died.
    """

    def __init__(self, stage: Stage, seed: int) -> None:
        self.seed = seed
        self.loop = stage.loop
        self.active = True
        self.lost_sec = 0.0
        self.number = 0
        self.url = stage.broker.url
        self.robots: list[Process] = []
        self.operators: list[Process] = []
        self.faults: list[str] = []
        self._stage = stage
        self._random = Random(f"{seed} faults")
        stage.network.choose_link_faults = lambda random: LinkFaults(**vars(random.choice(LINK_FAULTS)))
        self._operators = 0

    async def run(self) -> None:
        """Let it happen, heal, and check."""
        self._start_robot()
        for _ in range(self._random.randint(1, 3)):
            self._start_operator()
        end = self.loop.time() + CHAOS_SEC
        while self.loop.time() < end:
            await asyncio.sleep(self._random.expovariate(1))
            fault = self._random.choice(
                (
                    self._crash_broker,
                    self._restart_broker,
                    self._drop,
                    self._drop,
                    self._block,
                    self._freeze,
                    self._slow_down,
                    self._kill,
                    self._stop,
                )
            )
            self.faults.append(f"{self.loop.time():.3f} {fault.__name__}")
            await fault()
            self._stage.network.heal()
        self.active = False
        try:
            await self._check()
        finally:
            for process in (*self.operators, self.robots[-1]):
                await process.stop()

    async def _check(self) -> None:
        """Everything has ended, and all agree on what has happened."""
        self._start_operator()  # a late joiner
        until = self._stage.until
        processes = [self.robots[-1], *self.operators]
        await until(lambda: all(each.node.connected for each in processes), HEALED_SEC, step=0.01)
        for process in self.operators:
            await process.ended(HEALED_SEC)
        robots = [process.node for process in self.robots if isinstance(process.node, Robot)]
        operators = [process.node for process in self.operators if isinstance(process.node, Operator)]
        robot = robots[-1]
        for operator in operators:
            await operator.check(robots)
        values = [value for each in robots for value in each.values]
        assert robot.begun == robot.done
        assert sum(operator.changes for operator in operators) <= sum(each.done for each in robots)
        for operator in operators:
            assert set(operator.sets) <= set(values)
            left = iter(values)
            assert all(value in left for value in operator.seen), (operator.seen, values)
            await until(lambda: operator.seen[-1:] == robot.value[:1])  # noqa: B023 - awaited here
            await until(lambda: operator.known_goals() == robot.executed)  # noqa: B023

    # Faults

    def _start_robot(self) -> None:
        self.robots.append(Process(self._stage, f"robot{len(self.robots)}", lambda: Robot(self.url)))

    def _start_operator(self) -> None:
        self._operators += 1
        number = self._operators
        self.operators.append(Process(self._stage, f"operator{number}", lambda: Operator(number, self)))

    def _any(self) -> Process:
        return self._random.choice([self.robots[-1], *self.operators])

    async def _last(self) -> None:
        await asyncio.sleep(self._random.choice([0.001, 0.01, 0.1, 1.0, 2.9, 6.0]))

    async def _crash_broker(self) -> None:
        await self._stage.crash_broker()
        await self._last()
        await self._stage.start_broker()

    async def _restart_broker(self) -> None:
        await self._stage.stop_broker()
        await self._last()
        await self._stage.start_broker()

    async def _drop(self) -> None:
        self._stage.network.drop(self._any().host)

    async def _block(self) -> None:
        ends = [self._any().host, BROKER]
        self._random.shuffle(ends)
        self._stage.network.block(*ends)
        if self._random.random() < 0.5:
            self._stage.network.block(*reversed(ends))
        await self._last()

    async def _freeze(self) -> None:
        host = self._random.choice([self._any().host, BROKER])
        began = self.loop.time()
        self.loop.freeze(host)
        await self._last()
        self.loop.thaw(host)
        self.lost_sec += self.loop.time() - began

    async def _slow_down(self) -> None:
        host = self._random.choice([self._any().host, BROKER])
        self._stage.network.slow_down(host, read=self._random.choice([50, 1000]), pause=0.05)
        await self._last()

    async def _kill(self) -> None:
        process = self._any()
        await process.kill(silent=self._random.random() < 0.3)
        self._replace(process)

    async def _stop(self) -> None:
        process = self._any()
        began = self.loop.time()
        await process.stop()
        assert self.loop.time() - began < 15
        self._replace(process)

    def _replace(self, process: Process) -> None:
        if process in self.operators:
            self.operators.remove(process)
            self._start_operator()
        else:
            self._start_robot()

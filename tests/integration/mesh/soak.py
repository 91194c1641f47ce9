"""Let a mesh run with churn: `python -m tests.integration.mesh.soak --minutes 30`.

Three brokers in a ring, a station at each that publishes and calls, and nodes that come and go. The second
and third broker are stopped or killed, and restarted. The first runs all the time: at the end its memory,
descriptors, threads and what it knows of the mesh must be what they were after the warm-up. Nothing may
arrive twice or out of order, and calls may only fail as unavailable.
"""

from __future__ import annotations

import argparse
import asyncio
import logging
import random
import signal
import sys
import time
from collections import Counter
from contextlib import AsyncExitStack, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import zenoh

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String
from benchmarks.harness import meters
from broker.mesh.engine.zenoh_config import make_config
from broker.options import BrokerOptions
from proto.wire.codes import EntryKind
from tests.integration.conftest import System
from tests.integration.mesh.stations import check_again, make_brokers, start_all

if TYPE_CHECKING:
    from tests.integration.mesh.stations import MeshBroker, Station

WARM_UP_PART: Final = 0.25
"""Of the minutes: the first figures are taken after it."""

SETTLE_SEC: Final = 5.0
"""Without churn before figures are taken: heartbeats repair what is lost, and memory is returned."""

VISITORS: Final = 6
"""Nodes at a time that come and go."""

VISIT_SEC: Final = 2.0
"""A visit lasts up to so long."""

BATCH: Final = 10
"""Messages that a station publishes every PUBLISH_SEC."""

PUBLISH_SEC: Final = 0.05
RESTART_SEC: Final = 8.0
MORE_THREADS: Final = 4
"""Zenoh starts and ends threads as it needs them."""

PROGRESS_SEC: Final = 60.0
MORE_KIB: Final = 8 * 1024
"""Memory that the first broker may have more at the end."""


@dataclass(frozen=True)
class Figures:
    """What the first broker has and knows, without churn."""

    memory_kib: int
    descriptors: int
    threads: int
    tokens: int
    brokers: int
    entries: int
    """Endpoints and nodes of the graph, those of other brokers included."""


class MeshSoak:
    """One soak.

    Args:
        minutes: How long it lasts.
        seed: Of its choices.

    Attributes:
        counts: What has happened.
        wrong: What must not happen.
    """

    def __init__(self, minutes: float, seed: int) -> None:
        self._seconds = minutes * 60
        self._random = random.Random(seed)
        self.counts: Counter[str] = Counter()
        self.wrong: list[str] = []
        self._brokers: list[MeshBroker] = []
        self._stations: list[Station] = []
        self._visits = 0

    async def run(self) -> None:
        """Run it, and print figures."""
        system = System()
        try:
            async with AsyncExitStack() as stack:
                self._brokers = make_brokers(system, ((), (0,), (0, 1)))
                self._stations = await start_all(self._brokers, stack)
                await self._churn(WARM_UP_PART * self._seconds)
                before = await self._figures()
                _print(f"after the warm-up: {asdict(before)}")
                await self._churn((1 - WARM_UP_PART) * self._seconds)
                after = await self._figures()
                _print(f"at the end:        {asdict(after)}")
                self._compare(before, after)
                self.wrong += [text for each in self._stations for text in each.wrong]
                for broker in self._brokers:
                    if broker.program is not None and "Traceback" in broker.program.output:
                        self.wrong.append(broker.program.output)
                report = await self._stations[0].node.get_broker_stats()
                _print(f"mesh: {report.mesh}")
                self.counts["published"] = sum(each.publisher.published for each in self._stations)
                self.counts["heard"] = sum(
                    len(numbers) for each in self._stations for numbers in each.heard.values()
                )
        finally:
            await system.close()
        _print(f"counts: {dict(self.counts)}")
        for text in self.wrong:
            _print(f"wrong: {text}")

    def _compare(self, before: Figures, after: Figures) -> None:
        more = after.memory_kib - before.memory_kib
        if more > MORE_KIB:
            self.wrong.append(f"{more:.0f} KiB more memory")
        for name, number in asdict(before).items():
            now = getattr(after, name)
            if name != "memory_kib" and abs(now - number) > (MORE_THREADS if name == "threads" else 0):
                self.wrong.append(f"{name}: {number} after the warm-up, {now} at the end")

    async def _churn(self, seconds: float) -> None:
        """Let messages, calls, nodes and brokers come and go for some time; then wait until all is calm."""
        ends = asyncio.timeout(seconds)
        with suppress(TimeoutError):
            async with ends, asyncio.TaskGroup() as group:
                for station in self._stations:
                    group.create_task(self._publish(station))
                    group.create_task(self._call(station))
                for _ in range(VISITORS):
                    group.create_task(self._visit_for_ever())
                group.create_task(self._restart_for_ever())
                group.create_task(self._print_progress())
        for broker in self._brokers[1:]:
            if broker.program is None or broker.program.process.returncode is not None:
                await broker.start()
        await check_again(*self._stations)
        await asyncio.sleep(SETTLE_SEC)
        await check_again(*self._stations)

    async def _publish(self, station: Station) -> None:
        while True:
            with suppress(actors.PublisherFull):
                station.publish(BATCH)
            await asyncio.sleep(PUBLISH_SEC)

    async def _call(self, station: Station) -> None:
        while True:
            server = self._random.choice(self._stations)
            began = time.monotonic()
            try:
                await station.call(server)
                self.counts["calls"] += 1
            except actors.ServiceUnavailable:
                self.counts["calls unavailable"] += 1
            except actors.CallboardError as error:
                took = time.monotonic() - began
                self.wrong.append(f"{station.name} -> {server.name} after {took:.1f} s: {error!r}")
            await asyncio.sleep(PUBLISH_SEC)

    async def _visit_for_ever(self) -> None:
        while True:
            self._visits += 1
            broker = self._random.choice(self._brokers)
            with suppress(actors.CallboardError):  # its broker is restarted
                async with actors.Node(f"visitor_{self._visits}", url=broker.url) as node:
                    publisher = node.create_publisher(String, "visits", 10)
                    node.create_service(AddTwoInts, f"visitor_{self._visits}", _answer)
                    messages = aiter(node.create_subscription(String, "numbers", qos_profile=10))
                    publisher.publish(String(data="here"))
                    with suppress(TimeoutError):
                        async with asyncio.timeout(VISIT_SEC * self._random.random()):
                            async for _ in messages:
                                self.counts["heard by visitors"] += 1
                    self.counts["visits"] += 1

    async def _restart_for_ever(self) -> None:
        while True:
            await asyncio.sleep(RESTART_SEC * self._random.random())
            broker = self._random.choice(self._brokers[1:])
            if self._random.random() < 0.5:
                await broker.kill()
                self.counts["kills"] += 1
            else:
                broker.stop()
                self.counts["stops"] += 1
                assert broker.program is not None
                code = await broker.program.wait_for_exit()
                if code:
                    self.wrong.append(
                        f"a broker that was stopped exited with {code}:\n{broker.program.output}"
                    )
            await asyncio.sleep(RESTART_SEC / 4 * self._random.random())
            await broker.start()

    async def _print_progress(self) -> None:
        while True:
            await asyncio.sleep(PROGRESS_SEC)
            program = self._brokers[0].program
            memory = program and meters.memory_kib(program.process.pid)
            _print(f"{time.strftime('%H:%M:%S')} {memory:.0f} KiB, {dict(self.counts)}")

    async def _figures(self) -> Figures:
        broker, node = self._brokers[0], self._stations[0].node
        assert broker.program is not None
        pid = broker.program.process.pid
        report = await node.get_broker_stats()
        graph = await node.get_graph()
        return Figures(
            memory_kib=round(meters.memory_kib(pid) or 0),
            descriptors=meters.open_files(pid) or 0,
            threads=_threads(pid),
            tokens=await asyncio.to_thread(_count_tokens, broker.endpoint),
            brokers=len(report.brokers),
            entries=sum(1 for _ in graph.of_kind(*EntryKind)),
        )


def _answer(request: AddTwoInts.Request, response: AddTwoInts.Response) -> AddTwoInts.Response:
    response.sum = request.a
    return response


def _threads(pid: int) -> int:
    return sum(1 for _ in Path(f"/proc/{pid}/task").iterdir())


def _count_tokens(endpoint: str) -> int:
    """Return how many brokers have liveliness tokens, as a plain Zenoh program sees it."""
    config = make_config(BrokerOptions(mesh=endpoint))
    config.insert_json5("mode", '"client"')  # pyright: ignore[reportUnknownMemberType]
    with zenoh.open(config) as session:
        return len(list(session.liveliness().get("callboard/*/*/alive/*")))


def _print(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def main() -> int:
    """Run a soak; return 1 if something was wrong."""
    parser = argparse.ArgumentParser(prog="python -m tests.integration.mesh.soak", description=__doc__)
    parser.add_argument("--minutes", type=float, default=5.0, help="for how long")
    parser.add_argument("--seed", type=int, default=0, help="of its choices")
    chosen = parser.parse_args()
    soak = MeshSoak(chosen.minutes, chosen.seed)
    logging.getLogger("callboard").setLevel(logging.ERROR)
    asyncio.run(soak.run())
    return 1 if soak.wrong else 0


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # in the background of a script it is ignored
    raise SystemExit(main())

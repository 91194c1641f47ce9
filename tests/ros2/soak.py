"""Let nodes of both sides come and go: `python -m tests.ros2.soak --minutes 10 --seed 1`.

Three processes of ROS 2 and three nodes of callboard publish numbers and receive those of the other side, and
the nodes call the processes' services. All of them are killed, stopped and started again, and so is the
bridge, in the first half of the time. In the second half one bridge lives all the time: its memory,
descriptors and threads must be what they were after a warm-up, its link must hold, and its log must be short.
Nothing may arrive twice or out of order, and calls may only fail as unavailable or late. At the end, without
churn, both graphs must show exactly what is there, each service must answer the other side, and of bursts
that are too fast for the queues on their way each message must be delivered, or counted as dropped or lost.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import logging
import random
import sys
import tempfile
from collections import Counter
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import actors
from actors.interfaces.callboard_interfaces.srv import GetDiagnostics
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import Trigger
from benchmarks.harness import meters
from proto.wire.codes import EntryKind
from tests.real_ros import is_supported
from tests.ros2.graphs import graph_until
from tests.ros2.network import Network
from tests.ros2.ros import WAIT_SEC
from tests.waiting import until

if TYPE_CHECKING:
    from actors.graph.snapshot import GraphSnapshot
    from tests.ros2.network import Process
    from tests.ros2.ros import Ros, RosNode, RosSubscription

SLOTS: Final = 3
"""Processes of ROS 2, and nodes of callboard."""
PERIOD_SEC: Final = 0.05
STEP_SEC: Final = 1.5
"""Longest time between two events of the churn."""
CALL_SEC: Final = 2.0
LEASE_SEC: Final = 3
BURST: Final = 2000
"""Messages of the last burst, which no queue on the way can hold."""
LAST_MESSAGES: Final = 20
"""Messages after it, until one of them is the last that arrives."""
PROGRESS_SEC: Final = 60.0
WARM_UP_PART: Final = 0.25
"""Of the second half: the first figures of the bridge are taken after it."""
SETTLE_SEC: Final = 5.0
"""Without churn before figures are taken: leases end, and what lingers goes."""
MORE_KIB: Final = 16 * 1024
"""Memory that the bridge may have more at the end than after the warm-up; Fast DDS keeps some."""
MORE_DESCRIPTORS: Final = 4
MORE_THREADS: Final = 4
"""Fast DDS opens and starts some as it needs them."""
LINES_PER_SEC: Final = 1.0
"""Lines that the bridge may log: a line of each kind and second is printed."""


@dataclass(frozen=True)
class Figures:
    """What the bridge has, without churn."""

    memory_kib: int
    descriptors: int
    threads: int
    connections: int
    shown: str
    """How many nodes and endpoints it shows on both sides."""


class Order:
    """Checks that numbers of each source rise."""

    def __init__(self) -> None:
        self._last: dict[str, int] = {}
        self.received = 0

    def check(self, text: str) -> str:
        """Note "SOURCE:NUMBER"; return what is wrong, "" if nothing is."""
        source, _, number = text.rpartition(":")
        before = self._last.get(source, -1)
        self._last[source] = int(number)
        self.received += 1
        return "" if int(number) > before else f"{text} after {before}"


class Robot:
    """A process of ROS 2 with a node."""

    def __init__(self, network: Network, slot: int) -> None:
        self._network = network
        self.name = f"robot_{slot}"
        self._starts = 0
        self._ros: Ros | None = None
        self._subscription: RosSubscription | None = None
        self.node: RosNode | None = None
        self._orders = Order()
        self.busy = asyncio.Lock()

    @property
    def received(self) -> int:
        """Messages of callboard that it has got."""
        return self._orders.received

    async def start(self) -> None:
        """Start it, if it does not run."""
        if self._ros is not None:
            return
        self._starts += 1
        self._ros = self._network.ros(lease_sec=LEASE_SEC)
        self.node = await self._ros.node(self.name)
        text = f"{self.name}.{self._starts}"
        await self.node.ask("publish_numbers", f"/{self.name}/numbers", text, PERIOD_SEC)
        await self.node.service(f"/{self.name}/ask", Trigger, Trigger.Response(success=True))
        self._subscription = await self.node.subscription("/stations/numbers", String)

    async def end(self, *, kill: bool) -> None:
        """End the process, with or without a goodbye."""
        if self._ros is None:
            return
        ros, self._ros, self.node, self._subscription = self._ros, None, None, None
        if kill:
            await ros.kill()
        await asyncio.to_thread(ros.close)

    async def check(self) -> list[str]:
        """Return what is wrong with the messages that have arrived."""
        if self._subscription is None:
            return []
        texts = await self._subscription.take_texts()
        return [wrong for wrong in map(self._orders.check, texts) if wrong]


class Station:
    """A node of callboard."""

    def __init__(self, url: str, slot: int, counts: Counter[str], wrong: list[str]) -> None:
        self._url = url
        self._counts = counts
        self._wrong = wrong
        self.name = f"station_{slot}"
        self._starts = 0
        self._task: asyncio.Task[None] | None = None
        self._orders = Order()

    def start(self) -> None:
        """Start it, if it does not run."""
        if self._task is None:
            self._starts += 1
            self._task = asyncio.create_task(self._run())

    async def end(self) -> None:
        """End it."""
        if self._task is not None:
            task, self._task = self._task, None
            task.cancel()
            with suppress(asyncio.CancelledError):
                await task

    async def _run(self) -> None:
        source = f"{self.name}.{self._starts}"
        async with actors.Node(self.name, url=self._url) as node:
            publisher = node.create_publisher(String, "/stations/numbers", 10)
            for slot in range(SLOTS):
                node.create_subscription(String, f"/robot_{slot}/numbers", self._arrived, 10)
            node.create_service(Trigger, f"/{self.name}/ask", lambda request, response: response)
            clients = [node.create_client(Trigger, f"/robot_{slot}/ask") for slot in range(SLOTS)]
            async with asyncio.TaskGroup() as group:
                for client in clients:
                    group.create_task(self._call(client))
                number = 0
                while True:
                    publisher.publish(String(data=f"{source}:{number}"))
                    number += 1
                    await asyncio.sleep(PERIOD_SEC)

    def _arrived(self, message: String) -> None:
        self._counts["arrived here"] += 1
        if wrong := self._orders.check(message.data):
            self._wrong.append(f"{self.name}: {wrong}")

    async def _call(self, client: actors.Client[Trigger.Request, Trigger.Response]) -> None:
        while True:
            try:
                await client.call(Trigger.Request(), timeout_sec=CALL_SEC)
                self._counts["calls"] += 1
            except (actors.ServiceUnavailable, actors.ServiceTimeout) as error:
                self._counts[f"calls that failed: {type(error).__name__}"] += 1
            except actors.CallboardError as error:
                self._wrong.append(f"{self.name} calls {client.srv_name}: {error!r}")
            await asyncio.sleep(PERIOD_SEC)


class Soak:
    """One soak.

    Args:
        seconds: How long it lasts.
        seed: Of its choices.
        folder: For logs.

    Attributes:
        counts: What has happened.
        wrong: What must not happen.
    """

    def __init__(self, seconds: float, seed: int, folder: Path) -> None:
        self._seconds = seconds
        self._random = random.Random(seed)
        self._network = Network(folder)
        self.counts: Counter[str] = Counter()
        self.wrong: list[str] = []
        self._robots = [Robot(self._network, slot) for slot in range(SLOTS)]
        self._stations = [Station(self._network.url, slot, self.counts, self.wrong) for slot in range(SLOTS)]
        self._bridge: Process | None = None
        self._visits = 0

    async def run(self) -> None:
        """Run it, and print figures."""
        try:
            self._network.broker()
            await self._start_all()
            await self._churn(self._seconds / 2, bridge=True)
            async with actors.Node("observer", url=self._network.url) as observer:
                assert self._bridge is not None
                self._take_output()
                await self._churn(self._seconds / 2 * WARM_UP_PART, bridge=False)
                before = await self._figures(observer)
                await self._churn(self._seconds / 2 * (1 - WARM_UP_PART), bridge=False)
                after = await self._figures(observer)
                _print(f"the bridge after its warm-up: {asdict(before)}")
                _print(f"the bridge at the end:        {asdict(after)}")
                self._compare(before, after)
                if (lines := self._take_output()) > LINES_PER_SEC * self._seconds / 2:
                    self.wrong.append(f"the bridge has logged {lines} lines")
                await self._check_calls(observer)
                await self._check_counts(observer)
                await self._check_counts_there(observer)
            for robot in self._robots:
                self.wrong += await robot.check()
                self.counts["arrived there"] += robot.received
        finally:
            for station in self._stations:
                await station.end()
            await asyncio.to_thread(self._network.close)
        _print(f"counts: {dict(self.counts)}")
        for text in self.wrong:
            _print(f"wrong: {text}")

    def _take_output(self) -> int:
        """Note tracebacks in what the bridge has printed since the last call; return how many lines it is."""
        assert self._bridge is not None
        output = self._bridge.output()
        if "Traceback" in output:
            self.wrong.append(f"the bridge prints {output}")
        return output.count("\n")

    async def _figures(self, observer: actors.Node) -> Figures:
        """Return what the bridge has, once all is calm."""
        await self._check_graphs(observer)
        await asyncio.sleep(SETTLE_SEC)
        assert self._bridge is not None
        pid, report = self._bridge.pid, await self._report()
        name = f"/ros2_bridge_{self._network.domain}_{report['id']}"
        client = observer.create_client(GetDiagnostics, f"{name}/get_diagnostics")
        diagnostics = await client.call(GetDiagnostics.Request())
        client.destroy()
        return Figures(
            memory_kib=round(meters.memory_kib(pid) or 0),
            descriptors=meters.open_files(pid) or 0,
            threads=_threads(pid),
            connections=diagnostics.connections,
            shown=json.dumps(report["shown"]),
        )

    def _compare(self, before: Figures, after: Figures) -> None:
        limits = (
            ("memory_kib", MORE_KIB),
            ("descriptors", MORE_DESCRIPTORS),
            ("threads", MORE_THREADS),
            ("connections", 0),
        )
        for name, most in limits:
            now, then = getattr(after, name), getattr(before, name)
            if now > then + most:
                self.wrong.append(f"{name} of the bridge: {now}, not {then}")
        if after.shown != before.shown:
            self.wrong.append(f"the bridge shows {after.shown}, not {before.shown}")

    async def _start_all(self) -> None:
        if self._bridge is None:
            self._bridge = self._network.bridge()
        for station in self._stations:
            station.start()
        for robot in self._robots:
            async with robot.busy:
                await robot.start()

    async def _churn(self, seconds: float, *, bridge: bool) -> None:
        """Let things happen for some time, also to the bridge; then start again what does not run."""
        with suppress(TimeoutError):
            async with asyncio.timeout(seconds), asyncio.TaskGroup() as group:
                group.create_task(self._let_happen(bridge=bridge))
                group.create_task(self._print_progress())
        await self._start_all()

    async def _let_happen(self, *, bridge: bool) -> None:
        """Let something happen again and again. Each event is whole: the time is over only between two."""
        kinds = ("robot", "robot", "station", "visitor", *(("bridge",) if bridge else ()))
        while True:
            await asyncio.sleep(STEP_SEC * self._random.random())
            event = asyncio.create_task(self._event(self._random.choice(kinds)))
            try:
                await asyncio.shield(event)
            except asyncio.CancelledError:
                await event
                raise

    async def _event(self, kind: str) -> None:
        kill = self._random.random() < 0.5
        ending = "ended" if kind == "station" else "killed" if kill else "stopped"
        self.counts[f"{kind} {ending}"] += 1
        if kind == "bridge":
            assert self._bridge is not None
            self._take_output()
            if kill:
                self._bridge.kill()
            else:
                await asyncio.to_thread(self._bridge.stop)
            await asyncio.sleep(STEP_SEC * self._random.random())
            self._bridge = self._network.bridge()
        elif kind == "robot":
            robot = self._random.choice(self._robots)
            self.wrong += await robot.check()
            await robot.end(kill=kill)
            await asyncio.sleep(STEP_SEC * self._random.random())
            await robot.start()
        elif kind == "station":
            station = self._random.choice(self._stations)
            await station.end()
            await asyncio.sleep(STEP_SEC * self._random.random())
            station.start()
        else:
            await self._visit(kill=kill)

    async def _visit(self, *, kill: bool) -> None:
        """Let a process of callboard come and go."""
        topic, message = "/stations/numbers", f"{{data: 'visitor.{self._visits}:0'}}"
        self._visits += 1
        process = self._network.callboard(
            "topic", "pub", topic, "std_msgs/msg/String", message, "--rate", "1"
        )
        await asyncio.sleep(STEP_SEC * self._random.random())
        if kill:
            process.kill()
        else:
            await asyncio.to_thread(process.stop)

    async def _print_progress(self) -> None:
        while True:
            await asyncio.sleep(PROGRESS_SEC)
            _print(f"so far: {dict(self.counts)}, {len(self.wrong)} wrong")

    async def _check_graphs(self, observer: actors.Node) -> None:
        """Wait until both graphs show what is there and nothing else; note what they show otherwise."""
        robots = {f"/{each.name}" for each in self._robots}
        stations = {f"/{each.name}" for each in self._stations}

        def is_right(graph: GraphSnapshot) -> bool:
            nodes = [each for each in graph.of_kind(EntryKind.NODE) if not each.node.startswith("/_")]
            mirrors = sorted(each.node for each in nodes if "origin" in graph.labels_of(each))
            return mirrors == sorted(robots) and stations <= {each.node for each in nodes}

        try:
            await graph_until(observer, is_right)
        except AssertionError as error:
            self.wrong.append(f"callboard: {error}")
        node = self._robots[0].node
        assert node is not None
        try:
            await node.node_names(*robots, *stations, "/observer")
            await node.endpoints("/stations/numbers", "publishers", SLOTS)
        except AssertionError as error:
            self.wrong.append(f"ROS 2: {error}")

    async def _check_calls(self, observer: actors.Node) -> None:
        """Call each service from the other side: none may be out of reach now."""
        for robot, station in zip(self._robots, self._stations, strict=True):
            client = observer.create_client(Trigger, f"/{robot.name}/ask")
            try:
                await client.call(Trigger.Request(), timeout_sec=WAIT_SEC)
            except actors.CallFailed as error:
                self.wrong.append(f"a call to {robot.name} at the end: {error!r}")
            assert robot.node is not None
            try:
                await (await robot.node.client(f"/{station.name}/ask", Trigger)).call(Trigger.Request())
            except AssertionError as error:
                self.wrong.append(f"a call of {robot.name} to {station.name} at the end: {error!r}")

    async def _check_counts(self, observer: actors.Node) -> None:
        """Publish faster than queues can hold, and compare what was published with what was counted."""
        node = self._robots[0].node
        assert node is not None
        received: list[str] = []
        subscription = observer.create_subscription(
            String, "/burst", lambda each: received.append(each.data), 10
        )
        publisher = await node.publisher("/burst", String)
        await publisher.matched()
        await until(lambda: subscription.get_publisher_count() == 1)
        # The gap behind a publisher's first message is counted, not one in front of it.
        await publisher.publish(String(data="first"))
        await until(lambda: received)
        await publisher.publish(*[String(data=str(number)) for number in range(BURST)])
        published = BURST + 1
        # The gap before a message that arrives is known; so the last ones must arrive.
        while not received or received[-1] != "last":
            await publisher.publish(String(data="last"))
            published += 1
            await asyncio.sleep(PERIOD_SEC)
        counts = await self._counts_of("/burst")
        dropped = sum(counts["dropped"].values())
        lost_here = subscription.dropped + subscription.lost
        self.counts["burst"], self.counts["burst delivered"] = published, len(received)
        self.counts["burst lost at the edge"] = counts["lost"]
        self.counts["burst dropped"] = dropped + lost_here
        if published != len(received) + counts["lost"] + dropped + lost_here:
            self.wrong.append(
                f"of {published} messages {len(received)} arrived, {lost_here} lost here, {counts}"
            )

    async def _check_counts_there(self, observer: actors.Node) -> None:
        """Do the same in the other direction; ROS 2 does not say what it drops behind the bridge."""
        node = self._robots[0].node
        assert node is not None
        subscription = await node.subscription("/burst_there", String)
        publisher = observer.create_publisher(String, "/burst_there", 10)
        await publisher.wait_for_subscriptions()
        await subscription.matched()
        publisher.publish(String(data="first"))
        while not await subscription.take_texts():
            await asyncio.sleep(PERIOD_SEC)
        for number in range(BURST):
            publisher.publish(String(data=str(number)))
            if number % 100 == 0:
                await asyncio.sleep(0)
        published = BURST + 1
        counts: dict[str, Any] = {"received": 0, "lost": 0}
        # The gap before a message that arrives is known; so the last ones must arrive.
        for _ in range(LAST_MESSAGES):
            if counts["received"] + counts["lost"] == published:
                break
            publisher.publish(String(data="last"))
            published += 1
            await asyncio.sleep(PERIOD_SEC)
            counts = await self._counts_of("/burst_there")
        delivered = await subscription.take_texts()
        dropped = sum(counts["dropped"].values())
        self.counts["burst there"], self.counts["burst there crossed"] = published, counts["sent"]
        self.counts["burst there lost or dropped"] = counts["lost"] + dropped
        self.counts["burst there delivered"] = len(delivered)
        whole = counts["sent"] + dropped + counts["lost"] == published
        if not whole or "last" not in delivered or len(delivered) > counts["sent"]:
            self.wrong.append(f"of {published} messages {len(delivered)} arrived in ROS 2, {counts}")

    async def _counts_of(self, topic: str) -> dict[str, Any]:
        """Return what the bridge has counted of a topic that crosses in one direction."""
        [counts] = [each for each in (await self._report())["topics"] if each["name"] == topic]
        return dict(counts)

    async def _report(self) -> dict[str, Any]:
        """Return what the bridge reports."""
        process = self._network.callboard("bridge", "info", "--json")
        assert await asyncio.to_thread(process.wait) == 0, process.output()
        output = process.output()
        for line in output.splitlines():
            if line.startswith("["):
                with suppress(json.JSONDecodeError):
                    [found] = json.loads(line)
                    return dict(found)
        raise AssertionError(f"bridge info prints {output}")


def _threads(pid: int) -> int:
    return sum(1 for _ in Path(f"/proc/{pid}/task").iterdir())


def _print(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def main() -> int:
    """Run a soak; return 1 if something was wrong."""
    parser = argparse.ArgumentParser(prog="python -m tests.ros2.soak", description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0, help="for how long")
    parser.add_argument("--seed", type=int, default=None, help="of its choices; default: a new one")
    chosen = parser.parse_args()
    if not is_supported():
        _print("no soak: there is no ROS 2 for this platform and interpreter")
        return 0
    logging.getLogger("callboard").setLevel(logging.ERROR)
    seed = random.SystemRandom().randrange(2**32) if chosen.seed is None else chosen.seed
    _print(f"seed {seed}")
    with tempfile.TemporaryDirectory() as folder:
        soak = Soak(chosen.minutes * 60, seed, Path(folder))
        asyncio.run(soak.run())
    return 1 if soak.wrong else 0


if __name__ == "__main__":
    raise SystemExit(main())

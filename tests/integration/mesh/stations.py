"""Brokers of a mesh as processes, and nodes in this process that check what they hear and call."""

from __future__ import annotations

import asyncio
import signal
import sys
from typing import TYPE_CHECKING, Final, Self

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String
from actors.testing.changes import ChangeSignal
from tests.integration.conftest import DEADLINE_SEC, NO_KEEPALIVE, free_port, wait_for_subscriptions

if TYPE_CHECKING:
    from collections.abc import Iterable
    from contextlib import AsyncExitStack
    from pathlib import Path
    from types import TracebackType

    from tests.integration.conftest import Program, System

KEEP_ALL: Final = actors.QoSProfile(history=actors.HistoryPolicy.KEEP_ALL)
NEVER_SILENT: Final = (*NO_KEEPALIVE, "--mesh-lease-sec", str(10 * DEADLINE_SEC))
"""Options of brokers that do not notice silence in time, as that of a process that gets no processor."""
PERIOD_SEC: Final = 0.05
"""Between two messages of a station that publishes until it is heard."""
KEPT: Final = 10
"""How many messages a late joiner gets of each station."""
LATCHED: Final = actors.QoSProfile(depth=KEPT, durability=actors.DurabilityPolicy.TRANSIENT_LOCAL)


class MeshBroker:
    """A broker of a mesh, which can be started again at the same addresses.

    Args:
        system: Starts it.
        connect: The brokers, or other endpoints, to which it connects.
        host: Its address for other brokers, and for nodes.
        unix: Its address for nodes, instead.
        prefix: A command that runs another, such as `ip netns exec NAME`.
    """

    def __init__(
        self,
        system: System,
        connect: Iterable[MeshBroker | str] = (),
        *,
        host: str = "127.0.0.1",
        unix: Path | None = None,
        prefix: tuple[str, ...] = (),
    ) -> None:
        self._system = system
        self._prefix = prefix
        port = free_port()
        self.url = f"callboard://{host}:{port}" if unix is None else f"callboard+unix://{unix}"
        here = ("--port", str(port)) if unix is None else ("--unix", str(unix), "--insecure")
        self.endpoint = f"tcp/{host}:{free_port()}"
        to = ",".join(each if isinstance(each, str) else each.endpoint for each in connect)
        self._options = (*here, "--mesh-listen", self.endpoint, *(("--mesh", to) if to else ()), "--insecure")
        self.program: Program | None = None

    async def start(self, *options: str) -> Self:
        """Start it and wait until it listens for nodes."""
        command = (*self._prefix, sys.executable, "-m", "broker")
        self.program = await self._system.program(*command, *self._options, *options)
        await self.program.wait_for_line(f"callboard broker listening on {self.url}")
        return self

    async def kill(self) -> None:
        """Send SIGKILL and wait for the end."""
        assert self.program is not None
        await self.program.kill()

    def kill_now(self) -> None:
        """Send SIGKILL."""
        assert self.program is not None
        self.program.send_signal(signal.SIGKILL)

    def stop(self) -> None:
        """Send SIGTERM."""
        assert self.program is not None
        self.program.send_signal(signal.SIGTERM)


class Station:
    """A node at a broker. All stations publish numbers, hear each other (themselves included), and serve.

    Args:
        name: Its name, and that of its service.
        url: Its broker.
        domain: Its domain.

    Attributes:
        node: The node.
        heard: By station, the numbers that came, in their order.
        wrong: Numbers that came twice or out of order.
        kept: As `heard`, but of the topic with latched values.
    """

    def __init__(self, name: str, url: str, *, domain: int = 0) -> None:
        self.name = name
        self.node = actors.Node(name, url=url, domain=domain)
        self.publisher = self.node.create_publisher(String, "numbers", KEEP_ALL)
        self.keeper = self.node.create_publisher(String, "kept", LATCHED)
        self.heard: dict[str, list[int]] = {}
        self.kept: dict[str, list[int]] = {}
        self.wrong: list[str] = []
        self._changes = ChangeSignal()
        self.subscription = self.node.create_subscription(String, "numbers", self._on_number, KEEP_ALL)
        self.node.create_subscription(String, "kept", self._on_kept, LATCHED)
        self.node.create_service(AddTwoInts, name, self._add)
        self._clients: dict[str, actors.Client[AddTwoInts.Request, AddTwoInts.Response]] = {}

    async def __aenter__(self) -> Self:
        """Run the node."""
        await self.node.__aenter__()
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Stop the node."""
        await self.node.__aexit__(kind, error, traceback)

    def _on_number(self, msg: String) -> None:
        self._take(self.heard, msg)

    def _on_kept(self, msg: String) -> None:
        self._take(self.kept, msg)

    def _take(self, heard: dict[str, list[int]], msg: String) -> None:
        sender, number = msg.data.split()[:2]
        numbers = heard.setdefault(sender, [])
        if numbers and int(number) <= numbers[-1]:
            self.wrong.append(f"{self.name} heard {msg.data[:40]} after {numbers[-1]}")
        numbers.append(int(number))
        self._changes.notify()

    @staticmethod
    def _add(request: AddTwoInts.Request, response: AddTwoInts.Response) -> AddTwoInts.Response:
        response.sum = request.a + request.b
        return response

    def publish(self, count: int, padding: str = "") -> None:
        """Publish the next numbers."""
        for number in range(self.publisher.published, self.publisher.published + count):
            self.publisher.publish(String(data=f"{self.name} {number} {padding}"))

    def keep(self, count: int) -> None:
        """Publish the next numbers on the topic with latched values."""
        for number in range(self.keeper.published, self.keeper.published + count):
            self.keeper.publish(String(data=f"{self.name} {number}"))

    async def wait_to_hear(self, sender: Station, number: int | None = None) -> None:
        """Wait until a number of a station has come: by default the last one published."""
        last = sender.publisher.published - 1 if number is None else number
        await self._wait(self.heard, sender, last)

    async def wait_to_keep(self, sender: Station) -> None:
        """Wait until the last latched number of a station has come."""
        await self._wait(self.kept, sender, sender.keeper.published - 1)

    async def _wait(self, heard: dict[str, list[int]], sender: Station, last: int) -> None:
        try:
            async with asyncio.timeout(DEADLINE_SEC):
                await self._changes.wait_for(lambda: heard.get(sender.name, [-1])[-1] >= last or None)
        except TimeoutError:
            numbers = heard.get(sender.name, [])
            text = f"{self.name} heard {len(numbers)} numbers of {sender.name}, the last {numbers[-1:]}"
            raise AssertionError(f"{text}, not {last}") from None

    def last(self, sender: Station) -> int:
        """Return the last number that has come of a station; -1 for none."""
        return self.heard.get(sender.name, [-1])[-1]

    async def call(self, server: Station, timeout_sec: float = DEADLINE_SEC) -> None:
        """Call a station's service and check the answer."""
        response = await self.client(server).call(AddTwoInts.Request(a=20, b=22), timeout_sec=timeout_sec)
        assert response.sum == 42

    def client(self, server: Station) -> actors.Client[AddTwoInts.Request, AddTwoInts.Response]:
        """Return the client of a station's service."""
        if server.name not in self._clients:
            self._clients[server.name] = self.node.create_client(AddTwoInts, server.name)
        return self._clients[server.name]

    async def wait_until_alone(self, count: int) -> None:
        """Wait until exactly `count` stations are matched with this one's publisher."""
        await wait_for_subscriptions(self.publisher, count)


def make_brokers(system: System, topology: tuple[tuple[int, ...], ...]) -> list[MeshBroker]:
    """Return the brokers of a topology, which has the brokers to which each connects; none runs yet."""
    brokers: list[MeshBroker] = []
    for connect in topology:
        brokers.append(MeshBroker(system, [brokers[each] for each in connect]))
    return brokers


async def start_all(brokers: list[MeshBroker], stack: AsyncExitStack, *options: str) -> list[Station]:
    """Start brokers together, with a station at each, and wait until all see all."""
    await asyncio.gather(*(each.start(*options) for each in brokers))
    stations = [
        await stack.enter_async_context(Station(f"station_{i}", each.url)) for i, each in enumerate(brokers)
    ]
    await wait_until_joined(*stations)
    return stations


async def wait_until_joined(*stations: Station) -> None:
    """Wait until each station has found all others and matches exactly these."""
    async with asyncio.TaskGroup() as group:
        for one in stations:
            group.create_task(one.wait_until_alone(len(stations)))
            for other in stations:
                group.create_task(_found(one, other))


async def _found(one: Station, other: Station) -> None:
    name = f"/{other.name}"
    assert await one.node.wait_for_node(name, DEADLINE_SEC), f"{one.name} does not see {name}"
    assert await one.client(other).wait_for_service(DEADLINE_SEC), f"{one.name} finds no service of {name}"


async def check_traffic(*stations: Station, count: int = 50) -> None:
    """Let each station publish: each hears each number once and in order, and can call each other."""
    first = {each.name: each.publisher.published for each in stations}
    for each in stations:
        each.publish(count)
    for each in stations:
        for other in stations:
            await each.wait_to_hear(other)
            await each.call(other)
    for each in stations:
        assert not each.wrong
        for name, number in first.items():
            numbers = [heard for heard in each.heard[name] if heard >= number]
            assert numbers == list(range(number, number + count)), f"{name} at {each.name}"


async def check_again(*stations: Station) -> None:
    """Let each station publish and call until each has heard and reached each other.

    After a change of route, messages and calls get lost until all routers know of it, and brokers that have
    lost messages begin anew with their next heartbeats.
    """
    first = {each.name: each.publisher.published for each in stations}
    async with asyncio.timeout(DEADLINE_SEC), asyncio.TaskGroup() as group:
        for each in stations:
            group.create_task(_publish_until_heard(each, stations, first[each.name]))
            for other in stations:
                group.create_task(_call_until_answered(each, other))
    assert not [wrong for each in stations for wrong in each.wrong]


async def _publish_until_heard(one: Station, stations: tuple[Station, ...], first: int) -> None:
    while any(each.last(one) < first for each in stations):
        one.publish(1)
        await asyncio.sleep(PERIOD_SEC)


async def _call_until_answered(one: Station, server: Station) -> None:
    while True:
        try:
            await one.call(server)
        except actors.ServiceUnavailable:
            await asyncio.sleep(PERIOD_SEC)
        else:
            return

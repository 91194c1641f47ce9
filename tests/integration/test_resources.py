"""Exhaustion and accumulation: descriptors, short connections, thousands of cancelled calls."""

from __future__ import annotations

import asyncio
import socket
import struct
from contextlib import ExitStack
from typing import TYPE_CHECKING

import pytest

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int64
from actors.interfaces.std_srvs.srv import Trigger
from benchmarks.harness import meters
from proto.limited_log import MAX_LINES
from tests.broker.rawclient import GREETING_BYTES
from tests.integration.conftest import DEADLINE_SEC, wait_for_subscriptions

if TYPE_CHECKING:
    from pathlib import Path

    import broker
    from tests.integration.conftest import Program, System


CRAMPED_BROKER = """
import resource, runpy, sys
resource.setrlimit(resource.RLIMIT_NOFILE, (80, 80))
if sys.argv.pop(1) == "asyncio":
    sys.modules["uvloop"] = None
runpy.run_module("broker", run_name="__main__")
"""

COUNTING_SERVER = """
import asyncio
import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_srvs.srv import Trigger

class Counting(actors.Node):
    def __init__(self):
        super().__init__("counting")
        self.active = 0
        self.create_service(AddTwoInts, "never", self.never, concurrent=True)
        self.create_service(Trigger, "active", self.count, concurrent=True)

    async def never(self, request):
        self.active += 1
        try:
            await asyncio.Event().wait()
        finally:
            self.active -= 1

    def count(self, request, response):
        response.message = str(self.active)
        return response

actors.run(Counting)
"""


@pytest.mark.parametrize("loop", ["uvloop", "asyncio"])
async def test_a_broker_out_of_descriptors_serves_its_connections(system: System, loop: str) -> None:
    """Case 8: it refuses others with a reason, does not spin, and accepts again when descriptors are free."""
    options = ("--port", str(system.port), "--handshake-timeout-sec", "1000")  # callers say nothing
    daemon = await system.python("-c", CRAMPED_BROKER, loop, *options)
    await daemon.wait_for_line("listening on")
    loop_now = asyncio.get_running_loop()
    async with actors.Node("inside", url=system.url) as inside, asyncio.timeout(DEADLINE_SEC):
        publisher = inside.create_publisher(Int64, "t", 10)
        received = aiter(inside.create_subscription(Int64, "t", qos_profile=10))
        await wait_for_subscriptions(publisher)
        with ExitStack() as stack:
            for _ in range(60):
                caller = stack.enter_context(socket.socket())
                caller.setblocking(False)
                await loop_now.sock_connect(caller, ("127.0.0.1", system.port))
            await daemon.wait_for_line("limit of open files")
            used = meters.cpu_s(daemon.process.pid)
            for number in range(20):
                publisher.publish(Int64(data=number))
                assert (await anext(received)).data == number
                await asyncio.sleep(0.05)
            now = meters.cpu_s(daemon.process.pid)
            assert used is not None
            assert now is not None
            assert now - used < 0.5  # a loop that spins takes all it can get of more than a second
            with pytest.raises(actors.BrokerUnreachable):
                async with actors.Node("outside", url=system.url, connect_timeout_sec=0.5):
                    pass
        async with actors.Node("outside", url=system.url, connect_timeout_sec=DEADLINE_SEC):
            pass
        assert inside.connected
    assert await daemon.stop() == 0
    assert daemon.output.count("Refused") == MAX_LINES
    assert "more like this: this broker accepts" in daemon.output
    assert "Traceback" not in daemon.output


def connect_and_leave(port: int, count: int) -> None:
    """Connect `count` times, and leave after none, part or all of a greeting, by a reset."""
    for number in range(count):
        with socket.create_connection(("127.0.0.1", port), DEADLINE_SEC) as caller:
            # A reset leaves no port in TIME_WAIT behind: there are not enough of them for all.
            caller.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            if number % 4:
                caller.send(GREETING_BYTES[: (number % 4) * len(GREETING_BYTES) // 3])


async def test_short_connections_leave_nothing(system: System) -> None:
    """Case 32: after ten thousand the broker holds no descriptor and no memory of theirs, and serves."""
    daemon = await system.broker("--log-level", "error")
    pid = daemon.process.pid
    async with actors.Node("inside", url=system.url) as inside:
        client = inside.create_client(Trigger, "nobody")
        await asyncio.to_thread(connect_and_leave, system.port, 2000)
        await inside.get_graph()
        before = meters.memory_kib(pid)
        await asyncio.to_thread(connect_and_leave, system.port, 8000)
        with pytest.raises(actors.ServiceUnavailable):
            await client.call(Trigger.Request())
        async with asyncio.timeout(DEADLINE_SEC):
            while (meters.open_files(pid) or 0) > 20:
                await inside.get_graph()
        after = meters.memory_kib(pid)
        assert before is not None
        assert after is not None
        assert after - before < 4096
        assert inside.connected


async def test_ten_thousand_calls_cancelled_at_once_leave_nothing(hub: broker.Broker, system: System) -> None:
    """Case 39: afterwards nothing is pending at caller, broker and server."""
    calls = 10_000
    system.url = hub.url
    await system.python("-c", COUNTING_SERVER)
    async with actors.Node("caller", url=hub.url) as node:
        never = node.create_client(AddTwoInts, "never")
        active = node.create_client(Trigger, "active")
        assert await never.wait_for_service(DEADLINE_SEC)
        assert await active.wait_for_service(DEADLINE_SEC)
        pending = [never.call_async(AddTwoInts.Request(a=i), timeout_sec=1000) for i in range(calls)]
        async with asyncio.timeout(DEADLINE_SEC):
            while hub.stats().pending_calls < calls:
                await node.get_graph()
            while (await active.call(Trigger.Request())).message == "0":
                pass
            for call in pending:
                call.cancel()
            assert never.pending == 0
            while (await active.call(Trigger.Request())).message != "0":
                pass
            assert all(call.cancelled() for call in pending)
            while hub.stats().pending_calls:
                await node.get_graph()
        assert node.connected


@pytest.mark.parametrize("transport", ["tcp", "unix"])
async def test_an_address_in_use_is_reported_in_one_line(
    system: System, tmp_path: Path, transport: str
) -> None:
    """The second broker exits with 1 and says why and what to do; the first continues."""
    where = ("--unix", str(tmp_path / "b.sock")) if transport == "unix" else ("--port", str(system.port))
    first = await system.python("-m", "broker", *where)
    url = (await first.wait_for_line("listening on")).split()[-1]
    second = await system.python("-m", "broker", *where)
    assert await second.wait_for_exit() == 1
    (line,) = second.lines
    assert line.startswith("Cannot listen on ")
    assert "hoose another" in line
    async with actors.Node("node", url=url, connect_timeout_sec=DEADLINE_SEC) as node:
        assert await node.get_fully_qualified_node_names() == ["/node"]


async def test_the_socket_file_of_a_killed_broker_is_replaced(system: System, tmp_path: Path) -> None:
    """The file does not prevent the next broker from listening there."""
    path = tmp_path / "b.sock"

    async def start() -> Program:
        daemon = await system.python("-m", "broker", "--unix", str(path))
        await daemon.wait_for_line("listening on")
        return daemon

    await (await start()).kill()
    assert path.is_socket()
    daemon = await start()
    async with actors.Node("node", url=f"callboard+unix://{path}", connect_timeout_sec=DEADLINE_SEC) as node:
        await node.get_graph()
    assert await daemon.stop() == 0
    assert not path.exists()

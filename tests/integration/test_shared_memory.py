"""Shared memory between processes that are killed or frozen: wrong content never arrives, nothing is left."""

from __future__ import annotations

import asyncio
import gc
import signal
import sys
from contextlib import suppress
from typing import TYPE_CHECKING, Final

import pytest

import actors
from actors.interfaces.std_msgs.msg import UInt8MultiArray
from tests.integration.conftest import DEADLINE_SEC, wait_for_subscriptions
from tests.integration.slot_kills import descriptors, mappings
from tests.waiting import until

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from tests.integration.conftest import System

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="arenas are memfds")

SIZE: Final = 200_000
KEEP_ALL = actors.QoSProfile(history=actors.HistoryPolicy.KEEP_ALL)
ROUNDS: Final = 3
"""`slot_kills.py` kills at each step of a slot's life, and often."""

TALKER = """
import asyncio, sys
import actors
from actors.interfaces.std_msgs.msg import UInt8MultiArray

async def main():
    async with actors.Node("talker") as node:
        publisher = node.create_publisher(UInt8MultiArray, "t", 10)
        await publisher.wait_for_subscriptions()
        number = 0
        while True:
            for _ in range(5):
                publisher.publish(UInt8MultiArray(data=bytes([number % 251]) * int(sys.argv[1])))
                number += 1
            if number == 50:
                print("running", node.diagnostics().shared_memory.sent, flush=True)
            if not number % 500:
                print("full", node.diagnostics().shared_memory.full, flush=True)
            await asyncio.sleep(0.001)

actors.run(main)
"""

READER = """
import actors
from actors.interfaces.std_msgs.msg import UInt8MultiArray

class Reader(actors.Node):
    def __init__(self):
        super().__init__("reader")
        self.count = 0
        self.create_subscription(UInt8MultiArray, "t", self.on_message, 10)

    def on_message(self, message):
        data = bytes(message.data)
        if data != data[:1] * len(data):
            print("MIXED", data[:1], set(data), flush=True)
        self.count += 1
        if self.count == 20:
            print("reading", self.diagnostics().shared_memory.received, flush=True)

actors.run(Reader)
"""


class Reading:
    """A node in this process that checks the content of what it receives.

    Attributes:
        node: The node.
        count: Messages received.
    """

    def __init__(self, node: actors.Node, *, slow: bool = False) -> None:
        self.node = node
        self.count = 0
        self._slow = slow
        self.subscription = node.create_subscription(UInt8MultiArray, "t", self._take, 10)

    async def _take(self, message: UInt8MultiArray) -> None:
        data = bytes(message.data)
        assert data == data[:1] * len(data)
        self.count += 1
        if self._slow:
            await asyncio.sleep(0.01)

    @property
    def referred(self) -> int:
        """Messages received by reference."""
        return self.node.diagnostics().shared_memory.received

    async def go_on(self, count: int = 20) -> None:
        """Wait for further messages, by reference."""
        before = self.referred
        await until(lambda: self.referred >= before + count)


@pytest.fixture(autouse=True)
def _nothing_left() -> Iterator[None]:
    """Nodes of this process close and unmap what they had."""
    gc.collect()
    mapped, opened = mappings(), descriptors()
    yield
    gc.collect()
    assert mappings() <= mapped
    assert descriptors() <= opened


async def test_three_processes_share_a_message(system: System) -> None:
    """Publisher, broker and subscriber are processes; what arrives is by reference, and complete."""
    await system.broker()
    reader = await system.python("-c", READER)
    talker = await system.python("-c", TALKER, str(SIZE))
    assert int((await talker.wait_for_line("running")).split()[1]) > 0
    assert int((await reader.wait_for_line("reading")).split()[1]) > 0
    await talker.stop()
    await reader.stop()
    assert "MIXED" not in reader.output


async def test_killed_publishers_leave_nothing(system: System) -> None:
    """Each time what arrives is complete, and the broker unmaps its memory."""
    broker = await system.broker()
    async with actors.Node("reading", url=system.url) as node:
        reading = Reading(node)
        for _ in range(ROUNDS):
            talker = await system.python("-c", TALKER, str(SIZE))
            await reading.go_on()
            await talker.kill()
            await until(lambda: not reading.subscription.get_publisher_count())
        await until(lambda: mappings(broker.process.pid) == 1)  # its own, with its secret
        await until(lambda: descriptors(broker.process.pid) == 2)  # mmap has a copy
        assert node.diagnostics().callback_errors == 0


async def test_killed_readers_give_back_what_they_held(system: System) -> None:
    """The publisher goes on, and has nearly all of its memory at the end."""
    await system.broker()
    async with actors.Node("talker", url=system.url) as node:
        publisher = node.create_publisher(UInt8MultiArray, "t", 10)
        received = 0
        for number in range(ROUNDS):
            reader = await system.python("-c", READER)
            await wait_for_subscriptions(publisher)
            until_reading = asyncio.create_task(reader.wait_for_line("reading"))
            while not until_reading.done():
                publisher.publish(UInt8MultiArray(data=bytes([number]) * SIZE))
                await asyncio.sleep(0.001)
            by_reference = int(until_reading.result().split()[1])
            assert by_reference > 0
            received += by_reference
            await reader.kill()
            await wait_for_subscriptions(publisher, 0)
        full = node.diagnostics().shared_memory.full  # as often as a reader was much slower than this process
        publisher.publish(UInt8MultiArray(data=bytes(60 * 1024 * 1024)))
        shared = node.diagnostics().shared_memory
        assert shared.full == full
        assert shared.sent >= received


async def test_killed_brokers_are_replaced(system: System) -> None:
    """The nodes share memory with the next one, and messages stay complete."""
    broker = await system.broker()
    talker = await system.python("-c", TALKER, str(SIZE))
    async with actors.Node("reading", url=system.url) as node:
        reading = Reading(node)
        for _ in range(ROUNDS):
            await reading.go_on()
            await broker.kill()
            broker = await system.broker()
        await reading.go_on()
        await until(lambda: (mappings(talker.process.pid), descriptors(talker.process.pid)) == (1, 2))
        assert node.diagnostics().callback_errors == 0


async def test_a_reader_that_was_frozen_never_takes_what_was_written_later(system: System) -> None:
    """Its link ends meanwhile, and its memory is used again; it finds references in its socket then."""
    await system.broker("--keepalive-sec", "0.3", "--suspend-close-sec", "0.3")
    reader = await system.python("-c", READER)
    async with actors.Node("talker", url=system.url) as node:
        publisher = node.create_publisher(UInt8MultiArray, "t", 10)
        await wait_for_subscriptions(publisher)
        number = 0

        async def publish_until(condition: Callable[[], object]) -> None:
            nonlocal number
            async with asyncio.timeout(DEADLINE_SEC):
                while not condition():
                    number = (number + 1) % 251
                    publisher.publish(UInt8MultiArray(data=bytes([number]) * SIZE))
                    await asyncio.sleep(0.001)

        await publish_until(lambda: "reading" in reader.output)
        for _ in range(3):
            reader.send_signal(signal.SIGSTOP)
            await publish_until(lambda: not publisher.get_subscription_count())
            names = ["/reader"]
            async with asyncio.timeout(DEADLINE_SEC):
                while "/reader" in names:
                    await asyncio.sleep(0.01)
                    with suppress(actors.BrokerUnreachable):  # a pause of the machine has ended its link
                        names = await node.get_fully_qualified_node_names()
            for _ in range(500):
                number = (number + 1) % 251
                publisher.publish(UInt8MultiArray(data=bytes([number]) * SIZE))
            reader.send_signal(signal.SIGCONT)
            await publish_until(publisher.get_subscription_count)
        await reader.stop()
        assert "MIXED" not in reader.output


async def test_a_slow_reader_does_not_fill_the_memory(system: System) -> None:
    """What it does not read waits within its depth, while a fast one gets everything by reference."""
    await system.broker()
    talker = await system.python("-c", TALKER, "1000000")
    async with actors.Node("fast", url=system.url) as fast, actors.Node("slow", url=system.url) as slow:
        readings = Reading(fast), Reading(slow, slow=True)
        await talker.wait_for_line("running")
        for reading in readings:
            await reading.go_on(100)
        talker.skip()
        full = await talker.wait_for_line("full")
        # Of at least 500. Some do not fit while the broker has no processor to hand on what is before them.
        assert int(full.split()[1]) < 50
        await talker.stop()
        assert all(reading.node.diagnostics().callback_errors == 0 for reading in readings)

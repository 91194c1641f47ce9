"""Slow and frozen readers, large messages and many nodes do not block others."""

from __future__ import annotations

import asyncio
import signal
from typing import TYPE_CHECKING

import pytest

import actors
from actors.interfaces.std_msgs.msg import Int64, String, UInt8MultiArray
from tests.actors.meeting import BARE
from tests.integration.conftest import DEADLINE_SEC, NO_KEEPALIVE, wait_for_subscriptions

if TYPE_CHECKING:
    import broker
    from tests.integration.conftest import System

COUNTER = """
import sys
import actors
from actors.interfaces.std_msgs.msg import String

QOS = actors.QoSProfile(history=actors.HistoryPolicy.KEEP_ALL) if sys.argv[1] == "all" else int(sys.argv[1])

class Counter(actors.Node):
    def __init__(self):
        super().__init__("counter")
        self.last = -1
        self.subscription = self.create_subscription(String, "numbers", self.on_message, QOS)

    def on_message(self, msg):
        number = int(msg.data.split()[0])
        assert number > self.last
        self.last = number
        if msg.data.endswith("first"):
            print("first", flush=True)
        if msg.data.endswith("last"):
            sub = self.subscription
            print("counted", sub.received, sub.dropped, sub.lost, sub.lost_on_break, flush=True)

actors.run(Counter)
"""


@pytest.mark.parametrize("qos", ["10", "all"])
async def test_a_frozen_subscriber_delays_no_other(system: System, qos: str) -> None:
    """Cases 29 and 35: another subscription receives everything; only KEEP_LAST loses, and counts it."""
    total, padding = 4000, "x" * 2000
    await system.broker(*NO_KEEPALIVE)
    counter = await system.python("-c", COUNTER, qos)
    profile = actors.QoSProfile(history=actors.HistoryPolicy.KEEP_ALL) if qos == "all" else 10
    async with (
        actors.Node("talker", url=system.url) as talker,
        actors.Node("hearer", url=system.url) as hearer,
    ):
        publisher = talker.create_publisher(String, "numbers", profile)
        side = talker.create_publisher(Int64, "side", 10)
        messages = aiter(hearer.create_subscription(Int64, "side", qos_profile=10))
        await wait_for_subscriptions(publisher)
        publisher.publish(String(data="0 first"))
        await counter.wait_for_line("first")
        counter.send_signal(signal.SIGSTOP)
        for number in range(1, total - 1):
            publisher.publish(String(data=f"{number} {padding}"))
            if number % 100 == 0:
                side.publish(Int64(data=number))
                assert (await anext(messages)).data == number
        counter.send_signal(signal.SIGCONT)
        publisher.publish(String(data=f"{total - 1} last"))
        line = await counter.wait_for_line("counted")
        received, dropped, lost, broken = map(int, line.split()[1:])
        assert publisher.published == total
        assert received + dropped + lost + broken == total
        assert received >= 10
        if qos == "all":
            assert received == total
        else:
            assert lost > 0


async def test_large_messages_pass_and_small_ones_overtake_them(hub: broker.Broker) -> None:
    """Twenty megabytes arrive complete, and a small message on another topic arrives first."""
    order: list[str] = []
    done = asyncio.Event()
    payload = bytes(range(256)) * (20 * 4096)

    def on_large(msg: UInt8MultiArray) -> None:
        assert bytes(msg.data) == payload
        order.append("large")
        done.set()

    async with actors.Node("talker", url=hub.url) as talker, actors.Node("hearer", url=hub.url) as hearer:
        large = talker.create_publisher(UInt8MultiArray, "large", 1)
        small = talker.create_publisher(String, "small", 10)
        hearer.create_subscription(UInt8MultiArray, "large", on_large, 1)
        hearer.create_subscription(String, "small", lambda msg: order.append(msg.data), 10)
        await wait_for_subscriptions(small)
        large.publish(UInt8MultiArray(data=payload))
        small.publish(String(data="small"))
        async with asyncio.timeout(DEADLINE_SEC):
            await done.wait()
        assert order == ["small", "large"]


async def test_many_nodes_join_and_leave(hub: broker.Broker) -> None:
    """Fifty nodes with a topic each leave nothing behind in the graph."""
    async with actors.Node("watcher", url=hub.url, **BARE) as watcher:
        async with asyncio.TaskGroup() as group:

            async def visit(i: int) -> None:
                async with actors.Node(f"visitor_{i}", url=hub.url) as node:
                    publisher = node.create_publisher(String, "visits", 100)
                    messages = aiter(node.create_subscription(String, "visits", qos_profile=100))
                    await publisher.wait_for_subscriptions(1, timeout_sec=DEADLINE_SEC)
                    publisher.publish(String(data=f"visitor {i}"))
                    await anext(messages)

            for i in range(50):
                group.create_task(visit(i))
        assert await watcher.get_fully_qualified_node_names() == ["/watcher"]
        assert await watcher.get_topic_names_and_types() == []


async def test_domains_do_not_see_each_other(hub: broker.Broker) -> None:
    """The same names in two domains of one broker are different nodes and topics."""
    async with (
        actors.Node("same", url=hub.url, domain=1) as one,
        actors.Node("same", url=hub.url, domain=2) as two,
    ):
        publisher = one.create_publisher(String, "t", 10)
        subscription = two.create_subscription(String, "t", qos_profile=10)
        await one.get_graph()
        await two.get_graph()
        publisher.publish(String(data="x"))
        await publisher.flush()
        await one.get_graph()  # the broker has routed the message
        assert await two.count_publishers("t") == 0
        assert publisher.get_subscription_count() == subscription.queued == 0


async def test_a_raising_callback_leaves_the_node_alive(system: System) -> None:
    """The traceback is logged, the next message is handled, and the program exits with 0."""
    await system.broker()
    program = await system.python(
        "-c",
        """
import actors
from actors.interfaces.std_msgs.msg import String

class Clumsy(actors.Node):
    @actors.subscription(String, "addison")
    def on_message(self, msg):
        raise ValueError(f"cannot bear {msg.data}")

actors.run(lambda: Clumsy("clumsy"))
""",
    )
    await system.example("minimal_publisher")
    for _ in range(2):
        await program.wait_for_line("ERROR")
        await program.wait_for_line("Traceback")
        await program.wait_for_line("ValueError: cannot bear Hi Automatic Addison")
    assert await program.stop() == 0


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda number: number.name)
async def test_callboard_run_runs_the_examples(system: System, number: signal.Signals) -> None:
    """Texts, exit codes, arguments and remaps are the same as with python."""
    await system.broker()
    run = ("-m", "actors", "run")
    publisher = await system.python(
        *run, "examples/minimal_publisher.py", "--ros-args", "-r", "addison:=other"
    )
    subscriber = await system.python(
        *run, "examples/minimal_subscriber.py", "--ros-args", "-r", "addison:=other"
    )
    await subscriber.wait_for_line("[minimal_subscriber]: I heard")
    server = await system.python(*run, "examples/add_two_ints_server.py")
    client = await system.python(*run, "examples/add_two_ints_client.py", "5", "3")
    await client.wait_for_line("Sum: 8")
    assert await client.wait_for_exit() == 0
    usage = await system.python(*run, "examples/add_two_ints_client.py", "5")
    assert await usage.wait_for_exit() == 1
    for program in (publisher, subscriber, server):
        program.send_signal(number)
        assert await program.wait_for_exit() == 0
        assert "Traceback" not in program.output

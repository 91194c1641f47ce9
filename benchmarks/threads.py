"""Publishing from another thread than the node's, next to publishing in its loop.

    python benchmarks/threads.py

The broker is a process of its own. Each figure is the median of several rounds, until the broker has
everything: messages a second of a KEEP_ALL publisher, and how late a timer of 1 ms in the node's loop is
while another thread publishes large messages, which it encodes itself or leaves to the loop.
"""

from __future__ import annotations

import argparse
import asyncio
import re
import statistics
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING

import actors
from actors.interfaces.geometry_msgs.msg import Pose, PoseArray
from actors.interfaces.std_msgs.msg import Int64
from actors.threads import NodeThread

if TYPE_CHECKING:
    from collections.abc import Callable, Generator

KEEP_ALL = actors.QoSProfile(history=actors.HistoryPolicy.KEEP_ALL)
TICK_SEC = 0.001
POSES = 20_000
LARGE_MESSAGES = 50


@contextmanager
def broker_process() -> Generator[tuple[str, int]]:
    """Run a broker on a free port; yield its URL and process id."""
    command = [sys.executable, "-m", "actors", "broker", "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        assert process.stdout is not None
        try:
            found = (re.search(r"callboard://\S+:\d+", line) for line in process.stdout)
            yield next(url[0] for url in found if url), process.pid
        finally:
            process.terminate()


def rate(count: int, publish: Callable[[range], None]) -> float:
    """Return the messages a second of one round."""
    began = time.perf_counter()
    publish(range(count))
    return count / (time.perf_counter() - began)


def in_loop(thread: NodeThread, publisher: actors.Publisher[Int64], numbers: range) -> None:
    """Publish in the node's loop."""

    async def publish() -> None:
        for number in numbers:
            await publisher.ready()
            publisher.publish(Int64(data=number))
        await publisher.flush()

    thread.call(publish)


def from_threads(thread: NodeThread, publisher: actors.Publisher[Int64], numbers: range, count: int) -> None:
    """Publish in so many other threads."""
    shared = thread.publisher(publisher)

    def publish(part: range) -> None:
        for number in part:
            while True:
                try:
                    shared.publish(Int64(data=number))
                    break
                except actors.PublisherFull:
                    shared.ready()

    workers = [threading.Thread(target=publish, args=(numbers[each::count],)) for each in range(count)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    shared.flush()


def lateness_ms(thread: NodeThread, publish: Callable[[], None]) -> float:
    """Return the 99th percentile of how late a task of the loop wakes while a function runs here."""
    late: list[float] = []

    async def tick() -> None:
        loop = asyncio.get_running_loop()
        while True:
            due = loop.time() + TICK_SEC
            await asyncio.sleep(TICK_SEC)
            late.append(1000 * (loop.time() - due))

    ticking = thread.submit(tick)
    for _ in range(LARGE_MESSAGES):
        publish()
        time.sleep(0.01)
    ticking.cancel()
    return statistics.quantiles(late, n=100)[-1]


def main(count: int, rounds: int) -> None:
    """Measure and print."""
    with broker_process() as (url, _), NodeThread() as thread:
        node = thread.enter(actors.Node("threads", url=url))
        publisher = thread.call(lambda: node.create_publisher(Int64, "number", KEEP_ALL))
        ways: dict[str, Callable[[range], None]] = {
            "in the loop": lambda numbers: in_loop(thread, publisher, numbers),
            "from one other thread": lambda numbers: from_threads(thread, publisher, numbers, 1),
            "from four other threads": lambda numbers: from_threads(thread, publisher, numbers, 4),
        }
        rates: dict[str, list[float]] = {name: [] for name in ways}
        for _ in range(rounds):
            for name, publish in ways.items():
                rates[name].append(rate(count, publish))
        for name, each in rates.items():
            print(f"{name}: {statistics.median(each):,.0f} messages/s")
        large = thread.call(lambda: node.create_publisher(PoseArray, "poses", 10))
        shared = thread.publisher(large)
        poses = PoseArray(poses=[Pose() for _ in range(POSES)])
        for name, one in {
            "in the calling thread": lambda: shared.publish(poses),
            "in the loop": lambda: thread.call(lambda: large.publish(poses)),
        }.items():
            late = statistics.median(lateness_ms(thread, one) for _ in range(rounds))
            print(f"{POSES:,} poses encoded {name}: the loop is late by {late:.1f} ms (99th percentile)")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--messages", type=int, default=200_000)
    parser.add_argument("--rounds", type=int, default=5)
    arguments = parser.parse_args()
    main(arguments.messages, arguments.rounds)

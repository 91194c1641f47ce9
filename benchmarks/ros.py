"""Programs written for ROS 2 next to the same programs in callboard's own API.

    python benchmarks/ros.py

The broker, the talker or client, and the listener or server are processes of their own. Rounds of both kinds
alternate; each figure is the median. The talker is KEEP_ALL, so that all messages arrive, and the rate is
the listener's. A client makes one call after the other. `spinning` is a node with nothing to do.
"""
# ruff: noqa: E402 - the path comes before the imports that need it

from __future__ import annotations

import argparse
import asyncio
import inspect
import json
import os
import statistics
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

ROOT = Path(__file__).resolve().parents[1]
sys.path[0] = str(ROOT)  # `python benchmarks/ros.py` puts this folder there

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String
from actors.ros import rclpy
from actors.ros.rclpy.qos import HistoryPolicy, QoSProfile
from benchmarks.threads import broker_process

if TYPE_CHECKING:
    from collections.abc import Callable

KEEP_ALL = actors.QoSProfile(history=actors.HistoryPolicy.KEEP_ALL)
FACE_KEEP_ALL = QoSProfile(history=HistoryPolicy.KEEP_ALL)
MESSAGE = "Hi Automatic Addison: 1"
WARM_UP_CALLS = 50


class Arrivals:
    """Counts messages, and tells when all are there."""

    def __init__(self, count: int, done: Callable[[], object]) -> None:
        self.rate = 0.0
        self._left = self._count = count
        self._done = done
        self._began = 0.0

    def arrived(self, _msg: String) -> None:
        """Note a message."""
        if self._left == self._count:
            self._began = time.perf_counter()
        self._left -= 1
        if not self._left:
            self.rate = (self._count - 1) / (time.perf_counter() - self._began)
            self._done()


# callboard's own API


async def native_talker(count: int) -> None:
    async with actors.Node("talker") as node:
        publisher = node.create_publisher(String, "chatter", KEEP_ALL)
        await publisher.wait_for_subscriptions(1, 20)
        for _ in range(count):
            await publisher.ready()
            publisher.publish(String(data=MESSAGE))
        await publisher.flush()


async def native_listener(count: int) -> dict[str, float]:
    done = asyncio.Event()
    arrivals = Arrivals(count, done.set)
    async with actors.Node("listener") as node:
        node.create_subscription(String, "chatter", arrivals.arrived, KEEP_ALL)
        await done.wait()
    return {"rate": arrivals.rate}


async def native_server() -> None:
    async with actors.Node("server") as node:

        def add(request: AddTwoInts.Request, response: AddTwoInts.Response) -> AddTwoInts.Response:
            response.sum = request.a + request.b
            return response

        node.create_service(AddTwoInts, "add", add)
        await asyncio.Event().wait()


async def native_client(count: int) -> dict[str, float]:
    async with actors.Node("client") as node:
        client = node.create_client(AddTwoInts, "add")
        await client.wait_for_service(20)
        for _ in range(WARM_UP_CALLS):
            await client.call(AddTwoInts.Request())
        began = time.perf_counter()
        for number in range(count):
            await client.call(AddTwoInts.Request(a=number, b=1))
        return {"rate": count / (time.perf_counter() - began)}


# rclpy's


def face_talker(count: int) -> None:
    with rclpy.init():
        publisher = rclpy.create_node("talker").create_publisher(String, "chatter", FACE_KEEP_ALL)
        while not publisher.get_subscription_count():
            time.sleep(0.01)
        for _ in range(count):
            publisher.publish(String(data=MESSAGE))
        publisher.wait_for_all_acked()


def face_listener(count: int) -> dict[str, float]:
    with rclpy.init():
        done = rclpy.Future[None]()
        arrivals = Arrivals(count, lambda: done.set_result(None))
        node = rclpy.create_node("listener")
        node.create_subscription(String, "chatter", arrivals.arrived, FACE_KEEP_ALL)
        rclpy.spin_until_future_complete(node, done)
    return {"rate": arrivals.rate}


def face_server() -> None:
    def add(request: AddTwoInts.Request, response: AddTwoInts.Response) -> AddTwoInts.Response:
        response.sum = request.a + request.b
        return response

    with rclpy.init():
        node = rclpy.create_node("server")
        node.create_service(AddTwoInts, "add", add)
        rclpy.spin(node)


def face_client(count: int) -> dict[str, float]:
    def spun(number: int) -> None:
        rclpy.spin_until_future_complete(node, client.call_async(AddTwoInts.Request(a=number, b=1)))

    def blocking(number: int) -> None:
        client.call(AddTwoInts.Request(a=number, b=1))

    rates: dict[str, float] = {}
    with rclpy.init():
        node = rclpy.create_node("client")
        client = node.create_client(AddTwoInts, "add")
        client.wait_for_service(20)
        for name, call in {"rate": spun, "blocking": blocking}.items():
            for number in range(WARM_UP_CALLS):
                call(number)
            began = time.perf_counter()
            for number in range(count):
                call(number)
            rates[name] = count / (time.perf_counter() - began)
    return rates


def face_spinning(seconds: int) -> dict[str, float]:
    with rclpy.init():
        node = rclpy.create_node("spinning")
        executor = rclpy.get_global_executor()
        executor.add_node(node)
        executor.spin_once(0.5)
        before, began = time.process_time(), time.perf_counter()
        rclpy.spin_until_future_complete(node, rclpy.Future[None](), timeout_sec=seconds)
        return {"cpu": (time.process_time() - before) / (time.perf_counter() - began)}


def run_role(name: str, *arguments: int) -> None:
    """Run one of the programs above, and print its figures."""
    role = globals()[name]
    figures: Any = None
    with suppress(rclpy.executors.ExternalShutdownException):
        if inspect.iscoroutinefunction(role):
            figures = actors.run(lambda: role(*arguments), args=[])
        else:
            figures = role(*arguments)
    if figures is not None:
        print(json.dumps(figures))


def start(url: str, name: str, *arguments: int) -> subprocess.Popen[str]:
    """Start a program."""
    command = [sys.executable, __file__, "--role", name, *map(str, arguments)]
    environment = {**os.environ, "CALLBOARD_URL": url}
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)


def figures(process: subprocess.Popen[str]) -> dict[str, float]:
    """Return the figures of a program that ends."""
    out, _ = process.communicate()
    found: dict[str, float] = json.loads(out.splitlines()[-1])
    return found


def main(messages: int, calls: int, seconds: int, rounds: int) -> None:
    """Measure and print."""
    rates: dict[str, list[float]] = {}
    with broker_process() as url:
        for _ in range(rounds):
            for kind in ("native", "face"):
                listener = start(url, f"{kind}_listener", messages)
                with start(url, f"{kind}_talker", messages):
                    rates.setdefault(f"{kind} messages", []).append(figures(listener)["rate"])
                with start(url, f"{kind}_server") as server:
                    found = figures(start(url, f"{kind}_client", calls))
                    server.terminate()
                rates.setdefault(f"{kind} calls", []).append(found["rate"])
                rates.setdefault(f"{kind} blocking", []).append(found.get("blocking", found["rate"]))
        idle = figures(start(url, "face_spinning", seconds))["cpu"]
    median = {name: statistics.median(each) for name, each in rates.items()}
    for what in ("messages", "calls"):
        native, face = median[f"native {what}"], median[f"face {what}"]
        print(f"{what}/s: callboard's API {native:,.0f}, rclpy's {face:,.0f} ({face / native:.2f} of it)")
    ratio = median["face calls"] / median["face blocking"]
    print(f"a blocking call takes {ratio:.2f} times as long as call_async and spinning")
    print(f"a spinning node with nothing to do takes {100 * idle:.2f} % of a processor")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--messages", type=int, default=200_000)
    parser.add_argument("--calls", type=int, default=3_000)
    parser.add_argument("--seconds", type=int, default=10)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--role", nargs="+", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.role:
        run_role(options.role[0], *map(int, options.role[1:]))
    else:
        main(options.messages, options.calls, options.seconds, options.rounds)

"""A program written for rclpy: `benchmarks/ros.py` runs it on callboard and on ROS 2.

    python benchmarks/ros_program.py ROLE '{"how": "spin", "size": 256, "seconds": 1}'

A role prints its figures as JSON. `how` says what runs callbacks: `spin` (an executor), `spin_once` (of the
module, in a loop, also in the publisher) or `threads` (a MultiThreadedExecutor). All is KEEP_ALL, so that
both deliver all messages and answer all calls. It imports what ROS 2 has, and the standard library.
"""

from __future__ import annotations

import json
import re
import statistics
import sys
import time
from contextlib import suppress
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import rclpy
from rclpy._rclpy_pybind11 import RCLError
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.qos import HistoryPolicy, QoSProfile
from rclpy.serialization import serialize_message
from std_msgs.msg import UInt8MultiArray
from std_srvs.srv import SetBool

if TYPE_CHECKING:
    from rclpy.node import Node

KEEP_ALL = QoSProfile(history=HistoryPolicy.KEEP_ALL)
SETTLE_SEC = 0.5
"""ROS 2's publishers see a subscription before it sees them, and messages of that time are lost."""
LAST_BYTES = 64
"""No message of the load is as short as the last one."""
BURST = 16
"""Messages that are published between two looks at the clock."""
WARM_UP_CALLS = 100
TIMER_SEC = 0.001


def run(node: Node, how: str, future: rclpy.Future[None]) -> None:
    """Run callbacks until a future is done."""
    if how == "spin_once":
        while not future.done():
            rclpy.spin_once(node)
        return
    executor = MultiThreadedExecutor() if how == "threads" else SingleThreadedExecutor()
    executor.add_node(node)
    executor.spin_until_future_complete(future)
    executor.shutdown()


def subscriber(node: Node, how: str, *, raw: bool, **_: Any) -> dict[str, float]:
    """Count messages from the first one on, until a short one arrives."""
    received, first_sec, first_cpu_sec, last_sec = 0, 0.0, 0.0, 0.0
    done = rclpy.Future[None]()

    def arrived(msg: Any) -> None:
        nonlocal received, first_sec, first_cpu_sec, last_sec
        if not received:
            first_sec, first_cpu_sec = time.perf_counter(), time.process_time()
        received += 1
        if len(msg if raw else msg.data) < LAST_BYTES:
            last_sec = time.perf_counter()
            done.set_result(None)

    node.create_subscription(UInt8MultiArray, "load", arrived, KEEP_ALL, raw=raw)
    run(node, how, done)
    cpu = (time.process_time() - first_cpu_sec) / received
    return {"count": received, "rate": (received - 1) / (last_sec - first_sec), "cpu_us": 1e6 * cpu}


def publisher(node: Node, how: str, *, raw: bool, size: int, seconds: float) -> dict[str, float]:
    """Publish as fast as it goes, and a short message at the end."""
    made = node.create_publisher(UInt8MultiArray, "load", KEEP_ALL)

    def publish(msg: Any) -> None:
        while True:
            with suppress(RCLError):  # ROS 2's publishers wait for slow readers for 100 ms only
                made.publish(msg)
                return

    msg: Any = UInt8MultiArray(data=bytes(size))
    if raw:
        msg = serialize_message(msg)
    while not made.get_subscription_count():
        time.sleep(0.01)
    time.sleep(SETTLE_SEC)
    sent, cpu_sec, end_sec = 0, time.process_time(), time.perf_counter() + seconds
    while time.perf_counter() < end_sec:
        for _ in range(1 if how == "spin_once" else BURST):
            publish(msg)
            sent += 1
        if how == "spin_once":
            rclpy.spin_once(node, timeout_sec=0)
    publish(serialize_message(UInt8MultiArray()) if raw else UInt8MultiArray())
    made.wait_for_all_acked(Duration(seconds=30))
    return {"count": sent + 1, "cpu_us": 1e6 * (time.process_time() - cpu_sec) / sent}


def server(node: Node, **_: Any) -> None:
    """Answer until the program is ended."""

    def answer(request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        response.success = request.data
        return response

    node.create_service(SetBool, "answer", answer, qos_profile=KEEP_ALL)
    rclpy.spin(node)


def client(node: Node, how: str, calls: int, seconds: float) -> dict[str, float]:
    """Keep so many calls in flight."""
    made = node.create_client(SetBool, "answer", qos_profile=KEEP_ALL)
    times: list[float] = []
    done = rclpy.Future[None]()
    end_sec = 0.0

    def call() -> None:
        began = time.perf_counter()

        def replied(future: rclpy.Future[SetBool.Response]) -> None:
            assert future.result().success
            now = time.perf_counter()
            times.append(now - began)
            if now < end_sec or len(times) < WARM_UP_CALLS:
                call()
            elif not done.done():
                done.set_result(None)

        made.call_async(SetBool.Request(data=True)).add_done_callback(replied)

    executor = SingleThreadedExecutor()
    executor.add_node(node)
    made.wait_for_service(20)
    time.sleep(SETTLE_SEC)
    call()
    executor.spin_until_future_complete(done)
    times.clear()
    if how == "one":
        return _one_by_one(made, executor, seconds)
    done, began, cpu_sec = rclpy.Future(), time.perf_counter(), time.process_time()
    end_sec = began + seconds
    for _ in range(calls):
        call()
    executor.spin_until_future_complete(done)
    elapsed, cpu_sec = time.perf_counter() - began, time.process_time() - cpu_sec
    return {"count": len(times), "rate": len(times) / elapsed, "cpu_us": 1e6 * cpu_sec / len(times)}


def _one_by_one(made: Any, executor: Any, seconds: float) -> dict[str, float]:
    """Call, and spin until the response is there."""
    times: list[float] = []
    began, cpu_sec = time.perf_counter(), time.process_time()
    while (start := time.perf_counter()) < began + seconds:
        future = made.call_async(SetBool.Request(data=True))
        executor.spin_until_future_complete(future)
        assert future.result().success
        times.append(time.perf_counter() - start)
    cpu_sec = time.process_time() - cpu_sec
    count = len(times)
    return {"count": count, "p50_us": 1e6 * statistics.median(times), "cpu_us": 1e6 * cpu_sec / count}


def timer(node: Node, seconds: float, **_: Any) -> dict[str, float]:
    """Count the calls of a timer, and compare the times between them with its period."""
    times: list[float] = []
    done = rclpy.Future[None]()
    count = int(seconds / TIMER_SEC)

    def tick() -> None:
        times.append(time.perf_counter())
        if len(times) == count:
            done.set_result(None)

    executor = SingleThreadedExecutor()
    executor.add_node(node)
    began, cpu_sec = time.perf_counter(), time.process_time()
    node.create_timer(TIMER_SEC, tick)
    executor.spin_until_future_complete(done)
    cpu_sec = time.process_time() - cpu_sec
    elapsed = time.perf_counter() - began
    jitter = [abs(after - before - TIMER_SEC) for before, after in pairwise(times)]
    return {"cpu": cpu_sec / elapsed, "p99_us": 1e6 * statistics.quantiles(jitter, n=100)[98]}


def idle(node: Node, seconds: float, **_: Any) -> dict[str, float]:
    """Spin with nothing to do."""
    cpu_sec = time.process_time()
    rclpy.spin_until_future_complete(node, rclpy.Future[None](), timeout_sec=seconds)
    return {"cpu": (time.process_time() - cpu_sec) / seconds}


def one_node(node: Node, seconds: float, began: float, **_: Any) -> dict[str, float]:
    """Return how long the start took, and the memory after a while."""
    start_ms = 1e3 * (time.time() - began)
    rclpy.spin_until_future_complete(node, rclpy.Future[None](), timeout_sec=seconds)
    text = Path("/proc/self/smaps_rollup").read_text("ascii")
    found = re.findall(r"^(Rss|Pss):\s+(\d+) kB$", text, re.MULTILINE)
    memory = {name: int(kib) / 1024 for name, kib in found}
    return {"start_ms": start_ms, "rss_mib": memory["Rss"], "pss_mib": memory["Pss"]}


ROLES = {each.__name__: each for each in (subscriber, publisher, server, client, timer, idle, one_node)}


def main(role: str, parameters: str) -> None:
    """Run a role, and print its figures."""
    with suppress(ExternalShutdownException), rclpy.init():
        figures: dict[str, float] | None = ROLES[role](rclpy.create_node(role), **json.loads(parameters))
        print(json.dumps(figures), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])

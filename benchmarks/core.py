"""How fast the core is: every role in its own process, typed messages, every promise kept.

    python benchmarks/core.py                   all three workloads, about half a minute
    python benchmarks/core.py stream --seconds 5

stream: one publisher, one subscription, std_msgs/String of 256 bytes, KEEP_ALL (nothing is dropped: checked).
latency: add_two_ints, one call at a time.
requests: add_two_ints, 100 calls in flight.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import statistics
import subprocess
import sys
import time
from pathlib import Path

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String

QOS = actors.QoSProfile(history=actors.HistoryPolicy.KEEP_ALL)
IN_FLIGHT = 100
BURST = 200


def report(**figures: float) -> None:
    """Give the parent this role's figures, with the CPU time it has used."""
    used = time.process_time()
    print(json.dumps({**figures, "cpu_s": round(used, 3)}), flush=True)


async def subscriber(seconds: float) -> None:
    """Count what comes until the publisher says it has finished."""
    done = asyncio.Event()
    first = last = 0.0
    count = 0

    def on_message(msg: String) -> None:
        nonlocal count, first, last
        if msg.data == "end":
            done.set()
            return
        if not count:
            first = time.perf_counter()
        count += 1
        last = time.perf_counter()

    async with actors.Node("bench_subscriber") as node:
        subscription = node.create_subscription(String, "bench", on_message, QOS)
        async with asyncio.timeout(seconds + 60):
            await done.wait()
        report(
            received=count,
            rate=count / (last - first),
            lost=subscription.lost + subscription.lost_on_break,
            dropped=subscription.dropped,
        )


async def publisher(seconds: float) -> None:
    """Publish as fast as the subscription lets us."""
    async with actors.Node("bench_publisher") as node:
        pub = node.create_publisher(String, "bench", QOS)
        await node.wait_for_node("/bench_subscriber")
        msg = String(data="x" * 256)
        stop = time.perf_counter() + seconds
        sent = 0
        while time.perf_counter() < stop:
            for _ in range(BURST):
                pub.publish(msg)
            sent += BURST
            await pub.ready()
            await asyncio.sleep(0)
        pub.publish(String(data="end"))
        await pub.flush()
        report(sent=sent)


async def server(seconds: float) -> None:
    """Add two ints until the requester has gone."""
    done = asyncio.Event()

    def add(request: AddTwoInts.Request) -> AddTwoInts.Response:
        return AddTwoInts.Response(sum=request.a + request.b)

    def finish(_: String) -> None:
        done.set()

    async with actors.Node("bench_server") as node:
        node.create_subscription(String, "bench_done", finish, QOS)
        service = node.create_service(AddTwoInts, "bench_add", add)
        async with asyncio.timeout(seconds + 60):
            await done.wait()
        report(served=service.served)


async def requester(seconds: float, in_flight: int) -> None:
    """Call as fast as `in_flight` calls at a time allow."""
    times: list[float] = []
    elapsed = seconds

    async with actors.Node("bench_requester") as node:
        client = node.create_client(AddTwoInts, "bench_add")
        await client.wait_for_service(30)
        stop = time.perf_counter() + seconds

        async def call_in_turn() -> None:
            while (start := time.perf_counter()) < stop:
                response = await client.call(AddTwoInts.Request(a=5, b=3))
                times.append(time.perf_counter() - start)
                assert response.sum == 8

        begin = time.perf_counter()
        async with asyncio.TaskGroup() as group:
            for _ in range(in_flight):
                group.create_task(call_in_turn())
        elapsed = time.perf_counter() - begin
        finished = node.create_publisher(String, "bench_done", QOS)
        finished.publish(String())
        await finished.flush()
    cuts = statistics.quantiles(times, n=1000)
    report(
        calls=len(times),
        rate=len(times) / elapsed,
        p50_us=cuts[499] * 1e6,
        p99_us=cuts[989] * 1e6,
        p999_us=cuts[998] * 1e6,
    )


async def one_at_a_time(seconds: float) -> None:
    """Call, wait, call."""
    await requester(seconds, 1)


async def many_in_flight(seconds: float) -> None:
    """Keep `IN_FLIGHT` calls in flight."""
    await requester(seconds, IN_FLIGHT)


ROLES = {
    "subscriber": subscriber,
    "publisher": publisher,
    "server": server,
    "requester": one_at_a_time,
    "requester100": many_in_flight,
}
WORKLOADS = {
    "stream": ("subscriber", "publisher"),
    "latency": ("server", "requester"),
    "requests": ("server", "requester100"),
}


def run_workload(name: str, seconds: float) -> None:
    """Start a broker and the roles, each in its own process; print what they report."""
    with subprocess.Popen(
        [sys.executable, "-m", "broker", "--port", "0"], stdout=subprocess.PIPE, text=True
    ) as broker:
        assert broker.stdout is not None
        url = broker.stdout.readline().split()[-1]
        environment = {**os.environ, "CALLBOARD_URL": url}
        command = [sys.executable, str(Path(__file__)), "--seconds", str(seconds), "--role"]
        roles = [
            (role, subprocess.Popen([*command, role], env=environment, stdout=subprocess.PIPE, text=True))
            for role in WORKLOADS[name]
        ]
        print(f"{name}:")
        for role, process in roles:
            output, _ = process.communicate(timeout=seconds + 120)
            figures = json.loads(output) if output else {"failed": process.returncode}
            print(f"  {role:<14}" + "  ".join(f"{key} {value:,.6g}" for key, value in figures.items()))
        used = sum(os.times()[2:4])
        broker.terminate()
        broker.wait(30)
        print(f"  {'broker':<14}cpu_s {sum(os.times()[2:4]) - used:.3f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("workloads", nargs="*", metavar="stream|latency|requests")
    parser.add_argument("--seconds", type=float, default=5.0, help="of load for each workload")
    parser.add_argument("--role", choices=ROLES, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.role:
        role = ROLES[options.role]
        actors.run(lambda: role(options.seconds), args=[])
        return
    for workload in options.workloads or WORKLOADS:
        run_workload(workload, options.seconds)


if __name__ == "__main__":
    main()

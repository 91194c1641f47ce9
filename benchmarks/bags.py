"""How fast a recorder writes what comes through a broker, next to `mcap`'s own writer fed from memory.

    pip install -e '.[bags]'
    python benchmarks/bags.py

The broker and the publisher are processes of their own; the recorder, which is lossless, is in this one. Both
write the same messages into a folder of `--folder`, in turns; the medians of all rounds count: messages a
second, and messages for each second of this process's CPU time. Ends with 1 if a ratio is below its target.
"""

# ruff: noqa: E402 - the path comes before the imports that need it

from __future__ import annotations

import argparse
import asyncio
import json
import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

# Not this folder itself, whose modules could hide others of the same name.
sys.path[0] = str(Path(__file__).resolve().parent.parent)

from mcap.writer import Writer as McapWriter

import actors
from actors.bags import BagTopic, Recorder, RecorderOptions, Selection
from actors.interfaces import cdr
from actors.interfaces.sensor_msgs.msg import Image
from actors.interfaces.std_msgs.msg import String
from benchmarks.threads import broker_process

if TYPE_CHECKING:
    from collections.abc import Callable

KEEP_ALL = actors.QoSProfile(history=actors.HistoryPolicy.KEEP_ALL)
MIB = 1 << 20


class Workload(NamedTuple):
    """What is recorded.

    Attributes:
        message: Each message.
        topics: How many topics have it in turns.
        messages: How many of a round.
        at_once: Messages that the publisher sends before it waits until all have left.
        target: The least ratio of messages a second.
    """

    message: actors.Message
    topics: int
    messages: int
    at_once: int
    target: float


WORKLOADS = {
    "256 B, one topic": Workload(String(data="x" * 247), 1, 100_000, 500, 0.3),
    "256 B, 100 topics": Workload(String(data="x" * 247), 100, 100_000, 500, 0.3),
    "1 MiB images": Workload(
        Image(height=1024, width=1024, step=1024, encoding="mono8", data=bytes(MIB)), 1, 400, 8, 0.7
    ),
}


class Rates(NamedTuple):
    """Messages a second, and for each second of CPU time."""

    wall: float
    cpu: float


def names(workload: Workload) -> list[str]:
    """Return the topics of a workload."""
    return [f"/data{number}" for number in range(workload.topics)]


async def _until(condition: Callable[[], bool]) -> None:
    while not condition():  # noqa: ASYNC110 - nothing else tells when
        await asyncio.sleep(0.002)


async def publish(url: str, workload: Workload) -> None:
    """Publish a workload, as fast as the recorder takes it."""
    async with actors.Node("source", url=url) as node:
        publishers = [
            node.create_publisher(type(workload.message), name, KEEP_ALL) for name in names(workload)
        ]
        await _until(lambda: all(each.get_subscription_count() for each in publishers))
        for number in range(workload.messages):
            publisher = publishers[number % workload.topics]
            await publisher.ready()
            publisher.publish(workload.message)
            if number % workload.at_once == 0:
                await publisher.flush()
        for publisher in publishers:
            await publisher.flush()


async def record(url: str, name: str, folder: Path) -> Rates:
    """Record a workload that another process publishes."""
    workload = WORKLOADS[name]
    selection = Selection(topics=names(workload))
    async with Recorder(folder / "bag", selection, RecorderOptions(lossless=True), url=url) as recorder:
        source = await asyncio.create_subprocess_exec(
            sys.executable, __file__, "--publish", name, "--url", url
        )
        await _until(lambda: recorder.statistics().received > 0)
        wall, cpu = time.perf_counter(), time.process_time()
        await _until(lambda: recorder.statistics().written >= workload.messages)
        rates = _rates(workload.messages, wall, cpu)
        await source.wait()
    found = recorder.statistics()
    assert (found.written, found.lost, found.dropped) == (workload.messages, 0, 0), found
    return rates


def write(name: str, folder: Path) -> Rates:
    """Write a workload by `mcap`'s writer."""
    workload = WORKLOADS[name]
    topic, data = BagTopic.of_class("/data", type(workload.message)), cdr.encode(workload.message)
    with (folder / "mcap.mcap").open("wb") as stream:
        wall, cpu = time.perf_counter(), time.process_time()
        writer = McapWriter(stream)
        writer.start("ros2", "")
        schema = writer.register_schema(topic.type_name, "ros2msg", topic.definition.encode())
        channels = [writer.register_channel(each, "cdr", schema) for each in names(workload)]
        for number in range(workload.messages):
            writer.add_message(channels[number % workload.topics], number, data, number, number)
        writer.finish()  # type: ignore[no-untyped-call]  # mcap's
        return _rates(workload.messages, wall, cpu)


def _rates(count: int, wall: float, cpu: float) -> Rates:
    return Rates(count / (time.perf_counter() - wall), count / (time.process_time() - cpu))


def in_new_folder(parent: Path | None, function: Callable[[Path], Rates]) -> Rates:
    """Call a function with a folder that is removed afterwards."""
    with tempfile.TemporaryDirectory(dir=parent) as folder:
        return function(Path(folder))


def measure(name: str, rounds: int, parent: Path | None) -> tuple[Rates, Rates]:
    """Return the medians of the recorder and of `mcap`'s writer, which take turns."""
    ours: list[Rates] = []
    theirs: list[Rates] = []
    with broker_process() as (url, _):
        for _ in range(rounds):
            ours.append(in_new_folder(parent, lambda folder: asyncio.run(record(url, name, folder))))
            theirs.append(in_new_folder(parent, lambda folder: write(name, folder)))
    return _median(ours), _median(theirs)


def _median(rates: list[Rates]) -> Rates:
    return Rates(*(statistics.median(column) for column in zip(*rates, strict=True)))


def main() -> int:
    """Measure, print a table, and return whether all targets are reached."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=5, help="rounds of each workload; default: 5")
    parser.add_argument("--only", choices=WORKLOADS, action="append", help="a workload; may be repeated")
    parser.add_argument("--folder", type=Path, help="where files are written; default: the system's")
    parser.add_argument("--json", type=Path, help="a file for the figures")
    parser.add_argument("--publish", choices=WORKLOADS, help=argparse.SUPPRESS)
    parser.add_argument("--url", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.publish:
        asyncio.run(publish(options.url, WORKLOADS[options.publish]))
        return 0
    figures: dict[str, dict[str, float]] = {}
    for name in options.only or WORKLOADS:
        ours, theirs = measure(name, options.rounds, options.folder)
        ratio, target = ours.wall / theirs.wall, WORKLOADS[name].target
        figures[name] = {
            "recorder": ours.wall, "mcap": theirs.wall, "ratio": ratio, "target": target,
            "recorder_per_cpu_sec": ours.cpu, "mcap_per_cpu_sec": theirs.cpu,
        }  # fmt: skip
        print(
            f"{name}: {ours.wall:,.0f}/s next to {theirs.wall:,.0f}/s ({ratio:.2f}, target {target});"
            f" for a second of CPU {ours.cpu:,.0f} and {theirs.cpu:,.0f} ({ours.cpu / theirs.cpu:.2f})"
        )
    if options.json:
        options.json.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
    return int(any(each["ratio"] < each["target"] for each in figures.values()))


if __name__ == "__main__":
    sys.exit(main())

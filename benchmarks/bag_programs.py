"""What `benchmarks/bags.py` runs, each in a process of its own.

    python benchmarks/bag_programs.py ROLE FOLDER '{"workload": "256 B, one topic", "url": "callboard://…"}'

Prints its figures as JSON.
"""

# ruff: noqa: E402 - the path comes before the imports that need it

from __future__ import annotations

import asyncio
import json
import random
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

# Not this folder itself, whose modules could hide others of the same name.
sys.path[0] = str(Path(__file__).resolve().parent.parent)

from mcap.data_stream import RecordBuilder
from mcap.reader import make_reader
from mcap.records import Channel, ChunkIndex, DataEnd, Footer, Header, Schema, Statistics
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter

import actors
from actors.bags import BagTopic, Player, PlayerOptions, Reader, Recorder, RecorderOptions, Selection, Writer
from actors.interfaces import cdr
from actors.interfaces.sensor_msgs.msg import Image
from actors.interfaces.std_msgs.msg import String
from proto.aio import process

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

KEEP_ALL = actors.QoSProfile(history=actors.HistoryPolicy.KEEP_ALL)
MIB = 1 << 20
STEP_NS = 1_000_000
"""Between two messages of a bag that is played."""
SAMPLE_SEC = 1.0
MAGIC = b"\x89MCAP0\r\n"
LARGE_BYTES = 10_000_000_000
CHUNK_BYTES = 768 * 1024

Figures = dict[str, Any]


class Workload(NamedTuple):
    """What is recorded and played.

    Attributes:
        message: Each message.
        topics: How many topics have it in turns.
        messages: How many of a round.
        at_once: Messages that the publisher sends before it waits until all have left.
        record_target: The least ratio of messages a second, recorded and written by `mcap`.
        play_target: The same, played and read by `mcap`; 0 for none.
    """

    message: actors.Message
    topics: int
    messages: int
    at_once: int
    record_target: float
    play_target: float

    @property
    def names(self) -> list[str]:
        """The topics."""
        return [f"/data{number}" for number in range(self.topics)]


WORKLOADS = {
    "256 B, one topic": Workload(String(data="x" * 247), 1, 100_000, 500, 0.3, 0.5),
    "256 B, 100 topics": Workload(String(data="x" * 247), 100, 100_000, 500, 0.3, 0.5),
    # Noise, which no compression makes smaller.
    "1 MiB images": Workload(
        Image(height=1024, width=1024, step=1024, encoding="mono8", data=random.Random(1).randbytes(MIB)),
        1, 400, 8, 0.7, 0.5,
    ),
}  # fmt: skip


class Clock:
    """Counts the time and the CPU time of a part of a program."""

    def __init__(self) -> None:
        self._wall, self._cpu = time.perf_counter(), time.process_time()

    def rates(self, count: int) -> Figures:
        """Return messages a second, and for each second of this process's CPU time."""
        wall, cpu = time.perf_counter() - self._wall, time.process_time() - self._cpu
        return {"wall": count / wall, "cpu": count / cpu}


async def until(condition: Callable[[], bool]) -> None:
    """Wait until a condition holds."""
    while not condition():  # noqa: ASYNC110 - nothing else tells when
        await asyncio.sleep(0.01)


async def until_heard(node: actors.Node, topic: str) -> None:
    """Wait until a topic has a subscription."""
    while not await node.count_subscribers(topic):  # noqa: ASYNC110 - as above
        await asyncio.sleep(0.01)


def memory_mib(process: int | str = "self") -> float:
    """Return the memory of a process that is no file's, in MiB."""
    for line in Path(f"/proc/{process}/status").read_text(encoding="ascii").splitlines():
        if line.startswith("RssAnon"):
            return int(line.split()[1]) / 1024
    raise OSError("this system does not say how much memory a process has")


async def publish(_: Path, url: str, workload: str, messages: int = 0) -> Figures:
    """Publish a workload, as fast as the recorder takes it."""
    load = WORKLOADS[workload]
    async with actors.Node("source", url=url) as node:
        publishers = [node.create_publisher(type(load.message), name, KEEP_ALL) for name in load.names]
        await until(lambda: all(each.get_subscription_count() for each in publishers))
        for number in range(messages or load.messages):
            publisher = publishers[number % load.topics]
            await publisher.ready()
            publisher.publish(load.message)
            if number % load.at_once == 0:
                await publisher.flush()
        for publisher in publishers:
            await publisher.flush()
    return {}


async def record(folder: Path, url: str, workload: str, compression: str = "none") -> Figures:
    """Record a workload that another process publishes."""
    load = WORKLOADS[workload]
    options = RecorderOptions(lossless=True, compression=compression)
    async with Recorder(folder / "bag", Selection(topics=load.names), options, url=url) as recorder:
        source = await _start("publish", folder, url=url, workload=workload)
        await until(lambda: recorder.statistics().received > 0)
        clock = Clock()
        await until(lambda: recorder.statistics().written >= load.messages)
        rates = clock.rates(load.messages)
        await source.wait()
    found = recorder.statistics()
    assert (found.written, found.lost, found.dropped) == (load.messages, 0, 0), found
    return rates


def write(folder: Path, workload: str, compression: str = "none") -> Figures:
    """Write a workload by `mcap`'s writer, with chunks as large and compressed as the recorder's."""
    load = WORKLOADS[workload]
    topic, data = BagTopic.of_class("/data", type(load.message)), cdr.encode(load.message)
    with (folder / "mcap.mcap").open("wb") as stream:
        clock = Clock()
        writer = McapWriter(stream, chunk_size=768 * 1024, compression=CompressionType[compression.upper()])
        writer.start("ros2", "")
        schema = writer.register_schema(topic.type_name, "ros2msg", topic.definition.encode())
        channels = [writer.register_channel(each, "cdr", schema) for each in load.names]
        for number in range(load.messages):
            writer.add_message(channels[number % load.topics], number, data, number, number)
        writer.finish()  # type: ignore[no-untyped-call]  # mcap's
        return clock.rates(load.messages)


def prepare(folder: Path, workload: str, messages: int = 0) -> Figures:
    """Write a bag of a workload that is played."""
    load = WORKLOADS[workload]
    data = cdr.encode(load.message)
    with Writer(folder / "played") as bag:
        numbers = [
            bag.add_topic(BagTopic.of_class(name, type(load.message), [KEEP_ALL])) for name in load.names
        ]
        for number in range(messages or load.messages):
            time_ns = (number + 1) * STEP_NS
            bag.write(numbers[number % load.topics], data, time_ns, time_ns, number)
    return {}


async def play(folder: Path, url: str, workload: str, rate: float = 1e9) -> Figures:
    """Play a bag until the broker has everything; another process receives it."""
    names = WORKLOADS[workload].names
    options = PlayerOptions(rate=rate, start_paused=True, wait_for_all_acked_sec=60)
    async with Player(folder / "played", options=options, url=url) as player:
        count = sum(each.message_count for each in Reader(folder / "played").summary().topics)

        for name in names:
            await until_heard(player.node, name)
        clock = Clock()
        player.resume()
        await player.wait()
        rates = clock.rates(count)
    found = player.statistics()
    assert (found.published, found.dropped, found.invalid) == (count, 0, 0), found
    return rates


async def listen(_: Path, url: str, workload: str, messages: int = 0) -> Figures:
    """Receive a workload; return how many of its messages came, and when."""
    load = WORKLOADS[workload]
    wanted = messages or load.messages
    times: list[int] = []
    async with actors.Node("listener", url=url) as node:

        def receive(_: bytes, info: actors.MessageInfo) -> None:
            times.append(info.received_timestamp)

        for name in load.names:
            node.create_subscription(type(load.message), name, receive, KEEP_ALL, raw=True)
        await until(lambda: len(times) >= wanted)
    if load.topics > 1 or not messages:
        return {"received": len(times)}
    return {"received": len(times), "times": times}


def read(folder: Path, workload: str) -> Figures:
    """Read the bag that is played by `mcap`'s reader."""
    del workload
    (path,) = (folder / "played").glob("*.mcap")
    with path.open("rb") as stream:
        clock = Clock()
        count = sum(1 for _ in make_reader(stream).iter_messages())
        return clock.rates(count)


def prepare_large(folder: Path) -> Figures:
    """Write a file with an index as one of 10 GB has it, and a hole in place of the chunks."""
    topic = BagTopic.of_class("", String)
    channels = range(1, 11)
    places = range(1000, LARGE_BYTES, CHUNK_BYTES)
    with (folder / "large.mcap").open("wb") as file:
        file.write(MAGIC + _bytes(Header("ros2", "")))
        file.truncate(LARGE_BYTES)
        file.seek(LARGE_BYTES)
        file.write(_bytes(DataEnd(0)))
        start = file.tell()
        definition = topic.definition.encode()
        file.write(_bytes(Schema(id=1, name=topic.type_name, encoding="ros2msg", data=definition)))
        for number in channels:
            file.write(_bytes(Channel(number, f"/data{number}", "cdr", {}, 1)))
        counts = dict.fromkeys(channels, len(places))
        total = sum(counts.values())
        file.write(_bytes(Statistics(0, len(counts), counts, len(places), total, len(places), 0, 0, 1)))
        for index, place in enumerate(places):
            offsets = {number: place + CHUNK_BYTES - 100 * number for number in channels}
            chunk = ChunkIndex(
                chunk_length=CHUNK_BYTES - 1000,
                chunk_start_offset=place,
                compression="",
                compressed_size=CHUNK_BYTES - 2000,
                message_end_time=index,
                message_index_length=1000,
                message_index_offsets=offsets,
                message_start_time=index,
                uncompressed_size=CHUNK_BYTES - 2000,
            )
            file.write(_bytes(chunk))
        file.write(_bytes(Footer(start, 0, 0)) + MAGIC)
    return {}


def _bytes(record: Any) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    data: bytes = builder.end()  # type: ignore[no-untyped-call]  # mcap's
    return data


def summarize(folder: Path) -> Figures:
    """Read what a large file has."""
    clock = Clock()
    with Reader(folder / "large.mcap") as bag:
        summary = bag.summary()
    assert not summary.problems, summary
    assert summary.message_count, summary
    return clock.rates(1)


def summarize_by_mcap(folder: Path) -> Figures:
    """Do the same by `mcap`'s reader."""
    clock = Clock()
    with (folder / "large.mcap").open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    return clock.rates(1)


async def record_long(
    folder: Path, url: str, workload: str, gibibytes: float, max_cache_size: int
) -> Figures:
    """Record so much, keeping the newest files; return how much memory the recorder has each second."""
    load = WORKLOADS[workload]
    messages = round(gibibytes * (1 << 30) / len(cdr.encode(load.message)))
    options = RecorderOptions(
        lossless=True, max_cache_size=max_cache_size, max_bag_size=64 * MIB, max_splits=4
    )
    samples: list[float] = []
    async with Recorder(folder / "bag", Selection(topics=load.names), options, url=url) as recorder:
        before = memory_mib()
        source = await _start("publish", folder, url=url, workload=workload, messages=messages)
        while recorder.statistics().written < messages:
            await asyncio.sleep(SAMPLE_SEC)
            samples.append(memory_mib())
        await source.wait()
    found = recorder.statistics()
    assert (found.written, found.lost, found.dropped) == (messages, 0, 0), found
    return {"messages": messages, "before": before, "samples": samples}


async def _start(role: str, folder: Path, **arguments: Any) -> asyncio.subprocess.Process:
    return await asyncio.create_subprocess_exec(
        sys.executable, __file__, role, str(folder), json.dumps(arguments), stdout=asyncio.subprocess.DEVNULL
    )


COROUTINES: dict[str, Callable[..., Awaitable[Figures]]] = {
    each.__name__: each for each in (publish, record, play, listen, record_long)
}
FUNCTIONS: dict[str, Callable[..., Figures]] = {
    each.__name__: each for each in (write, prepare, read, prepare_large, summarize, summarize_by_mcap)
}


def main(role: str, folder: str, arguments: str) -> None:
    """Run a role, and print its figures."""
    keywords = json.loads(arguments)

    async def run() -> None:
        print(json.dumps(await COROUTINES[role](Path(folder), **keywords)))

    if role in COROUTINES:
        actors.run(run, args=[])
    else:
        # As `actors.run` does, so that both sides of a ratio keep freed memory.
        process.configure_process()
        print(json.dumps(FUNCTIONS[role](Path(folder), **keywords)))


if __name__ == "__main__":
    main(*sys.argv[1:])

"""Which files of the product an operation enters, in which order, and how many Python calls it costs.

    python -m tests.ways            # a table
    python -m tests.ways --files    # and the files of each operation
    python -m tests.ways --check    # compare them with ARCHITECTURE.md, as the integration tests do

A broker and nodes share a loop, so that one profiler sees both sides. Each operation is warmed up and then
measured several times. Other work of the loop, such as a keepalive that is due, only adds to a measurement:
the files that all measurements have in common, and the fewest calls, are the operation's. No time is
measured, so the speed and the load of the machine make no difference.
"""

from __future__ import annotations

import argparse
import asyncio
import logging
import re
import sys
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple, Self

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String
from tests.actors.meeting import Meeting, until
from tests.actors.web.site import Site

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Iterator, Mapping
    from types import FrameType

ROOT: Final = Path(__file__).resolve().parent.parent
PRODUCT: Final = tuple(f"{ROOT / package}/" for package in ("proto", "broker", "actors"))

WARM_UPS: Final = 3
MEASUREMENTS: Final = 5

LARGE_CHARACTERS: Final = 100_000
"""Of a message that travels through shared memory."""

FILES_TOLERANCE: Final = 3
"""In a restart it depends on the order of events whether a few files run."""

CALLS_TOLERANCE: Final = 0.1
"""By which part more calls than ARCHITECTURE.md states an operation may cost before the check fails."""


class Way(NamedTuple):
    """What an operation entered."""

    files: list[str]
    """Paths from the repository's root, in the order in which they were first entered."""
    calls: int
    """Calls of the product's functions; a resumed coroutine counts as called."""


class Profiler:
    """Counts the calls of the product's functions."""

    def __init__(self) -> None:
        self.files: dict[str, None] = {}
        self.calls = 0

    def __call__(self, frame: FrameType, event: str, _: object) -> None:
        """Count an event of `sys.setprofile`."""
        file = frame.f_code.co_filename
        if event == "call" and file.startswith(PRODUCT):
            self.calls += 1
            self.files.setdefault(file)


async def measure(operation: Callable[[], Awaitable[object]]) -> Way:
    """Run an operation until it is in its steady state, and return what it always enters."""
    for _ in range(WARM_UPS):
        await operation()
    profilers = [Profiler() for _ in range(MEASUREMENTS)]
    for profiler in profilers:
        sys.setprofile(profiler)
        try:
            await operation()
        finally:
            sys.setprofile(None)
    common = set.intersection(*(set(each.files) for each in profilers))
    files = [str(Path(file).relative_to(ROOT)) for file in profilers[-1].files if file in common]
    return Way(files, min(each.calls for each in profilers))


class Peers:
    """A broker, and two nodes with whatever else an operation needs.

    Args:
        stack: Ends them.
    """

    def __init__(self, stack: AsyncExitStack) -> None:
        self.stack = stack
        self.meeting = Meeting(stack)
        self._received = asyncio.Event()
        self.topics: dict[str, actors.Publisher[String]] = {}

    async def open(self, *topics: str) -> Self:
        """Start the broker and the nodes; connect them by these topics."""
        await self.meeting.open()
        self.stack.push_async_callback(self.meeting.stop_broker)
        self.near, self.far = await self._node("near"), await self._node("far")
        for topic in topics:
            self.far.create_subscription(String, topic, lambda _: self._received.set(), 10)
            self.topics[topic] = self.near.create_publisher(String, topic, 10)
            await self.topics[topic].wait_for_subscriptions()
        return self

    async def _node(self, name: str) -> actors.Node:
        node = actors.Node(name, url=self.meeting.url, use_global_arguments=False)
        return await self.stack.enter_async_context(node)

    async def deliver(self, topic: str, data: str) -> None:
        """Publish a message, and wait for the end of the callback."""
        self._received.clear()
        self.topics[topic].publish(String(data=data))
        await self._received.wait()


Measurements = AsyncIterator[tuple[str, Way]]
"""By the headings in ARCHITECTURE.md."""


async def messages(peers: Peers) -> Measurements:
    """From `publish` to the end of the callback."""
    await peers.open("small", "large")
    yield "A message", await measure(lambda: peers.deliver("small", "a message"))
    yield "A large message", await measure(lambda: peers.deliver("large", "x" * LARGE_CHARACTERS))


async def call(peers: Peers) -> Measurements:
    """From the request to the reply."""

    def add(request: AddTwoInts.Request, response: AddTwoInts.Response) -> AddTwoInts.Response:
        response.sum = request.a + request.b
        return response

    await peers.open()
    peers.far.create_service(AddTwoInts, "add", add)
    client = peers.near.create_client(AddTwoInts, "add")
    await client.wait_for_service()
    yield "A call", await measure(lambda: client.call(AddTwoInts.Request(a=1, b=2)))


async def restart(peers: Peers) -> Measurements:
    """From the end of a broker until the publisher has its subscription again at the next one."""
    await peers.open("small")
    publisher = peers.topics["small"]

    async def survive() -> None:
        await peers.meeting.stop_broker()
        await until(lambda: not publisher.get_subscription_count())
        await peers.meeting.restart_broker()
        await publisher.wait_for_subscriptions()

    yield "A restart of the broker", await measure(survive)


async def request(peers: Peers) -> Measurements:
    """From an HTTP request to its answer."""
    await peers.open("small")
    site = await Site(peers.stack, peers.meeting).open()
    await site.json_until("/api/topics", lambda topics: any(each["name"] == "/small" for each in topics))
    yield "`GET /api/topics`", await measure(lambda: site.json("/api/topics"))


async def ways() -> dict[str, Way]:
    """Measure all operations."""
    found: dict[str, Way] = {}
    for operation in (messages, call, restart, request):
        async with AsyncExitStack() as stack:
            found |= {title: way async for title, way in operation(Peers(stack))}
    return found


def faults(text: str, found: Mapping[str, Way]) -> Iterator[str]:
    """Return what a document says about the ways that is not so.

    Each way has a section under a heading such as "### A call: 41 files, 210 calls". The section names only
    files that are entered; the end of a path is enough.

    Args:
        text: The document.
        found: The measured ways by the titles of the sections.
    """
    sections = {
        title: (int(files), int(calls.replace(",", "")), body)
        for title, files, calls, body in re.findall(
            r"^### ([^\n]+): (\d+) files, ([\d,]+) calls$(.*?)(?=^##|\Z)", text, re.MULTILINE | re.DOTALL
        )
    }
    for title, way in found.items():
        if title not in sections:
            yield f"{title}: no heading says how many files and calls"
            continue
        files, calls, body = sections[title]
        if abs(files - len(way.files)) > FILES_TOLERANCE:
            yield f"{title}: enters {len(way.files)} files, not {files}"
        if way.calls > calls * (1 + CALLS_TOLERANCE):
            yield f"{title}: costs {way.calls} calls, not {calls}"
        for name in re.findall(r"`([\w./]+\.py)`", body):
            if not any(file == name or file.endswith(f"/{name}") for file in way.files):
                yield f"{title}: does not enter {name}"


def main() -> int:
    """Print the ways, or what ARCHITECTURE.md says wrongly of them."""
    parser = argparse.ArgumentParser(prog="python -m tests.ways", description=__doc__.partition("\n")[0])
    parser.add_argument("--files", action="store_true", help="list the files of each operation, in order")
    parser.add_argument("--check", action="store_true", help="compare with ARCHITECTURE.md; 1 if it is wrong")
    options = parser.parse_args()
    # While a broker starts again on a busy machine, nodes may warn that there is none.
    logging.getLogger("callboard").setLevel(logging.ERROR)
    found = asyncio.run(ways())
    if options.check:
        wrong = list(faults((ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8"), found))
        print(*wrong, sep="\n", end="\n" if wrong else "")
        return int(bool(wrong))
    print(f"{'operation':<26}{'files':>6}{'calls':>8}")
    for title, way in found.items():
        print(f"{title:<26}{len(way.files):>6}{way.calls:>8,}")
        if options.files:
            print(*(f"    {file}" for file in way.files), sep="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())

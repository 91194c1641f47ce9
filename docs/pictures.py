"""Draw the picture in README.md: what `callboard graph` writes while the course's five nodes run.

python docs/pictures.py [FILE]      default: docs/graph.svg
"""  # noqa: INP001 - a script, no package

from __future__ import annotations

import asyncio
import os
import runpy
import sys
from contextlib import AsyncExitStack
from pathlib import Path

import broker

ROOT = Path(__file__).resolve().parent.parent
NODES = (
    "MinimalPublisher",
    "MinimalSubscriber",
    "PublishingSubscriber",
    "AddTwoIntsServer",
    "AddTwoIntsClient",
)


async def main(picture: Path) -> None:
    """Run a broker and the course, wait until all nodes are in the graph, and draw the graph."""
    course = runpy.run_path(str(ROOT / "examples" / "course_decorated.py"))
    async with broker.Broker(broker.BrokerOptions(port=0)) as hub, AsyncExitStack() as stack:
        os.environ["CALLBOARD_URL"] = hub.url
        nodes = [course[name]() for name in NODES]
        for node in nodes:
            await stack.enter_async_context(node)
        for node in nodes:
            for other in nodes:
                await node.wait_for_node(other.get_fully_qualified_name())
        command = (sys.executable, "-m", "actors", "graph", "--output", str(picture))
        graph = await asyncio.create_subprocess_exec(*command)
        if await graph.wait():
            sys.exit(1)


if __name__ == "__main__":
    asyncio.run(main(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs" / "graph.svg"))

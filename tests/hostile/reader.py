"""A node that others attack with messages: `python -m tests.hostile.reader URL` runs until it is killed.

It reads `/tf` and serves `/add` for the innocents.
"""

from __future__ import annotations

import asyncio
import sys

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.tf2_msgs.msg import TFMessage
from tests.hostile.innocents import add


async def main() -> None:
    """Print a line once the node is there."""
    async with actors.Node("reader", url=sys.argv[1], use_global_arguments=False) as node:
        node.create_service(AddTwoInts, "/add", add)
        node.create_subscription(TFMessage, "/tf", lambda message: None, 10)
        sys.stdout.write("ready\n")
        sys.stdout.flush()
        await asyncio.get_running_loop().create_future()


if __name__ == "__main__":
    asyncio.run(main())

"""Attacks of full size on what decodes messages; the last argument is its broker's URL.

They are on a node (`reader.py`), on `topic echo`, and on a page that shows a topic.
"""

from __future__ import annotations

import asyncio
from contextlib import AsyncExitStack, suppress
from functools import partial
from typing import TYPE_CHECKING, Final

import aiohttp

import actors
from actors.interfaces.rcl_interfaces.srv import SetParameters
from actors.interfaces.tf2_msgs.msg import TFMessage
from tests.hostile.decode_bytes import starved
from tests.hostile.victims import NODE, PAGE, TOKEN, Attack, Started, Victim
from tests.seams.nodes import invalid_requests

if TYPE_CHECKING:
    from tests.hostile.victims import Processes

MB: Final = 1_000_000
PERIOD_SEC: Final = 0.5
TYPE: Final = "tf2_msgs/msg/TFMessage"


def empty_elements(*target: str, size: int) -> None:
    """Case 62: sequences of nested messages that are empty maps of one byte."""
    asyncio.run(_publish(target[-1], size))


async def _publish(url: str, size: int) -> None:
    data = starved("transforms", size)
    async with actors.Node("attacker", url=url, use_global_arguments=False) as node:
        publisher = node.create_publisher(TFMessage, "/tf", 1)
        while True:
            publisher.publish_encoded(data)
            await asyncio.sleep(PERIOD_SEC)


def empty_parameters(url: str) -> None:
    """Case 62: the same in calls of a service that every node has."""

    async def call() -> None:
        async with actors.Node("attacker", url=url, use_global_arguments=False) as node:
            client = node.create_client(SetParameters, "/reader/set_parameters")
            with invalid_requests(client, starved("parameters", MB)):
                while True:
                    with suppress(actors.CallFailed):
                        await client.call(SetParameters.Request())
                    await asyncio.sleep(PERIOD_SEC)

    asyncio.run(call())


def shown_elements(page: str, url: str, size: int) -> None:
    """Case 62: the same on a topic that a page shows."""

    async def show() -> None:
        async with AsyncExitStack() as stack:
            session = await stack.enter_async_context(aiohttp.ClientSession())
            headers = {"Authorization": f"Bearer {TOKEN}"}
            socket = await stack.enter_async_context(session.ws_connect(f"{page}/api/live", headers=headers))
            await socket.send_json({"open": 1, "panel": "echo", "topic": "/tf"})
            publishing = asyncio.create_task(_publish(url, size))
            async for _ in socket:
                pass
            await publishing

    asyncio.run(show())


def _start_echo(processes: Processes, name: str) -> Started:
    _, url = processes.broker(name)
    echo = processes.start("actors", "topic", "echo", "/tf", TYPE, "--url", url)
    return Started(echo.pid, (url,), (url,))


ECHO: Final = Victim("echo", _start_echo)

ATTACKS: Final = {
    "empty-elements": Attack(62, partial(empty_elements, size=MB), 48, NODE),
    "empty-elements-4": Attack(62, partial(empty_elements, size=4 * MB), 96, NODE),
    "empty-parameters": Attack(62, empty_parameters, 48, NODE),
    "echoed-elements": Attack(62, partial(empty_elements, size=20 * MB), 400, ECHO),
    # The page shows messages of up to 16 MiB.
    "shown-elements": Attack(62, partial(shown_elements, size=16 * MB), 300, PAGE),
    "shown-elements-40": Attack(62, partial(shown_elements, size=40 * MB), 700, PAGE),
}

"""Attacks of full size on a node that decodes messages (`reader.py`); their target is its broker's URL."""

from __future__ import annotations

import asyncio
from typing import Final

import msgspec

import actors
from actors.interfaces.tf2_msgs.msg import TFMessage
from tests.hostile.victims import NODE, Attack

ELEMENTS: Final = 1_000_000


def empty_elements(url: str) -> None:
    """Case 62: sequences of nested messages that are empty maps of one byte."""

    async def publish() -> None:
        data = msgspec.msgpack.encode({"transforms": [{}] * ELEMENTS})
        async with actors.Node("attacker", url=url, use_global_arguments=False) as node:
            publisher = node.create_publisher(TFMessage, "/tf", 10)
            while True:
                publisher.publish_encoded(data)
                await asyncio.sleep(0.5)

    asyncio.run(publish())


ATTACKS: Final = {"empty-elements": Attack(62, empty_elements, victim=NODE)}

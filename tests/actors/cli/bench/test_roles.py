"""What the processes of a trial do, here in one process."""

from __future__ import annotations

import asyncio
import os

from actors.cli.bench.roles import publisher, subscriber
from broker import Broker, BrokerOptions


async def test_a_short_load_has_two_messages() -> None:
    """They make a rate, also if the end of the load overtakes the first of them."""
    async with Broker(BrokerOptions(port=0)) as broker, asyncio.timeout(20):
        sent, received = await asyncio.gather(
            publisher(url=broker.url, seconds=0.0, size=2_000_000, broker_pid=os.getpid()),
            subscriber(url=broker.url, seconds=0.0, size=2_000_000),
        )
    assert sent["messages"] == received["messages"] == 2
    assert received["elapsed_sec"]

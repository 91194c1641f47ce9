"""Probes of the broker: small queries, whose cost does not depend on the size of the graph."""

from __future__ import annotations

import asyncio
import time
from typing import TYPE_CHECKING, Final

from actors.errors import BrokerUnreachable
from proto.aio.tasks import cancel_and_wait, keep_running

if TYPE_CHECKING:
    from prometheus_client import Histogram

    from actors.node.node import Node

PROBE_SEC: Final = 5.0
"""Seconds between two probes of the round trip."""

BROKER_ANSWER_SEC: Final = 1.0
"""Time for the broker to answer; a broker that takes longer is not ready."""

NO_TYPE: Final = f"RIHS01_{'0' * 64}"
"""The hash of no type: asking for it is the smallest question."""


async def broker_answers(node: Node) -> bool:
    """Return whether the broker answers within `BROKER_ANSWER_SEC`.

    Args:
        node: Connected with the broker, or not.
    """
    try:
        async with asyncio.timeout(BROKER_ANSWER_SEC):
            await node.get_type_definition(NO_TYPE)
    except (BrokerUnreachable, TimeoutError):
        return False
    return True


class RoundTrips:
    """Measures round trips every `PROBE_SEC`, beginning with the first scrape.

    Args:
        node: Asks.
        histogram: Takes the seconds of each; unanswered ones count with the time that they have waited.
    """

    def __init__(self, node: Node, histogram: Histogram) -> None:
        self._node, self._histogram = node, histogram
        self._task: asyncio.Task[None] | None = None

    def begin(self) -> None:
        """Measure from now on; nothing if it does so already."""
        if self._task is None:
            self._task = asyncio.get_running_loop().create_task(keep_running("The probing", self._run))

    async def close(self) -> None:
        """End it."""
        if self._task is not None:
            await cancel_and_wait(self._task)

    async def _run(self) -> None:
        while True:
            began = time.monotonic()
            if self._node.connected:
                await broker_answers(self._node)
                self._histogram.observe(time.monotonic() - began)
            await asyncio.sleep(PROBE_SEC)

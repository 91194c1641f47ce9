"""Messages in shared memory cross a mesh as bytes."""

from __future__ import annotations

import asyncio
import sys
from typing import TYPE_CHECKING

import pytest

import actors
from actors.interfaces.std_msgs.msg import UInt8MultiArray
from tests.integration.conftest import wait_for_subscriptions
from tests.integration.mesh.stations import NEVER_SILENT, make_brokers, start_all
from tests.integration.slot_victims import content, number_of
from tests.waiting import until

if TYPE_CHECKING:
    from contextlib import AsyncExitStack

    from tests.integration.conftest import System

COUNT = 30
KEEP_ALL = actors.QoSProfile(history=actors.HistoryPolicy.KEEP_ALL)


@pytest.mark.skipif(sys.platform != "linux", reason="arenas are memfds")
async def test_a_batch_in_shared_memory_reaches_readers_of_other_brokers(
    system: System, stack: AsyncExitStack
) -> None:
    """All of it, in order, whole, and as bytes; the reader at the publisher's broker gets references."""
    brokers = make_brokers(system, ((), (0,)))
    near, far = await start_all(brokers, stack, *NEVER_SILENT)
    reader = await stack.enter_async_context(actors.Node("reader", url=brokers[0].url))
    got: dict[str, list[int]] = {"near": [], "far": []}
    for name, node in (("near", reader), ("far", far.node)):
        node.create_subscription(
            UInt8MultiArray,
            "large",
            lambda message, name=name: got[name].append(number_of(message)),
            KEEP_ALL,
        )
    publisher = near.node.create_publisher(UInt8MultiArray, "large", KEEP_ALL)
    await wait_for_subscriptions(publisher, 2)
    number = 0
    while not reader.diagnostics().shared_memory.received:
        publisher.publish(UInt8MultiArray(data=content(number)))
        number += 1
        await asyncio.sleep(0.001)
    # What waits to be sent is counted when it is.
    await until(lambda: len(got["near"]) == len(got["far"]) == number, "the first messages")
    sent = near.node.diagnostics().shared_memory.sent
    for each in range(number, number + COUNT):  # several in a slot
        publisher.publish(UInt8MultiArray(data=content(each)))
    await until(lambda: len(got["near"]) == len(got["far"]) == number + COUNT, "all messages")
    assert got["near"] == got["far"] == list(range(number + COUNT))
    assert near.node.diagnostics().shared_memory.sent == sent + COUNT
    assert far.node.diagnostics().shared_memory.received == 0

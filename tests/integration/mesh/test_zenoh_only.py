"""The example that takes part in a mesh with Zenoh alone."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String
from tests.integration.conftest import DEADLINE_SEC, ROOT
from tests.integration.mesh.stations import MeshBroker

if TYPE_CHECKING:
    from contextlib import AsyncExitStack

    from tests.integration.conftest import System


async def test_a_program_without_callboard_hears_and_serves(system: System, stack: AsyncExitStack) -> None:
    """It gets each message once, answers calls, and disappears when it ends."""
    broker = await MeshBroker(system).start()
    example = str(ROOT / "examples" / "zenoh_only.py")
    program = await system.program(sys.executable, example, broker.endpoint)
    node = await stack.enter_async_context(actors.Node("node", url=broker.url))
    publisher = node.create_publisher(String, "/addison", 10)
    client = node.create_client(AddTwoInts, "/add_two_ints")
    assert await client.wait_for_service(DEADLINE_SEC)
    await publisher.wait_for_subscriptions(1, DEADLINE_SEC)
    for number in range(3):
        publisher.publish(String(data=f"message {number}"))
        response = await client.call(AddTwoInts.Request(a=number, b=3), timeout_sec=DEADLINE_SEC)
        assert response.sum == number + 3
    await program.wait_for_line("I heard: message 2")
    assert [line for line in program.lines if "heard" in line] == [
        f"I heard: message {number}" for number in range(3)
    ]
    assert await program.stop() == 0
    while "/zenoh_only" in (await node.get_graph()).nodes():
        pass

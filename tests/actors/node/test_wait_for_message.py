"""`wait_for_message`: one message of a topic, and nothing left behind."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import pytest

import actors
from actors.interfaces.std_msgs.msg import Int64
from tests.actors.meeting import latched, turns

if TYPE_CHECKING:
    from tests.actors.meeting import Meeting


async def test_it_returns_the_next_message(meeting: Meeting) -> None:
    """The first message published while it waits; its subscription is gone afterwards."""
    talker, waiter = await meeting.node("talker"), await meeting.node("waiter")
    publisher = talker.create_publisher(Int64, "number")
    waiting = asyncio.create_task(actors.wait_for_message(Int64, waiter, "number", timeout_sec=20))
    await publisher.wait_for_subscriptions(1, timeout_sec=20)
    publisher.publish(Int64(data=1))
    publisher.publish(Int64(data=2))
    assert (await waiting).data == 1
    assert not waiter.diagnostics().subscriptions


async def test_it_returns_a_latched_message(meeting: Meeting) -> None:
    """With a TRANSIENT_LOCAL profile, a message from before the call."""
    node = await meeting.node("node")
    node.create_publisher(Int64, "number", latched(1)).publish(Int64(data=7))
    message = await actors.wait_for_message(Int64, node, "number", 20, qos_profile=latched(1))
    assert message.data == 7


async def test_it_ends_at_its_deadline(meeting: Meeting) -> None:
    """No message: WaitTimeout, which names the topic; the subscription is gone."""
    node = await meeting.node("node")
    with pytest.raises(actors.WaitTimeout, match=r"No message on '/number' within 0\.01 s"):
        await actors.wait_for_message(Int64, node, "number", timeout_sec=0.01)
    assert not node.diagnostics().subscriptions


async def test_it_ends_with_its_node(meeting: Meeting) -> None:
    """A destroyed node raises NodeDestroyed at once."""
    node = await meeting.node("node")
    waiting = asyncio.create_task(actors.wait_for_message(Int64, node, "number", timeout_sec=20))
    await turns()
    node.destroy_node()
    with pytest.raises(actors.NodeDestroyed):
        await waiting


async def test_a_callback_may_wait_for_a_message(meeting: Meeting) -> None:
    """Another callback of the node publishes what the first one waits for."""
    node = await meeting.node("node")
    publisher = node.create_publisher(Int64, "number")
    got: asyncio.Future[int] = asyncio.get_running_loop().create_future()

    async def wait() -> None:
        once.cancel()
        message = await actors.wait_for_message(Int64, node, "number", timeout_sec=20)
        got.set_result(message.data)

    once = node.create_timer(0.001, wait)
    node.create_timer(0.001, lambda: publisher.publish(Int64(data=3)))
    async with asyncio.timeout(20):
        assert await got == 3

"""What a node's parts share: waits, and what becomes of a callback's error."""

from __future__ import annotations

import asyncio
import math
from typing import TYPE_CHECKING

import pytest

import actors
from actors.endpoints.departing import DEPARTING_SLACK
from actors.endpoints.endpoint import endpoint_of
from actors.endpoints.subscription.credit import WINDOW_MESSAGES
from actors.interfaces.std_msgs.msg import Int64
from proto.wire.frames import Notice
from tests.actors.meeting import KEEP_ALL, matched, turns, until
from tests.seams.nodes import context_of, link_of

if TYPE_CHECKING:
    from collections.abc import AsyncIterator
    from pathlib import Path

    from tests.actors.meeting import Meeting


@pytest.fixture
async def node(tmp_path: Path) -> AsyncIterator[actors.Node]:
    """A running node that never finds a broker."""
    async with actors.Node("context", url=f"callboard+unix://{tmp_path}/none") as running:
        yield running


async def test_a_wait_ends_when_its_condition_holds(node: actors.Node) -> None:
    """A condition that holds costs no turn of the loop; one that comes true is seen at the next wake."""
    context, facts = context_of(node), [1]
    async with asyncio.timeout(0):
        await context.wait_until(lambda: bool(facts), "A fact", 5)
    facts.clear()
    waiting = asyncio.create_task(context.wait_until(lambda: bool(facts), "A fact", math.inf))
    await turns()
    facts.append(1)
    context.link.wake()
    async with asyncio.timeout(20):
        await waiting


async def test_a_wait_gives_up(node: actors.Node) -> None:
    """Issue: every wait has a limit; WaitTimeout is a TimeoutError and says what is wrong."""
    with pytest.raises(TimeoutError, match=r"There was no miracle after 0\.01 s"):
        await context_of(node).wait_until(lambda: False, "There was no miracle", 0.01)
    assert dict(link_of(node).sizes())["waits"] == 0


async def test_a_wait_ends_with_its_node(node: actors.Node) -> None:
    """A wait on a node that is destroyed meanwhile raises NodeDestroyed."""
    waiting = asyncio.create_task(context_of(node).wait_until(lambda: False, "A miracle", math.inf))
    await turns()
    node.destroy_node()
    with pytest.raises(actors.NodeDestroyed):
        await waiting


async def test_waits_need_a_running_node() -> None:
    """A wait on a node that does not run says how to run it."""
    with pytest.raises(RuntimeError, match="async with node"):
        await context_of(actors.Node("n")).wait_until(lambda: True, "Anything", 1)


async def test_a_wait_in_a_callback_frees_the_mailbox(meeting: Meeting) -> None:
    """While a callback waits through callboard, others run: what it waits for may be their doing."""
    node = await meeting.node("both")
    facts: list[int] = []

    async def wait(msg: Int64) -> None:
        await context_of(node).wait_until(lambda: bool(facts), "A fact", 20)
        facts.append(2)

    def state(msg: Int64) -> None:
        facts.append(1)
        link_of(node).wake()

    node.create_subscription(Int64, "wait", wait)
    node.create_subscription(Int64, "state", state)
    first, second = node.create_publisher(Int64, "wait"), node.create_publisher(Int64, "state")
    await matched(first)
    await matched(second)
    first.publish(Int64())
    await meeting.settled(node)
    second.publish(Int64())
    await until(lambda: len(facts) == 2)
    assert facts == [1, 2]


async def test_a_refused_entity_is_reported(node: actors.Node, caplog: pytest.LogCaptureFixture) -> None:
    """What the broker refuses or remarks reaches the log; a client's calls fail."""
    publisher = node.create_publisher(Int64, "numbers")
    endpoint_of(publisher).refused(2, "too many")
    context_of(node).notice(Notice(0, 1, "take care", 0, 1))
    endpoint_of(publisher).notice(Notice(0, 1, "look out", 0, 1))
    for text in ("refused a publisher: too many", "take care", "look out"):
        assert text in caplog.text


async def test_departing_publishers_are_forgotten(meeting: Meeting) -> None:
    """The list of publishers that have still to send does not grow with those that have sent."""
    node = await meeting.node("n")
    for _ in range(50):
        publisher = node.create_publisher(Int64, "numbers")
        publisher.publish(Int64())
        await publisher.flush()
        publisher.destroy()
        await meeting.settled(node)
    assert len(context_of(node).departing) == 1


async def test_departing_publishers_are_forgotten_behind_one_that_cannot_leave(
    meeting: Meeting,
) -> None:
    """A reader without credit holds up one publisher; those destroyed after it are forgotten all the same."""
    node, reader = await meeting.node("n"), await meeting.node("reader")
    reader.create_subscription(Int64, "stuck", qos_profile=KEEP_ALL)
    stuck = node.create_publisher(Int64, "stuck", KEEP_ALL)
    await matched(stuck)
    for _ in range(WINDOW_MESSAGES + 1):
        stuck.publish(Int64())
    await meeting.settled(node)
    stuck.destroy()
    assert not context_of(node).departing.empty
    for _ in range(3 * DEPARTING_SLACK):
        node.create_publisher(Int64, "numbers").destroy()
        await meeting.settled(node)
    assert len(context_of(node).departing) <= DEPARTING_SLACK + 2
    assert len(link_of(node).publishers) == 1

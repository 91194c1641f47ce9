"""Nodes that share a name: both run and are listed, and what one loses the other keeps."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int64
from tests.actors.meeting import matched, until
from tests.seams.brokers import without_capabilities

if TYPE_CHECKING:
    from tests.actors.meeting import Meeting


async def test_nodes_share_a_name_if_both_say_so(meeting: Meeting) -> None:
    """Messages of both arrive, the graph lists both, and each answers calls of the service of both."""
    first = await meeting.node("same", shared_name=True)
    second = await meeting.node("same", shared_name=True)
    caller = await meeting.node("caller")
    assert await caller.get_node_names() == ["caller", "same", "same"]
    subscription = caller.create_subscription(Int64, "numbers")
    for number, node in enumerate((first, second)):
        publisher = node.create_publisher(Int64, "numbers")
        await matched(publisher)
        publisher.publish(Int64(data=number))
        node.create_service(AddTwoInts, "~/who", lambda _, response, n=number: response.__class__(sum=n))
    await until(lambda: subscription.queued == 2)
    client = caller.create_client(AddTwoInts, "/same/who")
    await meeting.settled(first, second, caller)
    answers = {(await client.call(AddTwoInts.Request())).sum for _ in range(4)}
    assert answers == {0, 1}
    second.destroy_node()
    while "same" in (await caller.get_node_names())[2:]:
        pass
    assert {(await client.call(AddTwoInts.Request())).sum for _ in range(4)} == {0}


@pytest.mark.parametrize("first", [False, True])
async def test_a_name_that_one_does_not_share_is_refused(meeting: Meeting, *, first: bool) -> None:
    """The error says which of the two does not share it."""
    await meeting.node("same", shared_name=first)
    with pytest.raises(actors.NodeNameTaken, match="share the name" if first else "does not share its name"):
        async with meeting.absent("same", shared_name=not first):
            pass


async def test_a_broker_without_shared_names_causes_a_warning(
    meeting: Meeting, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Against an older broker the node says that it will be the only one of its name."""
    without_capabilities(monkeypatch)
    await meeting.node("same", shared_name=True)
    assert sum("does not know shared node names" in record.getMessage() for record in caplog.records) == 1

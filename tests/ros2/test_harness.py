"""The processes of these tests: networks do not see each other."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.interfaces.std_msgs.msg import String

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.ros2.network import Network


async def test_ros_processes_meet_in_their_own_domain_only(make_network: Callable[[], Network]) -> None:
    """Processes of a domain exchange messages; those of another are not in its graph."""
    first, second = make_network(), make_network()
    assert first.domain != second.domain
    talker, listener, stranger = [
        await ros.node(name)
        for ros, name in ((first.ros(), "talker"), (first.ros(), "listener"), (second.ros(), "stranger"))
    ]
    publisher = await talker.publisher("/chatter", String)
    await stranger.publisher("/chatter", String)
    subscription = await listener.subscription("/chatter", String)
    await publisher.matched()
    await publisher.publish(String(data="one"), String(data="two"))
    assert await subscription.received(2) == [String(data="one"), String(data="two")]
    names = await listener.node_names("/talker", "/listener")
    assert "/stranger" not in names

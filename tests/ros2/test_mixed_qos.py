"""Topics whose publishers offer different QoS, through a bridge to real ROS 2."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import actors
from actors.interfaces.std_msgs.msg import String
from actors.qos.profile import DurabilityPolicy, QoSProfile

if TYPE_CHECKING:
    from tests.ros2.network import Network

LATCHED: Final = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


async def test_latched_messages_cross_beside_a_volatile_publisher(network: Network) -> None:
    """Publishers of one topic with different durability: the latched messages of one still cross, once."""
    network.broker()
    network.bridge()
    node = await network.ros().node("listener")
    async with actors.Node("map_server", url=network.url) as server, actors.Node("ui", url=network.url) as ui:
        latched = server.create_publisher(String, "/map", LATCHED)
        live = ui.create_publisher(String, "/map", 10)
        latched.publish(String(data="old"))
        keeper = await node.subscription("/map", String, LATCHED)
        assert await keeper.received(1) == [String(data="old")]
        both = await node.subscription("/map", String)
        await both.matched(2)
        await live.wait_for_subscriptions(2)
        live.publish(String(data="live"))
        latched.publish(String(data="new"))
        assert sorted(each.data for each in await both.received(2)) == ["live", "new"]
        assert [each.data for each in await keeper.received(2)] == ["old", "new"]

"""What is gone on one side is gone on the other, and nothing is there because of the bridge."""

from __future__ import annotations

import asyncio
import signal
from typing import TYPE_CHECKING, Any

import actors
from actors.bridges.options import LEASE_SEC
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import Trigger
from tests.ros2.graphs import nodes_until
from tests.ros2.ros import interface
from tests.waiting import until

if TYPE_CHECKING:
    from tests.ros2.conftest import Pair
    from tests.ros2.network import Network

ABSENT_SEC = 0.5
"""How long a server that does not exist is waited for; longer than the bridge needs for one that does."""


async def test_waiting_for_a_service_never_succeeds_because_of_the_bridge(pair: Pair) -> None:
    """Clients on both sides, and no server: neither sees one."""
    name = f"{pair.name}/nowhere"
    here = pair.here.create_client(Trigger, name)
    there = await pair.there.client(name, Trigger)
    assert not await here.wait_for_service(ABSENT_SEC)
    assert not await there.is_ready(ABSENT_SEC)
    pair.here.create_service(Trigger, name, lambda request, response: response)
    assert await there.is_ready()


async def test_waiting_for_an_action_server_never_succeeds_because_of_the_bridge(pair: Pair) -> None:
    """Clients on both sides, and no server: neither sees one, and both see one that comes."""
    name, fibonacci = f"{pair.name}/no_action", interface("test_msgs/action/Fibonacci")
    here: Any = pair.here.create_action_client(fibonacci, name)
    there = await pair.there.action_client(name, fibonacci)
    assert not await here.wait_for_server(ABSENT_SEC)
    assert not await there.is_ready(ABSENT_SEC)
    await pair.there.action_server(name, fibonacci, fibonacci.Result())
    assert await here.wait_for_server()


async def test_a_server_that_ends_is_gone_on_the_other_side(pair: Pair) -> None:
    """Clients see it; a server of the same name is seen again."""
    there, here = f"{pair.name}/ends_there", f"{pair.name}/ends_here"
    theirs = await pair.there.service(there, Trigger, Trigger.Response())
    own = pair.here.create_service(Trigger, here, lambda request, response: response)
    client = pair.here.create_client(Trigger, there)
    other = await pair.there.client(here, Trigger)
    assert await client.wait_for_service()
    assert await other.is_ready()
    await theirs.destroy()
    own.destroy()
    await until(lambda: not client.service_is_ready())
    await pair.there.service_count(here, 0)
    await pair.there.service(there, Trigger, Trigger.Response(success=True))
    pair.here.create_service(Trigger, here, lambda request, response: response)
    assert await client.wait_for_service()
    assert (await client.call(Trigger.Request())).success
    await other.call(Trigger.Request())


async def test_mirrors_end_with_the_bridge(network: Network) -> None:
    """After a clean end of the bridge neither side has nodes of the other."""
    network.broker()
    bridge = network.bridge()
    watcher = await network.ros().node("watcher")
    async with actors.Node("here", url=network.url) as here:
        await nodes_until(here, "/watcher")
        await watcher.node_names("/here")
        assert await asyncio.to_thread(bridge.stop) in {0, 128 + signal.SIGINT}, bridge.output()
        await nodes_until(here, absent=("/watcher",))
        await watcher.node_names(absent=["/here"])


async def test_mirrors_vanish_with_a_killed_bridge_and_return_with_the_next(network: Network) -> None:
    """callboard sees the death at once, ROS when the bridge's lease is over."""
    network.broker()
    bridge = network.bridge()
    watcher = await network.ros().node("watcher")
    async with actors.Node("here", url=network.url) as here:
        await nodes_until(here, "/watcher")
        await watcher.node_names("/here")
        bridge.kill()
        await nodes_until(here, absent=("/watcher",))
        await watcher.node_names(absent=["/here"])
        network.bridge()
        await nodes_until(here, "/watcher")
        await watcher.node_names("/here")


async def test_a_killed_process_of_ros_is_gone_here(pair: Pair) -> None:
    """When its lease is over."""
    ros = pair.network.ros(lease_sec=3)
    node = await ros.node(f"{pair.name[1:]}_victim")
    await nodes_until(pair.here, node.name)
    await ros.kill()
    await nodes_until(pair.here, absent=(node.name,))


async def test_a_killed_node_of_callboard_is_gone_in_ros(pair: Pair) -> None:
    """With its link."""
    process = pair.network.callboard(
        "topic", "pub", f"{pair.name}/text", "std_msgs/msg/String", "{data: text}"
    )
    subscription = await pair.there.subscription(f"{pair.name}/text", String)
    await subscription.received(1)
    process.kill()
    await subscription.matched(0)


async def test_the_bridge_starts_first_and_survives_a_restart_of_the_broker(network: Network) -> None:
    """It waits for a broker, and shows everything again after another one has taken its place."""
    network.bridge()
    watcher = await network.ros().node("watcher")
    broker = network.broker()
    async with actors.Node("here", url=network.url) as here:
        received: list[str] = []
        here.create_subscription(String, "/text", lambda each: received.append(each.data), 10)
        await nodes_until(here, "/watcher")
        await watcher.node_names("/here")
        broker.kill()
        await watcher.node_names(absent=["/here"])
        network.broker()
        await nodes_until(here, "/watcher")
        await watcher.node_names("/here")
        publisher = await watcher.publisher("/text", String)
        await publisher.matched()
        await publisher.publish(String(data="again"))
        await until(lambda: received == ["again"])


async def test_a_longer_lease_lets_a_process_of_ros_stand_still(pair: Pair) -> None:
    """With the default one it would have dropped the bridge, and might not have found it again."""
    name = f"{pair.name}/paused"
    await pair.there.service(name, Trigger, Trigger.Response(success=True))
    client = pair.here.create_client(Trigger, name)
    assert await client.wait_for_service()
    assert (await client.call(Trigger.Request())).success
    pair.ros.send_signal(signal.SIGSTOP)
    await asyncio.sleep(LEASE_SEC + 1)  # how long it stands still, not how long the test waits for something
    pair.ros.send_signal(signal.SIGCONT)
    assert (await client.call(Trigger.Request())).success


async def test_a_bridge_that_was_suspended_starts_anew(network: Network) -> None:
    """ROS has dropped it meanwhile, and would not learn the names of its nodes again."""
    network.broker()
    bridge = network.bridge()
    watcher = await network.ros().node("watcher")
    async with actors.Node("here", url=network.url):
        await watcher.node_names("/here")
        bridge.send_signal(signal.SIGSTOP)
        await watcher.node_names(absent=["/here"])
        await asyncio.sleep(LEASE_SEC)  # how long it is suspended, not how long the test waits for something
        bridge.send_signal(signal.SIGCONT)
        await watcher.node_names("/here")
    assert "was suspended for" in bridge.output()

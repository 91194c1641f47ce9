"""Topics that clients of rosbridge read and write."""

from __future__ import annotations

import base64
import math
from typing import TYPE_CHECKING, Any

import pytest

from actors.interfaces.geometry_msgs.msg import PointStamped, Quaternion
from actors.interfaces.sensor_msgs.msg import Image, LaserScan
from actors.interfaces.std_msgs.msg import ColorRGBA, String
from proto.wire.codes import EntryKind
from tests.actors.meeting import latched, until

if TYPE_CHECKING:
    from actors.endpoints.subscription.subscription import Subscription
    from tests.actors.meeting import Meeting
    from tests.actors.web.rosbridge.bridge import Bridge


async def _listen(meeting: Meeting, kind: type[Any], topic: str) -> Subscription[Any]:
    """Return a subscription of another node, whose messages a test takes."""
    node = await meeting.node(f"listener_of_{topic.strip(chr(47))}")
    return node.create_subscription(kind, topic, qos_profile=10)


async def _next(subscription: Subscription[Any]) -> Any:
    async for message in subscription:
        return message
    raise AssertionError("The subscription has ended")


async def test_messages_of_one_client_reach_another(bridge: Bridge) -> None:
    """In JSON, with the text by which each has named the topic."""
    reader, writer = await bridge.connect(), await bridge.connect()
    await reader.send("subscribe", topic="chatter")
    await reader.settled()
    await writer.send("advertise", id="adv:1", topic="/chatter", type="std_msgs/String")
    await writer.send("publish", topic="/chatter", msg={"data": "hello"})
    assert await reader.next() == {"op": "publish", "topic": "chatter", "msg": {"data": "hello"}}


async def test_a_node_gets_what_a_client_publishes(bridge: Bridge, meeting: Meeting) -> None:
    """Base64 or numbers for bytes, null for a float, the names of ROS 1 in times, no header at all."""
    images, scans, points = [
        await _listen(meeting, kind, topic)
        for kind, topic in ((Image, "/image"), (LaserScan, "/scan"), (PointStamped, "/point"))
    ]
    client = await bridge.connect()
    await client.send(
        "publish", topic="/image", msg={"data": base64.b64encode(b"\0\1\2").decode(), "width": 3}
    )
    assert bytes((await _next(images)).data) == b"\0\1\2"
    await client.send("publish", topic="/image", msg={"data": [3, 4]})
    assert bytes((await _next(images)).data) == b"\3\4"
    await client.send("publish", topic="/scan", msg={"ranges": [1, None], "range_max": None})
    scan = await _next(scans)
    assert [*map(math.isnan, scan.ranges), math.isnan(scan.range_max)] == [False, True, True]
    assert scan.header.stamp.sec > 0
    header = {"seq": 1, "stamp": {"secs": 5, "nsecs": 7}, "frame_id": "map"}
    await client.send("publish", topic="/point", msg={"header": header})
    found = (await _next(points)).header
    assert (found.stamp.sec, found.stamp.nanosec, found.frame_id) == (5, 7, "map")


async def test_a_client_gets_strict_json(bridge: Bridge, meeting: Meeting) -> None:
    """NaN and infinities are null; bytes are base64."""
    node = await meeting.node("talker")
    scans = node.create_publisher(LaserScan, "/scan", latched(1))
    scans.publish(LaserScan(ranges=[1.5, math.nan, math.inf], range_max=-math.inf))
    node.create_publisher(Image, "/image", latched(1)).publish(Image(data=b"\xff\0"))
    client = await bridge.connect()
    await client.send("subscribe", topic="/scan", type="sensor_msgs/LaserScan")
    message = (await client.next())["msg"]
    assert (message["ranges"], message["range_max"]) == ([1.5, None, None], None)
    await client.send("subscribe", topic="/image")
    assert (await client.next())["msg"]["data"] == base64.b64encode(b"\xff\0").decode()


async def test_a_client_gets_each_message_once(bridge: Bridge, meeting: Meeting) -> None:
    """However often it subscribes; it ends with the last subscription."""
    node = await meeting.node("talker")
    publisher = node.create_publisher(String, "/chatter", 10)
    client = await bridge.connect()
    for id_ in ("one", "two"):
        await client.send("subscribe", id=id_, topic="/chatter")
    await client.settled()
    await until(lambda: publisher.get_subscription_count() == 1)
    for text in ("a", "b"):
        publisher.publish(String(data=text))
    assert [(await client.next())["msg"]["data"] for _ in range(2)] == ["a", "b"]
    await client.send("unsubscribe", id="one", topic="/chatter")
    await client.settled()
    publisher.publish(String(data="c"))
    assert (await client.next())["msg"]["data"] == "c"
    await client.send("unsubscribe", id="two", topic="/chatter")
    await until(lambda: not publisher.get_subscription_count())


@pytest.mark.parametrize("kind", [None, "std_msgs/String"])
async def test_a_topic_that_does_not_exist_yet(bridge: Bridge, meeting: Meeting, kind: str | None) -> None:
    """Its messages arrive as soon as it does."""
    client = await bridge.connect()
    await client.send("subscribe", topic="/chatter", type=kind)
    await client.settled()
    node = await meeting.node("talker")
    publisher = node.create_publisher(String, "/chatter", 10)
    await until(lambda: publisher.get_subscription_count() == 1)
    publisher.publish(String(data="hello"))
    assert (await client.next())["msg"] == {"data": "hello"}


async def test_a_throttled_topic_shows_its_newest_message(bridge: Bridge, meeting: Meeting) -> None:
    """The first one at once, and later the last one, which rosbridge_suite drops."""
    node = await meeting.node("talker")
    publisher = node.create_publisher(String, "/chatter", 10)
    client = await bridge.connect()
    await client.send("subscribe", topic="/chatter", throttle_rate=200)
    await until(lambda: publisher.get_subscription_count() == 1)
    for text in ("a", "b", "c"):
        publisher.publish(String(data=text))
    await client.until(lambda found: found["msg"] == {"data": "c"})


async def test_a_topic_gets_another_type(bridge: Bridge, meeting: Meeting) -> None:
    """Its messages are decoded as what they are, although the bytes would make sense as the type before."""
    client = await bridge.connect()
    await client.send("subscribe", topic="/thing")
    colors = (await meeting.node("painter")).create_publisher(ColorRGBA, "/thing", 10)
    await until(lambda: colors.get_subscription_count() == 1)
    colors.publish(ColorRGBA(r=1.0))
    assert (await client.next())["msg"]["r"] == 1
    colors.destroy()
    turns = (await meeting.node("turner")).create_publisher(Quaternion, "/thing", 10)

    def types() -> list[str]:
        found = bridge.observer.snapshot.endpoints(EntryKind.PUBLISHER, "/thing")
        return [each.topic_type for each in found]

    await until(lambda: types() == ["geometry_msgs/msg/Quaternion"] and turns.get_subscription_count())
    turns.publish(Quaternion(x=1.0))
    assert (await client.next())["msg"]["x"] == 1

"""What the graph says of endpoints."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.interfaces.std_msgs.msg import String
from actors.ros.rclpy.node import Node
from actors.ros.rclpy.topic_endpoint_info import TopicEndpointInfo, TopicEndpointTypeEnum
from actors.time.types import INFINITE

if TYPE_CHECKING:
    from actors.ros.rclpy.context import Context


def test_publishers_and_subscriptions_are_described(context: Context) -> None:
    """Names, type, hash, kind, number and QoS are those of the endpoint; its QoS can be used again."""
    node = Node("node", namespace="ns", context=context)
    node.create_publisher(String, "t", 7)
    (info,) = node.get_publishers_info_by_topic("t")
    assert (info.node_name, info.node_namespace, info.topic_type) == ("node", "/ns", "std_msgs/msg/String")
    assert str(info.topic_type_hash).startswith("RIHS01_")
    assert info.endpoint_type is TopicEndpointTypeEnum.PUBLISHER
    assert len(info.endpoint_gid) == 16
    assert (info.qos_profile.depth, info.qos_profile.lifespan) == (7, INFINITE)
    node.create_subscription(String, "t", print, info.qos_profile)
    (found,) = node.get_subscriptions_info_by_topic("t")
    assert found.endpoint_type is TopicEndpointTypeEnum.SUBSCRIPTION
    assert found != info
    lines = str(found).splitlines()
    assert [lines[0], lines[4], lines[6], lines[8], lines[10]] == [
        "Node name: node",
        "Endpoint type: SUBSCRIPTION",
        "QoS profile:",
        "  History (Depth): KEEP_LAST (7)",
        "  Lifespan: Infinite",
    ]
    assert len(lines) == 14


def test_an_empty_description_prints() -> None:
    """What is unknown prints as ROS 2 does."""
    lines = str(TopicEndpointInfo()).splitlines()
    assert lines[2:6] == ["Topic type: ", "Topic type hash: INVALID", "Endpoint type: INVALID", "GID: "]
    assert lines[8] == "  History (Depth): UNKNOWN"

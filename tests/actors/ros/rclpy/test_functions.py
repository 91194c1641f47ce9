"""rclpy's functions beside nodes: names, bytes, and one message."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import TYPE_CHECKING, get_origin

import pytest

from actors.interfaces.errors import InvalidMessageError, MessageBudgetError
from actors.interfaces.sensor_msgs.msg import LaserEcho, MultiEchoLaserScan
from actors.interfaces.std_msgs.msg import String
from actors.ros.rclpy import exceptions, qos
from actors.ros.rclpy.client import Client
from actors.ros.rclpy.expand_topic_name import expand_topic_name
from actors.ros.rclpy.node import Node
from actors.ros.rclpy.publisher import Publisher
from actors.ros.rclpy.qos import DurabilityPolicy, QoSPresetProfiles, QoSProfile, ReliabilityPolicy
from actors.ros.rclpy.serialization import deserialize_message, serialize_message
from actors.ros.rclpy.service import Service
from actors.ros.rclpy.topic_or_service_is_hidden import topic_or_service_is_hidden
from actors.ros.rclpy.validate_full_topic_name import validate_full_topic_name
from actors.ros.rclpy.validate_namespace import validate_namespace
from actors.ros.rclpy.validate_node_name import validate_node_name
from actors.ros.rclpy.validate_topic_name import validate_topic_name
from actors.ros.rclpy.wait_for_message import wait_for_message

if TYPE_CHECKING:
    from actors.ros.rclpy.context import Context

DEADLINE_SEC = 20.0


def test_names_are_checked_with_rclpys_errors() -> None:
    """Each function has an error of its own; a valid name gives True."""
    assert validate_topic_name("a/b") is validate_full_topic_name("/a/b") is True
    assert validate_node_name("node") is validate_namespace("/ns") is True
    for check, wrong, error in (
        (partial(validate_topic_name, is_service=True), "a b", exceptions.InvalidServiceNameException),
        (partial(validate_full_topic_name, is_service=True), "a", exceptions.InvalidServiceNameException),
        (validate_topic_name, "a b", exceptions.InvalidTopicNameException),
        (validate_full_topic_name, "a", exceptions.InvalidTopicNameException),
        (
            lambda name: validate_topic_name(name, is_service=True),
            "a b",
            exceptions.InvalidServiceNameException,
        ),
        (
            lambda name: validate_full_topic_name(name, is_service=True),
            "a",
            exceptions.InvalidServiceNameException,
        ),
        (validate_node_name, "a/b", exceptions.InvalidNodeNameException),
        (validate_namespace, "ns", exceptions.InvalidNamespaceException),
    ):
        with pytest.raises(error):
            check(wrong)
    assert expand_topic_name("~/t", "node", "/ns") == "/ns/node/t"
    assert topic_or_service_is_hidden("/a/_b")


def test_messages_become_bytes_and_back() -> None:
    """In CDR. Bytes that are no such message are an error."""
    message = String(data="x")
    assert serialize_message(message) == b"\0\1\0\0\2\0\0\0x\0"
    assert deserialize_message(serialize_message(message), String) == message
    with pytest.raises(InvalidMessageError):
        deserialize_message(b"\0\1\0\0\5\0\0\0x\0", String)


def test_one_message_is_waited_for(context: Context) -> None:
    """The latched one comes at once; without a message the time ends the wait."""
    node = Node("node", namespace="ns", context=context)
    profile = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    node.create_publisher(String, "t", profile).publish(String(data="x"))
    found = wait_for_message(String, node, "t", qos_profile=profile, time_to_wait=DEADLINE_SEC)
    assert found == (True, String(data="x"))
    assert wait_for_message(String, node, "none", time_to_wait=0.01) == (False, None)


def test_a_shutdown_ends_the_wait_for_a_message(context: Context) -> None:
    """It has a subscription by then."""
    node = Node("node", context=context)

    def shut_down() -> None:
        while not node.count_subscribers("none"):
            pass
        context.shutdown()

    with ThreadPoolExecutor() as pool:
        ended = pool.submit(shut_down)
        assert wait_for_message(String, node, "none") == (False, None)
        ended.result(DEADLINE_SEC)


def test_profiles_are_found_by_short_keys() -> None:
    """In any case; an unknown one is an error."""
    assert QoSPresetProfiles.get_from_short_key("Sensor_Data").depth == 5
    with pytest.raises(KeyError):
        QoSPresetProfiles.get_from_short_key("none")


def test_old_names_of_qos_values_are_the_new_values() -> None:
    """Programs from before ROS 2 Foxy use them."""
    assert qos.QoSReliabilityPolicy.RMW_QOS_POLICY_RELIABILITY_BEST_EFFORT is ReliabilityPolicy.BEST_EFFORT  # type: ignore[attr-defined]
    assert qos.QoSDurabilityPolicy.RMW_QOS_POLICY_DURABILITY_VOLATILE is DurabilityPolicy.VOLATILE  # type: ignore[attr-defined]
    assert qos.QoSLivelinessPolicy.RMW_QOS_POLICY_DURABILITY_UNKNOWN is qos.LivelinessPolicy.UNKNOWN  # type: ignore[attr-defined]
    assert len(ReliabilityPolicy) == len(set(ReliabilityPolicy.__members__))
    assert qos.qos_policy_name_from_kind(qos.QoSPolicyKind.DURABILITY) == "DURABILITY"


def test_numbers_assigned_to_a_profile_become_policies() -> None:
    """As those given to the constructor do; a wrong one is an error at once."""
    profile = QoSProfile(depth=1)
    profile.reliability = 2  # type: ignore[assignment]
    assert profile.reliability is ReliabilityPolicy.BEST_EFFORT
    with pytest.raises(ValueError, match="9"):
        profile.durability = 9  # type: ignore[assignment]


def test_annotations_are_those_of_rclpy() -> None:
    """They are evaluated where a class or a function is defined."""
    made = (Client[int, int, int], Service[int, int, int], Publisher[String])
    assert [get_origin(each) for each in made] == [Client, Service, Publisher]


def test_bytes_that_would_take_too_much_memory_are_an_error() -> None:
    """Case 62: as at a subscription."""
    data = serialize_message(MultiEchoLaserScan(ranges=[LaserEcho()] * 200_000))
    with pytest.raises(MessageBudgetError, match="too many small elements"):
        deserialize_message(data, MultiEchoLaserScan)

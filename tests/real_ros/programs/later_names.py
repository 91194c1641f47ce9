"""What rclpy 9 has beside rclpy 8's names."""

from __future__ import annotations

import rclpy.exceptions
from rclpy.action import ActionClient, ActionServer
from rclpy.executors import SingleThreadedExecutor
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile, qos_profile_rosout_default, qos_profile_system_default
from rclpy.service_introspection import ServiceIntrospectionState
from rclpy.subscription_content_filter_options import ContentFilterOptions
from rclpy.task import Future
from std_msgs.msg import Int32
from std_srvs.srv import Trigger
from test_msgs.action import Fibonacci

from tests.real_ros.programs.errors import error_names, outcome
from tests.real_ros.programs.running import running_node, spin_until


def done_callbacks_that_are_removed():
    """Remove done callbacks of futures."""
    future, called = Future(), []

    def one(each):
        called.append("one")

    def two(each):
        called.append("two")

    future.add_done_callback(one)
    future.add_done_callback(two)
    removed = [future.remove_done_callback(one), future.remove_done_callback(one)]
    future.set_result(1)
    return [removed, future.remove_done_callback(two), called]


def futures_of_executors():
    """Make a future of an executor: it runs the callbacks."""
    with running_node() as node:
        executor, called = SingleThreadedExecutor(context=node.context), []
        future = executor.create_future()
        future.add_done_callback(lambda each: called.append(each.result()))
        future.set_result(3)
        before = [*called]
        executor.spin_once(timeout_sec=1.0)
        return [before, called, isinstance(future, Future)]


def timer_errors():
    """Look at the error of timers that are cancelled."""
    return error_names(rclpy.exceptions.TimerCancelledError("x"))


def logger_names():
    """Ask entities for the name of their node's logger."""
    with running_node(namespace="/a/b") as node:
        entities = (
            node.create_publisher(Int32, "t", 1),
            node.create_subscription(Int32, "t", print, 1),
            node.create_client(Trigger, "s"),
            node.create_service(Trigger, "s", print),
        )
        names = [each.logger_name for each in entities]
        for each in entities:
            each.destroy()
        return [names, [outcome(lambda: each.logger_name) for each in entities]]  # noqa: B023


def events_executor():
    """Run callbacks by an EventsExecutor."""
    with running_node() as node:
        executor, received = EventsExecutor(context=node.context), []
        executor.add_node(node)
        publisher = node.create_publisher(Int32, "t", 10)
        done = executor.create_future()

        def keep(message):
            received.append(message.data)
            if len(received) == 3:
                done.set_result(True)

        node.create_subscription(Int32, "t", keep, 10)
        for _ in range(1000):
            if publisher.get_subscription_count() == 1:
                break
            executor.spin_once(timeout_sec=0.01)
        for number in range(3):
            publisher.publish(Int32(data=number))
        executor.spin_until_future_complete(done, timeout_sec=10.0)
        result = [received, executor.get_nodes() == [node], executor.context is node.context]
        executor.remove_node(node)
        return [*result, executor.shutdown()]


def no_content_filter():
    """Ask a subscription without a content filter for it."""
    with running_node() as node:
        subscription = node.create_subscription(Int32, "t", print, 1)
        options = ContentFilterOptions("data > %0", ["3"])
        return [
            subscription.is_cft_enabled,
            options.filter_expression,
            options.expression_parameters,
            options == ContentFilterOptions(filter_expression="data > %0", expression_parameters=["3"]),
        ]


def content_filter():
    """Give a subscription a content filter."""
    with running_node() as node:
        subscription = node.create_subscription(
            Int32, "t", print, 1, content_filter_options=ContentFilterOptions("data > %0", ["3"])
        )
        return [
            subscription.is_cft_enabled,
            outcome(lambda: subscription.get_content_filter().filter_expression),
            outcome(lambda: subscription.set_content_filter("data > %0", ["4"])),
        ]


def rosout_profiles():
    """Make nodes with other QoS for the log."""
    with running_node() as node:

        def profile(name, qos):
            other = Node(name, context=node.context, rosout_qos_profile=qos)

            def found():
                infos = node.get_publishers_info_by_topic("/rosout")
                return [each.qos_profile for each in infos if each.node_name == name]

            spin_until(node, found)
            policies = [found()[0].reliability.name, found()[0].durability.name]
            other.destroy_node()
            return policies

        profiles = {"preset": qos_profile_rosout_default, "depth": 5, "profile": QoSProfile(depth=3)}
        return [profile(f"rosout_{name}", qos) for name, qos in profiles.items()]


def wrong_rosout_profile():
    """Make a node with what is no profile for the log."""
    with running_node() as node:
        return [outcome(Node, "x", context=node.context, rosout_qos_profile=each) for each in ("a", -1)]


def numbers_of_publishers():
    """Look at the publisher in the info of a message."""
    with running_node() as node:
        received = []
        publishers = [node.create_publisher(Int32, "t", 10) for _ in range(2)]
        node.create_subscription(Int32, "t", lambda message, info: received.append((message.data, info)), 10)
        spin_until(node, lambda: all(each.get_subscription_count() == 1 for each in publishers))
        for each in (0, 1, 0):
            publishers[each].publish(Int32(data=each))
            spin_until(node, lambda: len(received) > 0 and received[-1][0] == each)  # noqa: B023
        gids = [info["publisher_gid"] for _, info in received]
        return [gids[0] == gids[-1], gids[0] == gids[1], sorted(gids[0]), len(gids[0]["data"])]


def introspection_of_actions():
    """Publish events of the services of an action."""
    with running_node() as node:
        client, server = ActionClient(node, Fibonacci, "count"), ActionServer(node, Fibonacci, "count", print)
        names = [
            f"/count/_action/{each}/_service_event" for each in ("send_goal", "cancel_goal", "get_result")
        ]
        for each in (client, server):
            each.configure_introspection(
                node.get_clock(), qos_profile_system_default, ServiceIntrospectionState.METADATA
            )
        spin_until(node, lambda: all(node.count_publishers(name) == 2 for name in names))
        server.configure_introspection(
            node.get_clock(), qos_profile_system_default, ServiceIntrospectionState.OFF
        )
        spin_until(node, lambda: all(node.count_publishers(name) == 1 for name in names))
        return [node.count_publishers(name) for name in names]

"""Parts of rclpy that are private, or seem to be, and that programs use."""

from __future__ import annotations

from rclpy import client, node, publisher, service, subscription
from rclpy.action import ActionClient, ActionServer
from rclpy.executors import SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.qos import QoSProfile
from rclpy.task import Future
from std_msgs.msg import String
from std_srvs.srv import Trigger
from test_msgs.action import Fibonacci

from tests.real_ros.programs.errors import outcome
from tests.real_ros.programs.running import running_node, spin_until


class _Delegate:
    """Stands for a node, as ros2cli's `NodeStrategy` does."""

    def __init__(self, node):
        self.node = node

    def __getattr__(self, name):
        return getattr(self.node, name)


def results_of_goals():
    """Look at the responses with results of goals."""
    with running_node() as node:

        def execute(goal):
            goal.succeed()
            return Fibonacci.Result(sequence=[goal.request.order])

        executor = SingleThreadedExecutor(context=node.context)  # one, whose tasks execute the goal
        executor.add_node(node)
        ActionServer(node, Fibonacci, "count", execute)
        client = ActionClient(node, Fibonacci, "count")
        client.wait_for_server(timeout_sec=5.0)
        sent = client.send_goal_async(Fibonacci.Goal(order=3))
        executor.spin_until_future_complete(sent, timeout_sec=10.0)
        handle = sent.result()
        answers = []
        for ask in (handle.get_result_async, lambda: client._get_result_async(handle)):  # noqa: SLF001
            future = ask()
            executor.spin_until_future_complete(future, timeout_sec=10.0)
            answers.append(future.result())
        response = answers[0]
        return [
            [
                isinstance(each, Fibonacci.Impl.GetResultService.Response),
                type(each).__name__,
                each.get_fields_and_field_types(),
                each.status,
                list(each.result.sequence),
            ]
            for each in answers
        ] + [hasattr(response, "_fields"), outcome(lambda: [*response])]


def delegates():
    """Spin an object that delegates to a node."""
    with running_node() as node:
        delegate, executor = _Delegate(node), SingleThreadedExecutor(context=node.context)
        future = Future()
        node.create_timer(0.001, lambda: future.set_result(1))
        added = executor.add_node(delegate)
        executor.spin_until_future_complete(future, timeout_sec=5.0)
        nodes = executor.get_nodes()
        delegate.node = None  # `ros2 service echo` has one that raises once the context has ended
        executor.remove_node(delegate)
        return [added, future.done(), [each is delegate for each in nodes], executor.get_nodes()]


def clients_of_delegates():
    """Call a service of a node by an object that delegates to it."""
    with running_node() as node:
        delegate, executor = _Delegate(node), SingleThreadedExecutor(context=node.context)
        delegate.create_service(Trigger, "s", lambda request, response: response)
        client = delegate.create_client(Trigger, "s")
        client.wait_for_service(timeout_sec=5.0)
        executor.add_node(delegate)
        future = client.call_async(Trigger.Request())
        executor.spin_until_future_complete(future, timeout_sec=5.0)
        return future.done()


def executors_of_nodes():
    """Ask a node for its executor."""
    with running_node() as node:
        first, second = (SingleThreadedExecutor(context=node.context) for _ in range(2))
        steps = [node.executor is None]
        first.add_node(node)
        steps.append(node.executor is first)
        first.remove_node(node)
        steps += [node.executor is first, first.get_nodes() == []]
        first.add_node(node)
        second.add_node(node)
        steps += [node.executor is second, first.get_nodes() == [], second.get_nodes() == [node]]
        node.executor = None
        steps += [node.executor is None, second.get_nodes() == []]
        node.executor = second
        steps += [node.executor is second, second.get_nodes() == [node]]
        return steps


def executor_that_does_not_run_a_node():
    """Remove a node: its executor runs its callbacks no more."""
    with running_node() as node:
        executor, ticks = SingleThreadedExecutor(context=node.context), []
        node.create_timer(0.001, lambda: ticks.append(1))
        executor.add_node(node)
        executor.spin_once(timeout_sec=1.0)
        executor.remove_node(node)
        before = len(ticks)
        executor.spin_once(timeout_sec=0.02)
        return [before, len(ticks), node.executor is executor]


def destroyed_node():
    """Use a node that has been destroyed."""
    with running_node() as node:
        publisher = node.create_publisher(String, "t", 1)
        node.destroy_node()
        uses = {
            "get_name": node.get_name,
            "get_namespace": node.get_namespace,
            "get_fully_qualified_name": node.get_fully_qualified_name,
            "get_logger": lambda: node.get_logger().name,
            "get_clock": lambda: node.get_clock() is None,
            "resolve_topic_name": lambda: node.resolve_topic_name("t"),
            "resolve_service_name": lambda: node.resolve_service_name("s"),
            "create_publisher": lambda: node.create_publisher(String, "t", 1),
            "create_subscription": lambda: node.create_subscription(String, "t", print, 1),
            "create_client": lambda: node.create_client(Trigger, "s"),
            "create_service": lambda: node.create_service(Trigger, "s", print),
            "create_timer": lambda: node.create_timer(1.0, print) is None,
            "create_guard_condition": lambda: node.create_guard_condition(print) is None,
            "count_publishers": lambda: node.count_publishers("t"),
            "count_subscribers": lambda: node.count_subscribers("t"),
            "count_clients": lambda: node.count_clients("t"),
            "count_services": lambda: node.count_services("t"),
            "get_node_names": node.get_node_names,
            "get_node_names_and_namespaces": node.get_node_names_and_namespaces,
            "get_topic_names_and_types": node.get_topic_names_and_types,
            "get_service_names_and_types": node.get_service_names_and_types,
            "get_publishers_info_by_topic": lambda: node.get_publishers_info_by_topic("t"),
            "get_subscriptions_info_by_topic": lambda: node.get_subscriptions_info_by_topic("t"),
            "get_publisher_names_and_types_by_node": lambda: node.get_publisher_names_and_types_by_node(
                "p", "/"
            ),
            "declare_parameter": lambda: node.declare_parameter("a", 1).value,
            "get_parameter": lambda: node.get_parameter("use_sim_time").value,
            "handle": lambda: node.handle is None,
            "publish": lambda: publisher.publish(String()),
            "destroy_node": node.destroy_node,
            "ActionClient": lambda: ActionClient(node, Fibonacci, "count"),
            "publishers": lambda: len([*node.publishers]),
            "destroy_publisher": lambda: node.destroy_publisher(publisher),
        }
        return {name: outcome(use) for name, use in uses.items()}


def destroyed_entities():
    """Use entities that have been destroyed."""
    with running_node() as node:
        subscription = node.create_subscription(String, "t", print, 1)
        publisher = node.create_publisher(String, "t", 1)
        client = node.create_client(Trigger, "s")
        service = node.create_service(Trigger, "s", print)
        timer = node.create_timer(1.0, print)
        guard = node.create_guard_condition(print)
        for each in (subscription, publisher, client, service, timer, guard):
            each.destroy()
        uses = {
            "get_subscription_count": publisher.get_subscription_count,
            "topic_name": lambda: publisher.topic_name,
            "assert_liveliness": publisher.assert_liveliness,
            "wait_for_all_acked": publisher.wait_for_all_acked,
            "publish": lambda: publisher.publish(String()),
            "get_publisher_count": subscription.get_publisher_count,
            "subscription topic_name": lambda: subscription.topic_name,
            "service_is_ready": client.service_is_ready,
            "wait_for_service": lambda: client.wait_for_service(timeout_sec=0.0),
            "client service_name": lambda: client.service_name,
            "service_name": lambda: service.service_name,
            "is_ready": timer.is_ready,
            "cancel": timer.cancel,
            "reset": timer.reset,
            "is_canceled": timer.is_canceled,
            "timer_period_ns": lambda: timer.timer_period_ns,
            "time_since_last_call": lambda: timer.time_since_last_call() >= 0,
            "trigger": guard.trigger,
            "twice": [
                outcome(each.destroy) for each in (subscription, publisher, client, service, timer, guard)
            ],
        }
        return {name: outcome(use) if callable(use) else use for name, use in uses.items()}


def slots_of_profiles():
    """List the policies of a profile."""
    return [each.lstrip("_") for each in QoSProfile.__slots__]


def fields_by_slots():
    """Read a profile by its slots."""
    profile = QoSProfile(depth=3)
    return [str(getattr(profile, each)) for each in QoSProfile.__slots__][:4]


def sent_responses():
    """Look at the responses that a service sends."""
    with running_node() as node:

        def handle(request, response):
            response.message = "x"
            return response

        service = node.create_service(Trigger, "s", handle)
        send, sent = service.send_response, []

        def send_response(response, header):
            sent.append(response.message)
            send(response, header)

        service.send_response = send_response
        client = node.create_client(Trigger, "s")
        client.wait_for_service(timeout_sec=5.0)
        future = client.call_async(Trigger.Request())
        spin_until(node, future.done)
        return [sent, future.result().message]


def implementation():
    """Import the module of C."""
    names = ("RCLError", "InvalidHandle", "UnknownROSArgsError", "NodeNameNonExistentError")
    return [issubclass(getattr(rclpy_implementation, each), Exception) for each in names]


def type_variables():
    """Import the older names of type variables, as programs do for annotations."""
    names = ("MsgType", "SrvType", "SrvTypeRequest", "SrvTypeResponse")
    modules = (client, node, publisher, service, subscription)
    return {each.__name__.split(".")[-1]: [name for name in names if hasattr(each, name)] for each in modules}

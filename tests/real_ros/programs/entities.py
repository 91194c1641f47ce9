"""Publishers, subscriptions, services, timers and what the graph says of them."""

from __future__ import annotations

import asyncio
import gc

from rclpy.action import ActionClient, ActionServer
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.context import Context
from rclpy.event_handler import QoSPublisherEventType, QoSSubscriptionEventType
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import deserialize_message, serialize_message
from rclpy.task import Future
from rclpy.type_support import check_for_type_support
from std_msgs.msg import Int32, String
from std_srvs.srv import SetBool, Trigger
from test_msgs.action import Fibonacci

from tests.real_ros.programs.errors import outcome
from tests.real_ros.programs.running import running_node, spin_until


def messages_in_order():
    """Publish to the own subscription."""
    with running_node() as node:
        received = []
        node.create_subscription(Int32, "t", lambda message: received.append(message.data), 10)
        publisher = node.create_publisher(Int32, "t", 10)
        spin_until(node, lambda: publisher.get_subscription_count() == 1)
        for number in range(5):
            publisher.publish(Int32(data=number))
        spin_until(node, lambda: len(received) == 5)
        return received


def arguments_of_callbacks():
    """Receive with callbacks that take one argument, two, or either."""
    with running_node() as node:
        received = {}

        def keep(name, *arguments):
            received[name] = [type(each).__name__ for each in arguments]

        callbacks = {
            "one": lambda message: keep("one", message),
            "two": lambda message, info: keep("two", message, info),
            "a default": lambda message, seen=7: keep("a default", message, seen),
            "any": lambda *arguments: keep("any", *arguments),
            "two defaults": lambda message=1, seen=7: keep("two defaults", message, seen),
            "a keyword": lambda message, *, seen=7: keep("a keyword", message, seen),
        }
        publisher = node.create_publisher(Int32, "t", 10)
        for callback in callbacks.values():
            node.create_subscription(Int32, "t", callback, 10)
        spin_until(node, lambda: publisher.get_subscription_count() == len(callbacks))
        publisher.publish(Int32(data=1))
        spin_until(node, lambda: len(received) == len(callbacks))
        return received


def wrong_messages():
    """Publish what is no message of the type."""
    with running_node() as node:
        publisher = node.create_publisher(String, "t", 1)
        return [outcome(publisher.publish, each) for each in (Int32(), "text", None, String, {"data": "x"})]


def wrong_arguments():
    """Make entities of wrong arguments."""
    with running_node() as node:
        makers = (
            lambda: node.create_publisher(String, "t", -1),
            lambda: node.create_publisher(String, "t", "1"),
            lambda: node.create_subscription(String, "t", None, 1),
            lambda: node.create_subscription(String, "t", lambda: None, 1),
            lambda: node.create_subscription(String, "t", lambda a, b, c: None, 1),
            lambda: node.create_timer("1", print),
        )
        return [outcome(lambda: make() is None) for make in makers]  # noqa: B023


def wrong_types():
    """Make entities of what is no message or service."""
    with running_node() as node:
        return [
            outcome(node.create_publisher, int, "t", 1),
            outcome(node.create_publisher, SetBool, "t", 1),
            outcome(node.create_service, String, "s", print),
            outcome(node.create_client, String, "s"),
        ]


def call():
    """Call the own service."""
    with running_node() as node:

        def handle(request, response):
            response.success, response.message = not request.data, "turned"
            return response

        node.create_service(SetBool, "s", handle)
        client = node.create_client(SetBool, "s")
        ready = client.wait_for_service(timeout_sec=5.0)
        future = client.call_async(SetBool.Request(data=True))
        spin_until(node, future.done)
        return [ready, future.result().success, future.result().message, future.exception() is None]


def matches_at_once():
    """Look what is matched when it has just been made, or destroyed, in one process."""
    seen = []
    with running_node() as node:
        other = Node("other", context=node.context)
        for here, there in ((node, node), (node, other), (other, node)):
            client, publisher = here.create_client(Trigger, "s"), here.create_publisher(Int32, "t", 10)
            service = there.create_service(Trigger, "s", lambda request, response: response)
            subscription = there.create_subscription(Int32, "t", lambda message: None, 10)

            def look(client=client, publisher=publisher, subscription=subscription):
                return [
                    client.service_is_ready(),
                    client.wait_for_service(timeout_sec=0.0),
                    publisher.get_subscription_count(),
                    subscription.get_publisher_count(),
                ]

            seen.append(look())
            there.destroy_service(service)
            seen.append(look())
            here.destroy_client(client)
            here.destroy_publisher(publisher)
            seen.append(subscription.get_publisher_count())
            there.destroy_subscription(subscription)
        action = ActionClient(node, Fibonacci, "a")
        server = ActionServer(other, Fibonacci, "a", lambda goal: Fibonacci.Result())
        seen += [action.server_is_ready(), action.wait_for_server(timeout_sec=0.0)]
        server.destroy()
        seen.append(action.server_is_ready())
        action.destroy()
        other.destroy_node()
    return seen


def no_server():
    """Wait for a service that is not there."""
    with running_node() as node:
        client = node.create_client(Trigger, "nobody")
        return [client.wait_for_service(timeout_sec=0.05), client.service_is_ready()]


def wrong_requests():
    """Call with what is no request."""
    with running_node() as node:
        client = node.create_client(SetBool, "s")
        return [outcome(client.call_async, each) for each in (SetBool.Response(), None, SetBool)]


def graph():
    """Ask for names and types of a node's endpoints."""
    with running_node(namespace="/ns") as node:
        node.create_publisher(String, "out", 1)
        node.create_subscription(Int32, "in", print, 1)
        node.create_service(Trigger, "~/go", print)
        spin_until(node, lambda: node.count_publishers("out") == 1 and node.count_subscribers("in") == 1)
        publishers = dict(node.get_publisher_names_and_types_by_node("probe", "/ns"))
        subscriptions = dict(node.get_subscriber_names_and_types_by_node("probe", "/ns"))
        services = dict(node.get_service_names_and_types_by_node("probe", "/ns"))
        info = node.get_publishers_info_by_topic("out")[0]
        return [
            publishers["/ns/out"],
            subscriptions["/ns/in"],
            services["/ns/probe/go"],
            [info.node_name, info.node_namespace, info.topic_type, info.endpoint_type.name],
            str(info.topic_type_hash),
            outcome(node.get_publisher_names_and_types_by_node, "nobody", "/"),
            node.count_publishers("nothing"),
        ]


def services_of_a_node():
    """List the services that a node has by itself."""
    with running_node() as node:
        spin_until(node, lambda: node.get_service_names_and_types_by_node("probe", "/"))
        return sorted(name for name, _ in node.get_service_names_and_types_by_node("probe", "/"))


def timers():
    """Run, cancel and reset a timer."""
    with running_node() as node:
        ticks = []
        timer = node.create_timer(0.01, lambda: ticks.append(1))
        spin_until(node, lambda: len(ticks) >= 3)
        timer.cancel()
        cancelled = timer.is_canceled()
        timer.reset()
        return [
            timer.timer_period_ns,
            cancelled,
            timer.is_canceled(),
            node.destroy_timer(timer),
            len([*node.timers]),
        ]


def odd_periods():
    """Make timers of odd periods."""
    with running_node() as node:
        return [outcome(_period, node, each) for each in (0, 0.0, -1, 1e-9, 1)]


def _period(node, sec):
    return node.create_timer(sec, print).timer_period_ns


def destroyed():
    """Use what has been destroyed."""
    with running_node() as node:
        publisher, client = node.create_publisher(String, "t", 1), node.create_client(Trigger, "s")
        results = [
            node.destroy_publisher(publisher),
            node.destroy_publisher(publisher),
            node.destroy_client(client),
        ]
        return [*results, outcome(publisher.publish, String()), outcome(client.call_async, Trigger.Request())]


def entities_of_a_node():
    """List what a node has."""
    with running_node(start_parameter_services=False, enable_rosout=False) as node:
        node.create_publisher(String, "t", 1)
        node.create_subscription(String, "t", print, 1)
        node.create_client(Trigger, "s")
        node.create_guard_condition(print)
        kinds = (node.subscriptions, node.clients, node.timers, node.guards)
        return [len([*each]) for each in kinds]


def contexts():
    """Begin and end contexts in a wrong order."""
    context = Context()
    before = [context.ok(), outcome(Node, "early", context=context), outcome(context.shutdown)]
    context.init([])
    return [
        before,
        context.ok(),
        outcome(context.init, []),
        outcome(context.shutdown),
        context.ok(),
        outcome(context.shutdown),
        outcome(context.try_shutdown),
        outcome(Node, "late", context=context),
    ]


def futures():
    """Finish, cancel and ask futures."""
    done, failed, cancelled, called = Future(), Future(), Future(), []
    done.add_done_callback(lambda each: called.append(each.result()))
    done.set_result(1)
    failed.set_exception(ValueError("x"))
    cancelled.cancel()
    return [
        [done.done(), done.cancelled(), done.result(), done.exception() is None],
        [failed.done(), failed.cancelled(), outcome(failed.result)],
        [cancelled.cancelled(), cancelled.result()],
        [Future().done(), Future().result()],
        bool(done),
        bool(Future()),
    ]


def cancelled_future():
    """Ask a cancelled future whether it is done."""
    future = Future()
    future.cancel()
    return future.done()


def executors():
    """Add, remove and ask an executor."""
    with running_node() as node:
        executor = SingleThreadedExecutor(context=node.context)
        results = [executor.add_node(node), executor.add_node(node), len(executor.get_nodes())]
        task = executor.create_task(lambda: 5)
        executor.spin_until_future_complete(task, timeout_sec=5.0)
        never = Future()
        executor.spin_until_future_complete(never, timeout_sec=0.01)
        executor.remove_node(node)
        return [*results, task.result(), never.done(), len(executor.get_nodes()), executor.shutdown()]


def groups():
    """Ask callback groups."""
    with running_node() as node:
        group = MutuallyExclusiveCallbackGroup()
        timer = node.create_timer(10.0, print, callback_group=group)
        default = type(node.default_callback_group).__name__
        return [
            default,
            group.has_entity(timer),
            ReentrantCallbackGroup().has_entity(timer),
            timer.callback_group is group,
        ]


def raising_callback():
    """Let a callback raise."""
    with running_node() as node:

        def fail():
            raise ZeroDivisionError

        node.create_timer(0.01, fail)
        return outcome(spin_until, node, lambda: False)


def services_of_clients_and_servers():
    """List the services of a node with a client and a server."""
    with running_node() as node:
        node.create_client(Trigger, "asked")
        node.create_service(SetBool, "served", lambda request, response: response)
        own = {f"{node.get_namespace().rstrip('/')}/{name}" for name in ("asked", "served")}

        def listed():
            return sorted(each for each in node.get_service_names_and_types() if each[0] in own)

        spin_until(node, lambda: len(listed()) == 2)
        return listed()


def node_without_references():
    """Forget a node: it leaves the graph."""
    with running_node() as node:
        other = Node("other", context=node.context)
        publisher = other.create_publisher(String, "t", 1)
        spin_until(node, lambda: "other" in node.get_node_names())
        del other, publisher
        spin_until(node, lambda: "other" not in node.get_node_names())
        return "other" in node.get_node_names()


class _Referring(Node):
    """A node whose callbacks are methods of its own."""

    def __init__(self, context):
        super().__init__("referring", context=context)
        self.kept = [
            self.create_subscription(String, "t", self.called, 1),
            self.create_service(SetBool, "served", self.called),
            self.create_client(SetBool, "served"),
            self.create_timer(60.0, self.called),
            self.create_guard_condition(self.called),
            ActionServer(self, Fibonacci, "fibonacci", self.called, goal_callback=self.called),
            ActionClient(self, Fibonacci, "fibonacci"),
            self.add_on_set_parameters_callback(self.called),
        ]

    def called(self, *arguments):
        """Never called."""


def node_that_its_callbacks_refer_to():
    """Forget such a node: it leaves the graph when garbage is collected."""
    with running_node() as node:
        other = _Referring(node.context)
        spin_until(node, lambda: "referring" in node.get_node_names())
        del other
        gc.collect()
        spin_until(node, lambda: "referring" not in node.get_node_names())
        return "referring" in node.get_node_names()


def node_with_a_publisher_that_is_kept():
    """Forget a node, and keep its publisher."""
    with running_node() as node:
        received = []
        node.create_subscription(String, "t", lambda message: received.append(message.data), 1)
        publisher = Node("other", context=node.context).create_publisher(String, "t", 1)
        spin_until(node, lambda: publisher.get_subscription_count() == 1)
        publisher.publish(String(data="x"))
        spin_until(node, lambda: received)
        return [received, "other" in node.get_node_names()]


def steps_of_coroutines_in_short_spins():
    """Spin a coroutine that awaits no future with a timeout of zero."""
    with running_node() as node:
        executor, steps = SingleThreadedExecutor(context=node.context), []
        executor.add_node(node)

        async def work():
            for each in range(3):
                steps.append(each)
                await asyncio.sleep(0)

        task = executor.create_task(work)
        seen = []
        while not task.done() and len(seen) < 20:
            executor.spin_once(timeout_sec=0)
            seen.append(len(steps))
        return [*dict.fromkeys(seen)]  # rclpy has spins between them that do nothing


def wrong_arguments_of_a_node():
    """Give a node arguments that are unknown or incomplete."""
    with running_node() as node:
        wrong = (["unknown"], ["--my-flag"], ["-r", "no_rule"], ["-p", "no_rule"], ["--log-level", "loud"])
        return [
            outcome(Node, "x", context=node.context, cli_args=["--ros-args", *each]) for each in wrong
        ] + [outcome(Context().init, ["--ros-args", *each]) for each in wrong]


def numbers_of_events():
    """List the kinds of events."""
    return [
        {name: int(each) for name, each in kinds.__members__.items()}
        for kinds in (QoSPublisherEventType, QoSSubscriptionEventType)
    ]


def classes_without_type_support():
    """Check what is no class of ROS 2's."""
    return [outcome(check_for_type_support, each) for each in (object(), object, int, 5, None)]


def bytes_of_messages():
    """Send a message as bytes, and receive it as bytes and as a message."""
    with running_node() as node:
        raw, typed = [], []
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        publisher = node.create_publisher(String, "t", latched)
        node.create_subscription(String, "t", raw.append, latched, raw=True)
        node.create_subscription(String, "t", typed.append, latched)
        data = serialize_message(String(data="a"))
        publisher.publish(data)
        spin_until(node, lambda: raw and typed)
        received = deserialize_message(raw[0], String).data
        names = [type(each).__name__ for each in (data, raw[0])]
        return [*names, received, typed[0].data, outcome(publisher.publish, "a")]


def servers_of_a_node_without_references():
    """Keep only a client of a node: what it served and heard is gone."""
    with running_node() as node:
        other = Node("other", context=node.context)
        client = other.create_client(Trigger, "asked")
        other.create_service(Trigger, "served", lambda request, response: response)
        other.create_subscription(String, "heard", print, 1)
        ActionServer(other, Fibonacci, "worked", print)
        counts = (
            lambda: node.count_clients("asked"),
            lambda: node.count_services("served"),
            lambda: node.count_subscribers("heard"),
            lambda: node.count_services("other/get_parameters"),
            lambda: node.count_services("worked/_action/send_goal"),
        )
        spin_until(node, lambda: all(each() for each in counts))
        del other
        gc.collect()
        spin_until(node, lambda: sum(each() for each in counts) == 1)
        return [*(each() for each in counts), client.service_name]


def topics_of_two_types():
    """Give a topic a second type: in the context, in another one, and after the first is gone."""
    with running_node() as node, running_node(name="elsewhere") as elsewhere:
        publisher = node.create_publisher(String, "t", 1)

        def other(owner):
            return [
                type(outcome(owner.create_publisher, Int32, "t", 1)).__name__,
                type(outcome(owner.create_subscription, Int32, "t", print, 1)).__name__,
            ]

        answers = [other(node), other(Node("second", context=node.context)), other(elsewhere)]
        answers.append(outcome(node.create_publisher, Int32, "t", 1))
        subscription = node.create_subscription(String, "t", print, 1)
        node.destroy_publisher(publisher)
        answers.append(other(node))
        node.destroy_subscription(subscription)
        return [*answers, other(node)]

"""Nodes that tests make, use and end, all in one process.

Entities have numbers, and messages are CDR as hexadecimal digits. Callbacks run in a thread; what changes
nodes runs there, too, as rclpy's executor does not expect others to change them. Functions that wait return
what there is when it is what they wait for, or when their time is over.
"""

from __future__ import annotations

import faulthandler
import itertools
import os
import signal
import sys
import threading
import time

import rclpy
from action_msgs.msg import GoalInfo
from action_msgs.srv import CancelGoal
from rclpy.action import ActionClient, ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.lifecycle import LifecycleNode
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, HistoryPolicy, LivelinessPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import String

from tests.real_ros.programs.serialization import find_class

POLL_SEC = 0.005
DO_SEC = 50
"""Less than a side has for its answer."""
_made = {}
_numbers = itertools.count(1)
_thread = None


class _Thread:
    """Runs callbacks, and what `do` is given."""

    def __init__(self):
        rclpy.init()
        self.executor = SingleThreadedExecutor()
        threading.Thread(target=self.executor.spin, daemon=True).start()

    def do(self, function):
        done = threading.Event()
        task = self.executor.create_task(function)
        task.add_done_callback(lambda _: done.set())
        if not done.wait(DO_SEC):
            faulthandler.dump_traceback(file=sys.stderr)
            raise TimeoutError("the thread of the callbacks is blocked: see stderr")
        return task.result()


def _do(function):
    """Run a function in the thread of the callbacks; return what it returns."""
    global _thread  # noqa: PLW0603 - the process has one, from the first node on
    _thread = _thread or _Thread()
    return _thread.do(function)


def _keep(entity):
    number = next(_numbers)
    _made[number] = entity
    return number


def _nodes():
    return [each for each in _made.values() if isinstance(each, rclpy.node.Node)]


def _end(number):
    """End a publisher, subscription or service by its node, which would give it to the executor otherwise."""
    entity = _made.pop(number).entity
    destroy = f"destroy_{type(entity).__name__.lower()}"
    assert _do(lambda: any(getattr(each, destroy)(entity) for each in _nodes()))


def _until(condition, seconds):
    """Wait for a condition; return what it gave at last."""
    end = time.monotonic() + seconds
    while not (found := condition()) and time.monotonic() < end:
        time.sleep(POLL_SEC)
    return found


def _bytes_of(message):
    return bytes(serialize_message(message)).hex()


def _message(cls, data):
    return deserialize_message(bytes.fromhex(data), cls)


def _profile(qos):
    """Return the profile that `ros.py` has taken apart."""
    return QoSProfile(
        history=HistoryPolicy[qos["history"]],
        depth=qos["depth"],
        reliability=ReliabilityPolicy[qos["reliability"]],
        durability=DurabilityPolicy[qos["durability"]],
        liveliness=LivelinessPolicy[qos["liveliness"]],
        **{
            name: Duration(nanoseconds=qos[name])
            for name in ("deadline", "lifespan", "liveliness_lease_duration")
            if name in qos
        },
    )


def make_node(name, namespace="/", parameters=None):
    """Make a node; return its number."""
    overrides = [Parameter(key, value=value) for key, value in (parameters or {}).items()]

    def make():
        node = rclpy.create_node(name, namespace=namespace, parameter_overrides=overrides)
        for each in overrides:
            if not node.has_parameter(each.name):  # every node has some
                node.declare_parameter(each.name, each.value)
        _thread.executor.add_node(node)
        return node

    return _keep(_do(make))


def make_plain_nodes(prefix, count):
    """Make nodes without services and log lines, which no executor knows; a number follows the prefix."""

    def make():
        return [
            rclpy.create_node(
                f"{prefix}{number}",
                start_parameter_services=False,
                enable_rosout=False,
                parameter_overrides=[Parameter("start_type_description_service", value=False)],
            )
            for number in range(count)
        ]

    for each in _do(make):
        _keep(each)


def make_lifecycle_node(name):
    """Make a lifecycle node; return its number."""

    def make():
        node = LifecycleNode(name)
        _thread.executor.add_node(node)
        return node

    return _keep(_do(make))


def destroy_node(number):
    """End a node with all that it has."""
    node = _made.pop(number)
    _do(lambda: (_thread.executor.remove_node(node), node.destroy_node()))


class _Publisher:
    def __init__(self, node, topic, cls, qos):
        self.cls = cls
        self.entity = node.create_publisher(cls, topic, _profile(qos))


def make_publisher(node, topic, type_name, qos):
    """Make a publisher; return its number."""
    return _keep(_do(lambda: _Publisher(_made[node], topic, find_class(type_name), qos)))


def publish(number, messages, raw=False):
    """Publish messages, one after the other; `raw` as the bytes that are given."""
    publisher = _made[number]

    def send():
        for each in messages:
            publisher.entity.publish(bytes.fromhex(each) if raw else _message(publisher.cls, each))

    _do(send)


def acknowledged(number, seconds):
    """Wait until the reliable subscriptions of a publisher have got everything; return whether they have."""
    return _made[number].entity.wait_for_all_acked(Duration(seconds=seconds))


def destroy_publisher(number):
    """End a publisher."""
    _end(number)


def count_subscriptions(number, count, seconds):
    """Wait until a publisher has so many subscriptions; return how many it has."""
    entity = _made[number].entity
    _until(lambda: entity.get_subscription_count() == count, seconds)
    return entity.get_subscription_count()


class _Subscription:
    def __init__(self, node, topic, cls, qos, raw):
        self.received = []
        self.entity = node.create_subscription(cls, topic, self._arrived, _profile(qos), raw=raw)
        self._raw = raw

    def _arrived(self, message, info):
        data = bytes(message).hex() if self._raw else _bytes_of(message)
        self.received.append([data, info["source_timestamp"]])


def make_subscription(node, topic, type_name, qos, raw=False):
    """Make a subscription that collects messages; return its number."""
    return _keep(_do(lambda: _Subscription(_made[node], topic, find_class(type_name), qos, raw)))


def destroy_subscription(number):
    """End a subscription."""
    _end(number)


def count_publishers(number, count, seconds):
    """Wait until a subscription has so many publishers; return how many it has."""
    entity = _made[number].entity
    _until(lambda: entity.get_publisher_count() == count, seconds)
    return entity.get_publisher_count()


def received(number, count, seconds):
    """Wait for so many messages; return all, with their source stamps in nanoseconds."""
    found = _made[number].received
    _until(lambda: len(found) >= count, seconds)
    return found


class _Service:
    """Answers with a response that is given, or holds requests back."""

    def __init__(self, node, name, cls, response, held, qos):
        self._response = response
        self.requests = []
        self.waiting = []
        self.held = held
        options = {"qos_profile": _profile(qos)} if qos else {}
        group = MutuallyExclusiveCallbackGroup()  # what it holds back holds back nothing else
        self.entity = node.create_service(cls, name, self._answer, callback_group=group, **options)

    async def _answer(self, request, response):
        self.requests.append(_bytes_of(request))
        if self.held:
            self.waiting.append(rclpy.Future())
            await self.waiting[-1]
        return _message(type(response), self._response)


def make_service(node, name, type_name, response, held=False, qos=None):
    """Make a service that gives one response; return its number."""
    return _keep(_do(lambda: _Service(_made[node], name, find_class(type_name), response, held, qos)))


def requests(number, count, seconds):
    """Wait until a service or action has got so many requests; return all."""
    found = _made[number].requests
    _until(lambda: len(found) >= count, seconds)
    return found


def release(number):
    """Let a service answer what it holds back, and what comes later."""
    service = _made[number]

    def free():
        service.held = False
        for each in service.waiting:
            each.set_result(None)

    _do(free)


def destroy_service(number):
    """End a service."""
    _end(number)


def make_client(node, name, type_name):
    """Make a client; return its number."""
    return _keep(_do(lambda: _made[node].create_client(find_class(type_name), name)))


def wait_for_service(number, seconds):
    """Return whether a client sees a server in time."""
    return bool(_until(_made[number].service_is_ready, seconds))


def call(number, requests_):
    """Send requests; return the number of the calls, for `responses`."""
    client = _made[number]
    cls = client.srv_type.Request
    return _keep(_do(lambda: [client.call_async(_message(cls, each)) for each in requests_]))


def responses(number, count, seconds):
    """Wait for so many responses; return them by the position of their requests, as pairs."""
    futures = _made[number]

    def done():
        return [[place, _bytes_of(each.result())] for place, each in enumerate(futures) if each.done()]

    _until(lambda: len(done()) >= count, seconds)
    return done()


class _Action:
    """Accepts goals, publishes feedback, and ends a goal as it was told to, or as a test says later."""

    def __init__(self, node, name, cls, result, feedback, ending):
        self._cls = cls
        self._result = result
        self._feedback = feedback
        self._ending = ending
        self.requests = []
        self.goals = []
        self.ends = []
        self.entity = ActionServer(
            node,
            cls,
            name,
            self._execute,
            goal_callback=self._decide,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
            callback_group=ReentrantCallbackGroup(),
        )

    def _decide(self, request):
        return GoalResponse.REJECT if self._ending == "reject" else GoalResponse.ACCEPT

    async def _execute(self, goal):
        self.requests.append(_bytes_of(goal.request))
        for each in self._feedback:
            goal.publish_feedback(_message(self._cls.Feedback, each))
        ending = self._ending
        if ending == "later":
            self.ends.append(rclpy.Future())
            ending = await self.ends[-1]
        getattr(goal, ending)()
        return _message(self._cls.Result, self._result)


def make_action_server(node, name, type_name, result, feedback, ending):
    """Make an action server; `ending` is "succeed", "abort", "reject" or "later"; return its number."""
    cls = find_class(type_name)
    return _keep(_do(lambda: _Action(_made[node], name, cls, result, feedback, ending)))


def end_goals(number, ending):
    """End the goals that an action server holds: "succeed", "abort" or "canceled"."""
    ends = _made[number].ends
    _do(lambda: [each.set_result(ending) for each in ends if not each.done()])


def destroy_action_server(number):
    """End an action server."""
    _do(_made.pop(number).entity.destroy)


class _Goals:
    def __init__(self, node, name, cls):
        self.cls = cls
        self.entity = ActionClient(node, cls, name)


class _Goal:
    """What a client knows of a goal."""

    def __init__(self, client, goal):
        self._client = client
        self.accepted = None
        self.handle = None
        self.feedback = []
        self.status = None
        self.result = None
        self.cancelled = None
        sent = client.entity.send_goal_async(_message(client.cls.Goal, goal), self._fed)
        sent.add_done_callback(self._answered)

    def _fed(self, message):
        self.feedback.append(_bytes_of(message.feedback))

    def _answered(self, future):
        self.handle = future.result()
        self.accepted = self.handle.accepted
        if self.accepted:
            self.handle.get_result_async().add_done_callback(self._ended)

    def _ended(self, future):
        self.status = future.result().status
        self.result = _bytes_of(future.result().result)

    def cancel(self):
        self.handle.cancel_goal_async().add_done_callback(self._was_cancelled)

    def _was_cancelled(self, future):
        self.cancelled = [future.result().return_code, len(future.result().goals_canceling)]


def make_action_client(node, name, type_name):
    """Make an action client; return its number."""
    return _keep(_do(lambda: _Goals(_made[node], name, find_class(type_name))))


def wait_for_action_server(number, seconds):
    """Return whether an action client sees a server in time."""
    return bool(_until(_made[number].entity.server_is_ready, seconds))


def send_goal(number, goal):
    """Send a goal; return its number, for `goal_state`."""
    return _keep(_do(lambda: _Goal(_made[number], goal)))


def goal_state(number, what, seconds, count=0):
    """Wait until something of a goal is known ("accepted", "cancelled", "result"); return all.

    Args:
        number: The goal.
        what: What is waited for.
        seconds: The longest wait.
        count: Of feedback that is waited for.
    """
    goal = _made[number]
    _until(lambda: getattr(goal, what) is not None and len(goal.feedback) >= count, seconds)
    return {each: getattr(goal, each) for each in ("accepted", "feedback", "status", "result", "cancelled")}


def cancel_goal(number):
    """Ask for a goal's end."""
    _do(_made[number].cancel)


def cancel_all(node, name, seconds):
    """Ask for the end of all goals of an action; return the code, and how many end."""
    client = _made[node].create_client(CancelGoal, f"{name}/_action/cancel_goal")
    _until(client.service_is_ready, seconds)
    future = _do(lambda: client.call_async(CancelGoal.Request(goal_info=GoalInfo())))
    _until(future.done, seconds)
    return [future.result().return_code, len(future.result().goals_canceling)] if future.done() else None


def node_names(node, wanted, absent, seconds):
    """Wait until some nodes are in the graph and others are not; return the names of all."""

    def found():
        return sorted(
            f"{space.rstrip('/')}/{name}" for name, space in _made[node].get_node_names_and_namespaces()
        )

    _until(lambda: {*wanted} <= {*found()} and not {*absent} & {*found()}, seconds)
    return found()


def names_of(node, name, namespace):
    """Return the publishers, subscriptions, services and clients of a node in the graph, with types."""
    asking = _made[node]
    return {
        kind: dict(ask(name, namespace))
        for kind, ask in {
            "publishers": asking.get_publisher_names_and_types_by_node,
            "subscriptions": asking.get_subscriber_names_and_types_by_node,
            "services": asking.get_service_names_and_types_by_node,
            "clients": asking.get_client_names_and_types_by_node,
        }.items()
    }


def endpoints(node, topic, kind, count, seconds):
    """Wait for so many endpoints of a topic; return the nodes, types, hashes and policies of all.

    Args:
        node: The node that asks.
        topic: The topic.
        kind: "publishers" or "subscriptions".
        count: How many are waited for.
        seconds: The longest wait.
    """
    ask = getattr(_made[node], f"get_{kind}_info_by_topic")

    def found():
        # An endpoint can be there before its node's name is.
        return [each for each in ask(topic) if each.node_name != "_NODE_NAME_UNKNOWN_"]

    _until(lambda: len(found()) == count, seconds)
    return sorted(
        [
            f"{each.node_namespace.rstrip('/')}/{each.node_name}",
            each.topic_type,
            str(each.topic_type_hash),
            each.qos_profile.reliability.name,
            each.qos_profile.durability.name,
        ]
        for each in found()
    )


def offered_times(node, topic):
    """Return the liveliness of a topic's publishers, and their deadlines, lifespans and leases in ns."""
    return [
        [
            qos.liveliness.name,
            *(each.nanoseconds for each in (qos.deadline, qos.lifespan, qos.liveliness_lease_duration)),
        ]
        for qos in (each.qos_profile for each in _made[node].get_publishers_info_by_topic(topic))
    ]


def count_services(node, name, count, seconds):
    """Wait until a service has so many servers; return how many it has."""
    counting = _made[node].count_services
    _until(lambda: counting(name) == count, seconds)
    return counting(name)


def log(node, text):
    """Write a log line at severity INFO."""
    _do(lambda: _made[node].get_logger().info(text))


def parameter(node, name):
    """Return a parameter's value."""
    return _made[node].get_parameter(name).value


def set_parameter(node, name, value):
    """Set a parameter, which publishes a parameter event."""
    (result,) = _do(lambda: _made[node].set_parameters([Parameter(name, value=value)]))
    return result.successful


def clock_ns(node):
    """Return a node's time in nanoseconds."""
    return _made[node].get_clock().now().nanoseconds


def now_ns():
    """Return the system's time in nanoseconds, as source stamps have it."""
    return time.time_ns()


def kill():
    """Die without a goodbye."""
    os.kill(os.getpid(), signal.SIGKILL)


def destroy_all():
    """End all nodes: the next test begins without any."""
    nodes = _nodes()
    _made.clear()
    if nodes:
        _do(lambda: [(_thread.executor.remove_node(each), each.destroy_node()) for each in nodes])


def publish_numbers(node, topic, text, period_sec):
    """Publish "TEXT:0", "TEXT:1" and so on, as long as the node is there."""

    def make():
        publisher = _made[node].create_publisher(String, topic, 10)
        numbers = itertools.count()
        _made[node].create_timer(
            period_sec, lambda: publisher.publish(String(data=f"{text}:{next(numbers)}"))
        )

    _do(make)


def take_texts(number):
    """Return the texts that a subscription of String messages has received since the last call."""
    subscription = _made[number]
    taken, subscription.received = subscription.received, []
    return [_message(String, data).data for data, _ in taken]

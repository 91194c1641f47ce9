"""Nodes as ROS 2 programs use them: topics, services, timers, parameters, clocks and their ends."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

import pytest

from actors.errors import RemoteError
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.rcl_interfaces.msg import IntegerRange, ParameterDescriptor, SetParametersResult
from actors.interfaces.rcl_interfaces.srv import SetParameters
from actors.interfaces.rosgraph_msgs.msg import Clock as ClockMessage
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import Trigger
from actors.ros.rclpy._rclpy_pybind11 import RCLError
from actors.ros.rclpy.clock import Clock, JumpThreshold
from actors.ros.rclpy.event_handler import PublisherEventCallbacks
from actors.ros.rclpy.exceptions import (
    InvalidHandle,
    InvalidParameterValueException,
    InvalidTopicNameException,
    NotInitializedException,
    ParameterNotDeclaredException,
    ROSInterruptException,
)
from actors.ros.rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from actors.ros.rclpy.node import Node, NodeNameNonExistentError
from actors.ros.rclpy.parameter import Parameter
from actors.ros.rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from actors.ros.rclpy.subscription_content_filter_options import ContentFilterOptions
from actors.ros.rclpy.task import Future
from actors.ros.rclpy.timer import TimerInfo
from actors.threads import NodeThread
from actors.time.types import ClockType, Duration, Time
from broker import Broker, BrokerOptions
from tests.actors.ros.conftest import running_context
from tests.ports import held_port
from tests.seams.ros import counted_messages

if TYPE_CHECKING:
    from collections.abc import Iterator

    from actors.ros.rclpy.context import Context
    from actors.ros.rclpy.subscription import MessageInfo

DEADLINE_SEC = 20.0


@pytest.fixture
def executor(context: Context) -> Iterator[SingleThreadedExecutor]:
    """An executor of the context."""
    with SingleThreadedExecutor(context=context) as executor:
        yield executor


@pytest.fixture
def node(context: Context, executor: SingleThreadedExecutor) -> Node:
    """A node of the executor."""
    node = Node("node", namespace="ns", context=context)
    executor.add_node(node)
    return node


def add(request: AddTwoInts.Request, response: AddTwoInts.Response) -> AddTwoInts.Response:
    response.sum = request.a + request.b
    return response


def test_messages_wait_as_the_depth_allows(node: Node, executor: SingleThreadedExecutor) -> None:
    """Of 100 messages that nobody took, the last three come, with their info."""
    seen, done = list[tuple[str, int | None]](), Future[None](executor=executor)

    def heard(msg: String, info: MessageInfo) -> None:
        seen.append((msg.data, info["publication_sequence_number"]))
        if msg.data == "99":
            done.set_result(None)

    subscription = node.create_subscription(String, "t", heard, 3)
    publisher = node.create_publisher(String, "t", 100)
    assert node.wait_for_node("/ns/node", DEADLINE_SEC)
    assert (publisher.get_subscription_count(), subscription.get_publisher_count()) == (1, 1)
    for number in range(100):
        publisher.publish(String(data=str(number)))
    assert publisher.wait_for_all_acked()
    node.get_topic_names_and_types()  # answered after the messages have come
    executor.spin_until_future_complete(done, DEADLINE_SEC)
    assert seen == [("97", 97), ("98", 98), ("99", 99)]
    assert (publisher.topic_name, subscription.topic_name) == ("/ns/t", "/ns/t")


def test_raw_messages_are_cdr(
    node: Node, executor: SingleThreadedExecutor, caplog: pytest.LogCaptureFixture
) -> None:
    """In both directions, and filtered by content. What cannot be CDR is dropped, counted and logged."""
    seen, done = list[bytes](), Future[None](executor=executor)

    def heard(data: bytes) -> None:
        seen.append(data)
        if b"end" in data:
            done.set_result(None)

    options = ContentFilterOptions("data <> 'filtered'", [])
    subscription = node.create_subscription(String, "t", heard, 10, raw=True, content_filter_options=options)
    publisher = node.create_publisher(String, "t", 10)
    assert node.wait_for_node("/ns/node", DEADLINE_SEC)
    assert publisher.get_subscription_count() == 1
    end = b"\0\1\0\0\4\0\0\0end\0"
    for message in (String(data="a"), String(data="filtered"), String(data="b\0c"), end):
        publisher.publish(message)
    executor.spin_until_future_complete(done, DEADLINE_SEC)
    assert seen == [b"\0\1\0\0\2\0\0\0a\0", end]
    assert (
        "A message of /ns/t is dropped: std_msgs/msg/String.data: Expected a string without NUL"
        in caplog.text
    )
    assert counted_messages(subscription) == (2, 1)
    with pytest.raises(InvalidMessageError, match="too few"):
        publisher.publish(end[:-1])


def test_matches_are_known_at_once(node: Node, context: Context) -> None:
    """Of what any node of the process has just made or destroyed, as in ROS 2."""
    other = Node("other", context=context)
    publisher = node.create_publisher(String, "/t", 10)
    for _ in range(5):
        subscription = other.create_subscription(String, "/t", lambda msg: None, 10)
        assert publisher.get_subscription_count() == subscription.get_publisher_count() == 1
        other.destroy_subscription(subscription)
        assert publisher.get_subscription_count() == 0
        service = other.create_service(Trigger, "/s", lambda request, response: response)
        client = node.create_client(Trigger, "/s")
        assert client.service_is_ready()
        other.destroy_service(service)
        assert not client.wait_for_service(timeout_sec=0)
        node.destroy_client(client)


def test_incompatible_endpoints_do_not_match(node: Node) -> None:
    """As in ROS 2; a profile may be changed before and afterwards."""
    profile = QoSProfile(depth=1)
    node.create_subscription(String, "t", lambda msg: None, profile)
    profile.reliability = ReliabilityPolicy.BEST_EFFORT
    publisher = node.create_publisher(String, "t", profile)
    profile.reliability = ReliabilityPolicy.RELIABLE
    assert node.count_subscribers("t") == node.count_publishers("t") == 1
    assert publisher.get_subscription_count() == 0
    assert publisher.qos_profile.reliability == ReliabilityPolicy.BEST_EFFORT


def test_a_service_is_called_in_every_way(node: Node, executor: SingleThreadedExecutor) -> None:
    """Before there is a server, with a future, blocking in another thread, and blocking in a callback."""
    client = node.create_client(AddTwoInts, "add")
    assert not client.wait_for_service(0)
    early = client.call_async(AddTwoInts.Request(a=1, b=2))
    node.create_service(AddTwoInts, "add", add)
    executor.spin_until_future_complete(early, DEADLINE_SEC)
    assert early.result() == AddTwoInts.Response(sum=3)
    assert client.wait_for_service(DEADLINE_SEC)
    done = Future[Any](executor=executor)
    thread = threading.Thread(
        target=lambda: done.set_result(client.call(AddTwoInts.Request(a=2, b=3), DEADLINE_SEC))
    )
    thread.start()
    executor.spin_until_future_complete(done, DEADLINE_SEC)
    thread.join()
    assert done.result() == AddTwoInts.Response(sum=5)
    with pytest.raises(TypeError):
        client.call_async(AddTwoInts.Response())


def test_a_callback_may_call_and_block(
    context: Context, node: Node, executor: SingleThreadedExecutor
) -> None:
    """The server is spun by another thread; the single thread here waits in its callback."""
    server = Node("server", namespace="ns", context=context)
    server.create_service(AddTwoInts, "add", add)
    client, done = node.create_client(AddTwoInts, "add"), Future[Any](executor=executor)
    guard = node.create_guard_condition(
        lambda: done.set_result(client.call(AddTwoInts.Request(a=4, b=4), DEADLINE_SEC))
    )
    guard.trigger()
    with SingleThreadedExecutor(context=context) as other:
        other.add_node(server)
        thread = threading.Thread(target=other.spin_until_future_complete, args=(done, DEADLINE_SEC))
        thread.start()
        executor.spin_until_future_complete(done, DEADLINE_SEC)
        thread.join()
    assert done.result() == AddTwoInts.Response(sum=8)


def test_a_handler_that_raises_ends_spin_and_the_call(node: Node, executor: SingleThreadedExecutor) -> None:
    """The caller's future has the error."""

    def fail(request: Any, response: Any) -> Any:
        raise ValueError("in a handler")

    node.create_service(AddTwoInts, "add", fail)
    future = node.create_client(AddTwoInts, "add").call_async(AddTwoInts.Request())
    with pytest.raises(ValueError, match="in a handler"):
        executor.spin_until_future_complete(future, DEADLINE_SEC)
    executor.spin_until_future_complete(future, DEADLINE_SEC)
    assert isinstance(future.exception(), RemoteError)


def test_a_handler_may_await_a_call(node: Node, executor: SingleThreadedExecutor) -> None:
    """A service that asks another one of the same node, in one thread."""
    client = node.create_client(AddTwoInts, "inner")

    async def outer(request: Any, response: Any) -> Any:
        inner = await client.call_async(request)
        assert inner is not None
        response.sum = 10 * inner.sum
        return response

    group = node.default_callback_group
    assert group.has_entity(client)
    node.create_service(AddTwoInts, "inner", add)
    node.create_service(AddTwoInts, "outer", outer, callback_group=type(group)())
    future = node.create_client(AddTwoInts, "outer").call_async(AddTwoInts.Request(a=1, b=2))
    executor.spin_until_future_complete(future, DEADLINE_SEC)
    assert future.result() == AddTwoInts.Response(sum=30)


def test_parameters_are_the_threads_that_spin(
    context: Context, node: Node, executor: SingleThreadedExecutor
) -> None:
    """Another node sets one: the callback decides, here, and the event is published."""
    threads, events = list[int](), list[Any]()

    def decide(parameters: list[Parameter]) -> SetParametersResult:
        threads.append(threading.get_ident())
        return SetParametersResult(successful=parameters[0].value != 13)

    node.declare_parameter("count", 1)
    node.add_on_set_parameters_callback(decide)
    client = node.create_client(SetParameters, "~/set_parameters")
    for value, accepted in ((2, True), (13, False)):
        message = Parameter("count", value=value).to_parameter_msg()
        future = client.call_async(SetParameters.Request(parameters=[message]))
        executor.spin_until_future_complete(future, DEADLINE_SEC)
        response = future.result()
        assert response is not None
        assert response.results[0].successful is accepted
    assert threads == [threading.get_ident()] * 2
    assert node.get_parameter("count").value == 2
    with pytest.raises(ParameterNotDeclaredException):
        node.get_parameter("none")
    assert not events


def test_arguments_of_the_context_reach_its_nodes(context: Context) -> None:
    """Remapping and parameters, unless the node takes none; arguments of a node come first."""
    args = ("program", "--ros-args", "-r", "t:=u", "-r", "__ns:=/from_args", "-p", "count:=7")
    with running_context(*args) as other:
        node = Node("node", context=other)
        assert node.declare_parameter("count", 1).value == 7
        assert node.create_publisher(String, "t", 1).topic_name == "/from_args/u"
        own = Node("own", context=other, cli_args=["--ros-args", "-r", "t:=v"])
        assert own.resolve_topic_name("t") == "/from_args/v"
        none = Node("none", context=other, use_global_arguments=False)
        assert none.resolve_topic_name("t") == "/t"


def test_timers_follow_their_clock(node: Node, executor: SingleThreadedExecutor) -> None:
    """A cancelled one is silent until it is reset; what passes while nobody spins is one call."""
    ticks, done = list[int](), Future[None](executor=executor)

    def tick() -> None:
        ticks.append(1)
        if len(ticks) == 5:
            done.set_result(None)

    timer = node.create_timer(0.001, tick)
    executor.spin_until_future_complete(done, DEADLINE_SEC)
    timer.cancel()
    assert timer.is_canceled()
    assert timer.time_until_next_call() is None
    executor.spin_once(0)
    assert len(ticks) == 5
    timer.timer_period_ns = 10**12
    timer.reset()
    assert 0 < (timer.time_until_next_call() or 0) <= 10**12
    assert not timer.is_ready()
    assert node.destroy_timer(timer)
    with pytest.raises(InvalidHandle):
        timer.is_ready()


def test_a_shutdown_ends_every_wait(context: Context, node: Node) -> None:
    """Rates that sleep and calls raise, and a wait for a service returns False."""
    waits, errors = list[bool](), list[BaseException]()
    client, rate = node.create_client(AddTwoInts, "none"), node.create_rate(0.001)

    def sleep() -> None:
        try:
            rate.sleep()
        except ROSInterruptException as error:
            errors.append(error)

    def call() -> None:
        try:
            client.call(AddTwoInts.Request())
        except (ExternalShutdownException, NotInitializedException) as error:
            errors.append(error)

    threads = [
        threading.Thread(target=sleep),
        threading.Thread(target=call),
        threading.Thread(target=lambda: waits.append(client.wait_for_service())),
    ]
    for thread in threads:
        thread.start()
    context.shutdown()
    for thread in threads:
        thread.join(DEADLINE_SEC)
    assert waits == [False]
    assert len(errors) == 2


class Robot(Node):
    """A node with names of its own, as programs give them."""

    def __init__(self, context: Context) -> None:
        super().__init__("robot", context=context)
        self._thread = self._executor = self._entities = self._store = self.native = self.ask = None
        self._publishers = self._subscriptions = self._timers = self._node = self._add = self._lock = None
        self.messages = list[str]()
        self.create_subscription(String, "t", lambda message: self.messages.append(message.data), 1)
        self._callback = self.create_publisher(String, "t", 1)

    def say(self, text: str) -> None:
        """Publish a text."""
        self._callback.publish(String(data=text))


def test_programs_may_use_all_names_that_rclpy_does_not(
    context: Context, executor: SingleThreadedExecutor
) -> None:
    """A subclass overwrites what it likes, and `Node` adds one name to those of rclpy's."""
    with Robot(context) as robot:
        executor.add_node(robot)
        robot.say("x")
        executor.spin_once(DEADLINE_SEC)
        assert robot.messages == ["x"]
        plain = Node("plain", context=context)
        assert {name for name in vars(plain) if not name.startswith("_Node__")} == {
            "_callboard",
            *("_clock", "_context", "_default_callback_group", "_logger", "_rate_group"),  # rclpy's, too
        }


def test_an_override_switches_to_simulated_time(context: Context) -> None:
    """`use_sim_time` in the constructor's overrides acts as one of the command line does."""
    node = Node("node", context=context, parameter_overrides=[Parameter("use_sim_time", value=True)])
    assert node.get_parameter("use_sim_time").value is True
    assert node.get_clock().ros_time_is_active
    assert node.get_clock().now().nanoseconds == 0


def test_wrong_use_is_an_error(context: Context, node: Node) -> None:
    """Names, callbacks, types and contexts that cannot work are named at once."""
    with pytest.raises(InvalidTopicNameException):
        node.create_publisher(String, "a//b", 1)
    for resolve in (node.resolve_topic_name, node.resolve_service_name):
        with pytest.raises(RCLError, match="a b"):
            resolve("a b")
    with pytest.raises(RuntimeError, match="callable with one argument"):
        node.create_subscription(String, "t", lambda: None, 1)
    with pytest.raises(TypeError, match="no message class"):
        node.create_publisher(int, "t", 1)  # type: ignore[type-var]
    with pytest.raises(TypeError):
        node.create_publisher(String, "t", 1).publish(AddTwoInts.Request())  # type: ignore[arg-type]
    with pytest.raises(RCLError, match="non-negative"):
        node.create_timer(-1, lambda: None)
    client = node.create_client(AddTwoInts, "s")
    node.destroy_client(client)
    with pytest.raises(InvalidHandle, match="destroyed"):
        client.call_async(AddTwoInts.Request())
    publisher = node.create_publisher(String, "t", 1)
    context.shutdown()
    with pytest.raises(InvalidHandle):
        publisher.publish(String())
    with pytest.raises(NotInitializedException):
        Node("late", context=context)


def test_a_descriptor_takes_the_alternative_only_if_it_must(node: Node) -> None:
    """A value that the new descriptor allows stays; of a parameter without a value the type is NOT_SET."""
    node.declare_parameter("n", 5)
    seven = Parameter("n", value=7).get_parameter_value()
    allowed = ParameterDescriptor(integer_range=[IntegerRange(to_value=10)])
    assert node.set_descriptor("n", allowed, seven).integer_value == 5
    higher = ParameterDescriptor(integer_range=[IntegerRange(from_value=6, to_value=10)])
    with pytest.raises(InvalidParameterValueException):
        node.set_descriptor("n", higher)
    assert node.set_descriptor("n", higher, seven).integer_value == 7
    node.declare_parameter("unset", Parameter.Type.STRING)
    assert node.get_parameter_types(["n", "unset"]) == [Parameter.Type.INTEGER, Parameter.Type.NOT_SET]
    assert "type=2," in repr(node.describe_parameter("n"))
    assert "(type=2," in repr(seven)


def test_objects_have_a_handle(context: Context, node: Node) -> None:
    """Programs see that rclpy's objects of C are there, and hold them."""
    guard = node.create_guard_condition(lambda: None)
    for each in (context, node, guard, node.create_publisher(String, "t", 1)):
        assert each.handle is not None
        with each.handle:
            pass
    assert context.ok()


def test_nodes_come_and_go(context: Context) -> None:
    """They leave no threads, and nothing in the graph; `destroy_node` may be called twice."""
    Node("first", context=context).destroy_node()
    before = threading.active_count()
    for _ in range(30):
        node = Node("node", context=context)
        node.create_timer(1.0, lambda: None)
        node.create_client(AddTwoInts, "add")
        node.destroy_node()
        node.destroy_node()
    assert threading.active_count() <= before  # those of others may have ended meanwhile
    assert Node("last", context=context).get_node_names() == ["last"]


def test_events_reach_the_thread_that_spins(node: Node, executor: SingleThreadedExecutor) -> None:
    """What happened before it spins is one call with all changes; a destroyed publisher leaves none."""
    infos, threads = list[Any](), set[int]()

    def matched(info: Any) -> None:
        threads.add(threading.get_ident())
        infos.append(info)

    before = len(list(node.waitables))
    callbacks = PublisherEventCallbacks()
    callbacks.matched = matched
    publisher = node.create_publisher(String, "t", 1, event_callbacks=callbacks)
    for _ in range(3):
        node.create_subscription(String, "t", lambda msg: None, 1)
        node.get_topic_names_and_types()  # answered after the match
    executor.spin_once(DEADLINE_SEC)
    assert infos == [(3, 3, 3, 3)]
    assert threads == {threading.get_ident()}
    node.create_subscription(String, "t", lambda msg: None, 1)
    node.get_topic_names_and_types()
    assert node.destroy_publisher(publisher)
    assert len(list(node.waitables)) == before


def test_parameters_have_rclpys_methods(node: Node) -> None:
    """Declaring, reading, describing, setting and removing."""
    described = ParameterDescriptor(description="how many", integer_range=[IntegerRange(to_value=10)])
    node.declare_parameters("a", [("x", 1), ("y", 2, described)])
    assert [each.value for each in node.get_parameters(["a.x", "a.y"])] == [1, 2]
    assert node.get_parameter_types(["a.x"]) == [node.get_parameter_type("a.y")] == [Parameter.Type.INTEGER]
    assert node.get_parameter_or("none", Parameter("none", value=5)).value == 5
    assert {name: each.value for name, each in node.get_parameters_by_prefix("a").items()} == {"x": 1, "y": 2}
    assert sorted(node.list_parameters(["a"], 0).names) == ["a.x", "a.y"]
    assert node.describe_parameters(["a.y"])[0].description == "how many"
    refused = node.set_parameters([Parameter("a.y", value=11), Parameter("a.x", value=3)])
    assert [each.successful for each in refused] == [False, True]
    assert node.set_parameters_atomically([Parameter("a.y", value=7)]).successful
    node.set_descriptor("a.y", ParameterDescriptor(description="many"))
    assert node.describe_parameter("a.y").description == "many"
    node.undeclare_parameter("a.x")
    assert not node.has_parameter("a.x")
    for wrong in ([()], [(1, 2)]):
        with pytest.raises(TypeError):
            node.declare_parameters("", wrong)
    with pytest.raises(ValueError, match="depth"):
        node.list_parameters([], -1)
    calls = list[str]()

    def before(parameters: list[Parameter]) -> list[Parameter]:
        calls.append("before")
        return parameters

    def after(parameters: list[Parameter]) -> None:
        calls.append("after")

    node.add_pre_set_parameters_callback(before)
    node.add_post_set_parameters_callback(after)
    node.set_parameters([Parameter("a.y", value=8)])
    node.remove_pre_set_parameters_callback(before)
    node.remove_post_set_parameters_callback(after)
    node.set_parameters([Parameter("a.y", value=9)])
    assert calls == ["before", "after"]
    with pytest.raises(ValueError, match="not in list"):
        node.remove_on_set_parameters_callback(before)


def test_the_graph_is_asked(node: Node) -> None:
    """Every query has rclpy's form; a node that is not there is an error."""
    node.create_publisher(String, "t", 1)
    node.create_subscription(String, "t", lambda msg: None, 1)
    node.create_client(AddTwoInts, "add")
    node.create_service(AddTwoInts, "add", add)
    assert node.get_node_names_and_namespaces() == [("node", "/ns")]
    assert node.get_node_names_and_namespaces_with_enclaves() == [("node", "/ns", "/")]
    assert node.get_fully_qualified_node_names() == ["/ns/node"]
    topic, service = ("/ns/t", ["std_msgs/msg/String"]), ("/ns/add", ["example_interfaces/srv/AddTwoInts"])
    assert topic in node.get_topic_names_and_types()
    assert service in node.get_service_names_and_types()
    assert topic in node.get_publisher_names_and_types_by_node("node", "/ns")
    assert topic in node.get_subscriber_names_and_types_by_node("node", "/ns")
    assert service in node.get_service_names_and_types_by_node("node", "/ns")
    assert service in node.get_client_names_and_types_by_node("node", "/ns")
    assert (node.count_clients("add"), node.count_services("add")) == (1, 1)
    assert node.get_publishers_info_by_topic("t")[0].node_name == "node"
    assert node.get_subscriptions_info_by_topic("t")[0].node_namespace == "/ns"
    with pytest.raises(NodeNameNonExistentError):
        node.get_publisher_names_and_types_by_node("none", "/")


def test_a_restart_of_the_broker_does_not_end_who_asks_for_the_graph(monkeypatch: pytest.MonkeyPatch) -> None:
    """The question waits for the next broker."""
    with held_port() as port, NodeThread("broker") as thread:
        first = thread.enter(Broker(BrokerOptions(port=port)))
        monkeypatch.setenv("CALLBOARD_URL", first.url)
        with running_context() as context, ThreadPoolExecutor() as asking:
            node = Node("node", context=context)
            thread.call(first.stop)
            answer = asking.submit(node.get_node_names)
            thread.enter(Broker(BrokerOptions(port=port)))
            assert answer.result(DEADLINE_SEC) == ["node"]


def test_clocks_sleep_in_any_thread(context: Context, node: Node) -> None:
    """Until a time or for a duration; a shutdown ends the sleep, and another kind of clock is an error."""
    clock = node.get_clock()
    assert clock.sleep_for(Duration(nanoseconds=1), context)
    assert clock.sleep_until(clock.now(), context)
    with pytest.raises(ValueError, match="does not match"):
        clock.sleep_until(Time(clock_type=ClockType.STEADY_TIME), context)
    threading.Timer(0.2, context.shutdown).start()  # when this thread sleeps
    assert not clock.sleep_for(Duration(seconds=1000), context)
    with pytest.raises(NotInitializedException):
        clock.sleep_for(Duration(seconds=1), context)
    assert repr(Clock(clock_type=ClockType.STEADY_TIME)) == "Clock(clock_type=STEADY_TIME)"


def test_timers_follow_simulated_time(node: Node, executor: SingleThreadedExecutor) -> None:
    """A step over several periods is one call, with the times of the clock; real time has no effect."""
    infos, jumps = list[TimerInfo](), list[Any]()

    def tick(info: TimerInfo) -> None:
        infos.append(info)

    node.set_parameters([Parameter("use_sim_time", value=True)])
    clock = node.get_clock()
    assert clock.ros_time_is_active
    every = JumpThreshold(min_forward=Duration(nanoseconds=1), min_backward=None, on_clock_change=False)
    clock.create_jump_callback(every, post_callback=lambda _: jumps.append(threading.get_ident()))
    node.create_timer(10.0, tick)
    publisher = node.create_publisher(ClockMessage, "/clock", 10)
    for second in (100, 135):
        publisher.publish(ClockMessage(clock=Time(seconds=second).to_msg()))
        assert publisher.wait_for_all_acked()
        node.get_topic_names_and_types()  # answered after the message has come
        executor.spin_once(0)
    assert clock.now() == Time(seconds=135, clock_type=ClockType.ROS_TIME)
    while len(jumps) < 2 or infos[-1].actual_call_time != clock.now():
        executor.spin_once(DEADLINE_SEC)
    assert len(infos) <= 2
    assert set(jumps) == {threading.get_ident()}
    executor.spin_once(0.01)
    assert infos[-1].actual_call_time == clock.now()
    with pytest.raises(ValueError, match="must not be negative"):
        TimerInfo(expected_call_time=-1)


def test_entities_are_destroyed_by_hand_and_by_with(node: Node) -> None:
    """Each `destroy_…` says whether there was something to destroy."""
    with (
        node.create_publisher(String, "t", 1),
        node.create_subscription(String, "t", lambda msg: None, 1),
        node.create_client(AddTwoInts, "add"),
        node.create_service(AddTwoInts, "add", add),
        node.create_timer(1.0, lambda: None),
    ):
        assert node.count_publishers("t") == node.count_services("add") == 1
    assert node.count_publishers("t") == node.count_subscribers("t") == node.count_services("add") == 0
    guard, rate = node.create_guard_condition(lambda: None), node.create_rate(10)
    subscription = node.create_subscription(String, "t", lambda msg: None, 1)
    client, service = node.create_client(AddTwoInts, "add"), node.create_service(AddTwoInts, "add", add)
    for destroy, entity in (
        (node.destroy_guard_condition, guard),
        (node.destroy_rate, rate),
        (node.destroy_subscription, subscription),
        (node.destroy_client, client),
        (node.destroy_service, service),
    ):
        destroyed: Any = destroy
        assert destroyed(entity)
        assert not destroyed(entity)
    with pytest.raises(RuntimeError, match="destroyed"):
        rate.sleep()
    with pytest.raises(ValueError, match="frequency"):
        node.create_rate(0)


def test_a_request_that_cannot_be_sent_is_refused(node: Node) -> None:
    """A value of a wrong type in the request raises, where it is called, an error that names the field."""
    client = node.create_client(AddTwoInts, "add")
    with pytest.raises(InvalidMessageError, match=r"AddTwoInts_Request\.a: Expected int"):
        client.call_async(AddTwoInts.Request(a="one"))  # type: ignore[arg-type]


def test_a_request_may_be_changed_after_the_call(node: Node, executor: SingleThreadedExecutor) -> None:
    """Each call sends what the request was when it was made, also one that waits for a server."""
    client = node.create_client(AddTwoInts, "add")
    request = AddTwoInts.Request()
    futures: list[Future[Any]] = []
    for request.a in range(5):
        futures.append(client.call_async(request))
    node.create_service(AddTwoInts, "add", add)
    for number, future in enumerate(futures):
        executor.spin_until_future_complete(future, DEADLINE_SEC)
        response = future.result()
        assert response is not None
        assert response.sum == number


def test_a_response_may_be_changed_after_its_return(node: Node, executor: SingleThreadedExecutor) -> None:
    """The caller gets it as it was: a handler may keep one response and fill it for each request."""
    kept = AddTwoInts.Response()

    def add_into_kept(request: AddTwoInts.Request, response: AddTwoInts.Response) -> AddTwoInts.Response:
        del response
        kept.sum = request.a
        return kept

    node.create_service(AddTwoInts, "add", add_into_kept)
    client = node.create_client(AddTwoInts, "add")
    assert client.wait_for_service(DEADLINE_SEC)
    futures = [client.call_async(AddTwoInts.Request(a=number)) for number in range(20)]
    for number, future in enumerate(futures):
        executor.spin_until_future_complete(future, DEADLINE_SEC)
        response = future.result()
        assert response is not None
        assert response.sum == number


@pytest.mark.parametrize("later", [False, True])
def test_a_handler_must_return_a_response(
    node: Node, executor: SingleThreadedExecutor, *, later: bool
) -> None:
    """Anything else makes spinning raise, and the call fail, with an error that names the service."""

    def respond(request: AddTwoInts.Request, response: AddTwoInts.Response) -> Any:
        del request, response

    async def respond_later(request: AddTwoInts.Request, response: AddTwoInts.Response) -> Any:
        return respond(request, response)

    node.create_service(AddTwoInts, "add", respond_later if later else respond)
    client = node.create_client(AddTwoInts, "add")
    future = client.call_async(AddTwoInts.Request())
    with pytest.raises(TypeError, match=r"/ns/add returned None, not a AddTwoInts.Response"):
        executor.spin_until_future_complete(future, DEADLINE_SEC)
    executor.spin_until_future_complete(future, DEADLINE_SEC)
    with pytest.raises(RemoteError, match="returned None"):
        future.result()


def test_a_shutdown_ends_a_wait_for_slow_readers(
    context: Context, node: Node, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`publish` waits while a KEEP_ALL reader has no space, and raises when the context ends."""
    keep_all = QoSProfile(history=HistoryPolicy.KEEP_ALL, reliability=ReliabilityPolicy.RELIABLE)
    node.create_subscription(String, "t", lambda _: None, keep_all)  # nobody spins
    publisher = node.create_publisher(String, "t", keep_all)
    errors, waits = list[BaseException](), threading.Event()
    message, wait_for = String(data="x" * 8_000_000), context.wait_for

    def observed(*args: Any) -> Any:
        waits.set()
        return wait_for(*args)

    monkeypatch.setattr(context, "wait_for", observed)

    def publish() -> None:
        try:
            while True:
                publisher.publish(message)
        except ExternalShutdownException as error:
            errors.append(error)

    thread = threading.Thread(target=publish)
    thread.start()
    assert waits.wait(DEADLINE_SEC)
    context.shutdown()
    thread.join(DEADLINE_SEC)
    assert not thread.is_alive()
    assert len(errors) == 1


def test_parameters_are_set_until_one_is_unknown(context: Context) -> None:
    """What precedes an undeclared parameter is set; what is no parameter changes nothing."""
    node = Node("node", context=context)
    node.declare_parameter("a", 1)
    with pytest.raises(ParameterNotDeclaredException):
        node.set_parameters([Parameter("a", value=2), Parameter("b", value=2)])
    assert node.get_parameter("a").value == 2
    with pytest.raises(TypeError, match="42 is no rclpy"):
        node.set_parameters([Parameter("a", value=3), 42])  # type: ignore[list-item]
    with pytest.raises(TypeError, match="42 is no rclpy"):
        node.set_parameters_atomically([42])  # type: ignore[list-item]
    assert node.get_parameter("a").value == 2


def test_parameters_are_listed_and_described(context: Context) -> None:
    """A text as prefixes and a fraction as a depth are refused; what may be undeclared is described."""
    node = Node("node", context=context, allow_undeclared_parameters=True)
    with pytest.raises(TypeError, match="must be a list of names, not 'a'"):
        node.list_parameters("a", 0)  # type: ignore[arg-type]
    with pytest.raises(TypeError):
        node.list_parameters([], 1.5)  # type: ignore[arg-type]
    assert node.describe_parameters(["unknown"]) == [ParameterDescriptor()]

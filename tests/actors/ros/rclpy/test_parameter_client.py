"""Parameter clients and parameter event handlers of ROS 2 programs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from actors.interfaces.rcl_interfaces.msg import Parameter as ParameterMessage
from actors.interfaces.rcl_interfaces.msg import ParameterDescriptor, ParameterEvent
from actors.ros.rclpy.executors import SingleThreadedExecutor
from actors.ros.rclpy.node import Node
from actors.ros.rclpy.parameter import Parameter
from actors.ros.rclpy.parameter_client import AsyncParameterClient
from actors.ros.rclpy.parameter_event_handler import ParameterEventHandler
from actors.ros.rclpy.task import Future

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from actors.ros.rclpy.context import Context

DEADLINE_SEC = 20.0


@pytest.fixture
def executor(context: Context) -> Iterator[SingleThreadedExecutor]:
    """An executor of the context."""
    with SingleThreadedExecutor(context=context) as executor:
        yield executor


@pytest.fixture
def target(context: Context, executor: SingleThreadedExecutor) -> Node:
    """A node with parameters."""
    node = Node("target", namespace="ns", context=context)
    node.declare_parameter("speed", 1)
    node.declare_parameter("arm.length", 2.5)
    node.declare_parameter("extra", "x", ParameterDescriptor(dynamic_typing=True))
    executor.add_node(node)
    return node


@pytest.fixture
def client(context: Context, executor: SingleThreadedExecutor) -> AsyncParameterClient:
    """A client of the target, which is relative to the namespace of the node that asks."""
    node = Node("asking", namespace="ns", context=context)
    executor.add_node(node)
    return AsyncParameterClient(node, "target")


def result(executor: SingleThreadedExecutor, future: Future[Any]) -> Any:
    executor.spin_until_future_complete(future, DEADLINE_SEC)
    assert future.done()
    return future.result()


def test_a_client_reads_and_sets(
    target: Node, client: AsyncParameterClient, executor: SingleThreadedExecutor
) -> None:
    """Each method asks the other node; messages and parameters can both be set; callbacks get the future."""
    assert client.wait_for_services(DEADLINE_SEC)
    assert client.services_are_ready()
    done = list[Future[Any]]()
    future = client.get_parameters(["arm.length"], done.append)
    assert [each.double_value for each in result(executor, future).values] == [2.5]
    while not done:
        executor.spin_once(DEADLINE_SEC)
    assert done == [future]
    listed = result(executor, client.list_parameters(["arm"], 2)).result
    assert (listed.names, listed.prefixes) == (["arm.length"], ["arm"])
    assert "speed" in result(executor, client.list_parameters()).result.names
    assert [*result(executor, client.get_parameter_types(["speed"])).types] == [2]
    (descriptor,) = result(executor, client.describe_parameters(["speed"])).descriptors
    assert (descriptor.name, descriptor.type) == ("speed", 2)
    wanted: list[Parameter | ParameterMessage]
    wanted = [Parameter("speed", value=2), Parameter("arm.length", value=3.5).to_parameter_msg()]
    assert [each.successful for each in result(executor, client.set_parameters(wanted)).results] == [True] * 2
    wanted = [Parameter("speed", value=3), Parameter("arm.length", value="long")]
    assert not result(executor, client.set_parameters_atomically(wanted)).result.successful
    assert [each.value for each in target.get_parameters(["speed", "arm.length"])] == [2, 3.5]
    results = result(executor, client.delete_parameters(["extra", "speed"])).results
    assert [each.successful for each in results] == [True, False]


def test_a_client_loads_files(
    target: Node, client: AsyncParameterClient, executor: SingleThreadedExecutor, tmp_path: Path
) -> None:
    """The parameters of a file are set one by one, or all or none."""
    file = tmp_path / "parameters.yaml"
    file.write_text("/ns/target:\n  ros__parameters: {speed: 5, arm: {length: 4.5}}")
    results = result(executor, client.load_parameter_file(str(file))).results
    assert [each.successful for each in results] == [True] * 2
    assert target.get_parameter("arm.length").value == 4.5
    file.write_text("/**:\n  ros__parameters: {speed: 6, arm: {length: no}}")
    future = client.load_parameter_file_atomically(str(file), use_wildcard=True)
    assert not result(executor, future).result.successful
    assert target.get_parameter("speed").value == 5


def test_a_client_without_a_server_waits(context: Context) -> None:
    """Waiting for a node that is not there ends with False."""
    client = AsyncParameterClient(Node("asking", context=context), "nobody")
    assert not client.wait_for_services(0.01)


def test_an_event_handler_calls(
    target: Node, client: AsyncParameterClient, executor: SingleThreadedExecutor
) -> None:
    """A parameter's callback gets its message, an event's all; the last one added is called first."""
    handler = ParameterEventHandler(client.node)
    calls = list[tuple[str, Any]]()
    done = Future[None](executor=executor)

    def changed(parameter: ParameterMessage) -> None:
        calls.append(("parameter", parameter.value.integer_value))

    def happened(event: ParameterEvent) -> None:
        found = {each.name for each in ParameterEventHandler.get_parameters_from_event(event)}
        calls.append((event.node, found))
        done.set_result(None)

    removed = handler.add_parameter_callback("speed", "", changed)
    handler.add_parameter_callback("speed", "target", changed)
    handler.add_parameter_callback("speed", "/ns/target", lambda _: calls.append(("newer", None)))
    handler.add_parameter_event_callback(happened)
    useless = handler.add_parameter_event_callback(print)
    handler.remove_parameter_callback(removed)
    handler.remove_parameter_event_callback(useless)
    with pytest.raises(RuntimeError, match="removed already"):
        handler.remove_parameter_callback(removed)
    client.node.get_topic_names_and_types()  # answered after the subscription has been matched
    target.set_parameters([Parameter("speed", value=9)])
    executor.spin_until_future_complete(done, DEADLINE_SEC)
    assert calls == [("newer", None), ("parameter", 9), ("/ns/target", {"speed"})]
    handler.destroy()
    assert handler.parameter_event_subscription not in client.node.subscriptions


def test_events_are_taken_apart() -> None:
    """Only the parameters that an event gives values are found, and only those of its node."""
    speed = Parameter("speed", value=1).to_parameter_msg()
    event = ParameterEvent(
        node="/a", changed_parameters=[speed], deleted_parameters=[ParameterMessage(name="old")]
    )
    find = ParameterEventHandler.get_parameter_from_event
    assert find(event, "speed", "/a") is speed
    assert find(event, "old", "/a") is None
    assert find(event, "speed", "/b") is None


def test_every_change_can_be_subscribed(
    target: Node, client: AsyncParameterClient, executor: SingleThreadedExecutor
) -> None:
    """`on_parameter_event` subscribes to the changes of all nodes."""
    seen = Future[ParameterEvent](executor=executor)

    def happened(event: ParameterEvent) -> None:
        if event.node == "/ns/target":
            seen.set_result(event)

    client.on_parameter_event(happened)
    client.node.get_topic_names_and_types()  # answered after the subscription has been matched
    target.set_parameters([Parameter("speed", value=9)])
    assert result(executor, seen).changed_parameters[0].name == "speed"

"""Actions as ROS 2 programs use them: goals, feedback, cancellation, and callbacks that fail."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

import pytest

from actors.interfaces.action_msgs.msg import GoalStatus
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.ros.rclpy.action import (
    ActionClient,
    ActionServer,
    CancelResponse,
    GoalResponse,
    get_action_client_names_and_types_by_node,
    get_action_names_and_types,
    get_action_server_names_and_types_by_node,
)
from actors.ros.rclpy.action.client import FEEDBACK_DEPTH
from actors.ros.rclpy.action.server import RCLError
from actors.ros.rclpy.callback_groups import ReentrantCallbackGroup
from actors.ros.rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from actors.ros.rclpy.node import Node, NodeNameNonExistentError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from actors.ros.rclpy.context import Context
    from actors.ros.rclpy.executors import Executor
    from actors.ros.rclpy.task import Future

DEADLINE_SEC = 20.0


@pytest.fixture
def executor(context: Context) -> Iterator[SingleThreadedExecutor]:
    """An executor of the context."""
    with SingleThreadedExecutor(context=context) as executor:
        yield executor


@pytest.fixture
def node(context: Context, executor: SingleThreadedExecutor) -> Node:
    """A node of the executor."""
    node = Node("node", context=context)
    executor.add_node(node)
    return node


def spun(executor: Executor, future: Future[Any]) -> Any:
    """Spin until a future is done; return its result."""
    executor.spin_until_future_complete(future, DEADLINE_SEC)
    assert future.done()
    return future.result()


def succeed(goal: Any) -> Fibonacci.Result:
    """Count to the order, with feedback for each step."""
    for number in range(goal.request.order):
        goal.publish_feedback(Fibonacci.Feedback(sequence=[number]))
    goal.succeed()
    return Fibonacci.Result(sequence=[goal.request.order])


def test_a_goal_gives_feedback_and_a_result(node: Node, executor: SingleThreadedExecutor) -> None:
    """All callbacks run in the thread that spins, and the feedback before the result."""
    threads, seen = set[int](), list[int]()

    def note(message: Any) -> None:
        threads.add(threading.get_ident())
        seen.append(message.feedback.sequence[0])

    def execute(goal: Any) -> Fibonacci.Result:
        threads.add(threading.get_ident())
        return succeed(goal)

    client = ActionClient(node, Fibonacci, "count")
    assert not client.wait_for_server(0)
    early = client.send_goal_async(Fibonacci.Goal(order=5), feedback_callback=note)
    ActionServer(node, Fibonacci, "count", execute)
    handle = spun(executor, early)
    assert handle.accepted
    response = spun(executor, handle.get_result_async())
    assert (response.status, list(response.result.sequence)) == (GoalStatus.STATUS_SUCCEEDED, [5])
    assert seen == [0, 1, 2, 3, 4]
    assert threads == {threading.get_ident()}


def test_a_goal_is_known_before_its_feedback(node: Node, executor: SingleThreadedExecutor) -> None:
    """Feedback that arrives before the goal's future is done comes after it."""
    seen = list[object]()
    ActionServer(node, Fibonacci, "count", succeed)
    client = ActionClient(node, Fibonacci, "count")
    sent = client.send_goal_async(
        Fibonacci.Goal(order=3), lambda message: seen.append(message.feedback.sequence[0])
    )

    sent.add_done_callback(lambda _: seen.append("known"))
    spun(executor, spun(executor, sent).get_result_async())
    assert seen == ["known", 0, 1, 2]


def test_all_callbacks_get_the_same_handle(node: Node, executor: SingleThreadedExecutor) -> None:
    """Programs set attributes on it; what a goal's state does not allow is an RCLError."""
    goals = list[Any]()

    def accepted(goal: Any) -> None:
        goal.label = "mine"
        goals.append(goal)
        goal.execute()

    def execute(goal: Any) -> Fibonacci.Result:
        assert goal.label == "mine"
        goals.append(goal)
        with pytest.raises(RCLError):
            goal.canceled()
        goal.succeed()
        return Fibonacci.Result()

    ActionServer(node, Fibonacci, "count", execute, handle_accepted_callback=accepted)
    client = ActionClient(node, Fibonacci, "count")
    for _ in range(2):
        handle = spun(executor, client.send_goal_async(Fibonacci.Goal()))
        response = spun(executor, handle.get_result_async())
        assert repr(response.status) == repr(GoalStatus.STATUS_SUCCEEDED)
    assert goals[0] is goals[1]
    assert goals[2] is goals[3]
    assert goals[0] is not goals[2]


def test_the_result_of_a_rejected_goal_is_unknown(node: Node, executor: SingleThreadedExecutor) -> None:
    """It is empty, and no error."""
    ActionServer(node, Fibonacci, "count", succeed, goal_callback=lambda goal: GoalResponse.REJECT)
    handle = spun(executor, ActionClient(node, Fibonacci, "count").send_goal_async(Fibonacci.Goal()))
    assert not handle.accepted
    response = spun(executor, handle.get_result_async())
    assert (response.status, list(response.result.sequence)) == (GoalStatus.STATUS_UNKNOWN, [])


def test_feedback_that_nobody_takes_is_bounded(node: Node, executor: SingleThreadedExecutor) -> None:
    """The newest messages are kept, as many as rclpy's depth."""
    seen = list[int]()
    server = Node("server", context=node.context)
    ActionServer(server, Fibonacci, "count", succeed)
    client = ActionClient(node, Fibonacci, "count")
    with SingleThreadedExecutor(context=node.context) as other:
        other.add_node(server)
        thread = threading.Thread(target=other.spin)
        thread.start()
        sent = client.send_goal_async(
            Fibonacci.Goal(order=100), lambda message: seen.append(message.feedback.sequence[0])
        )
        # It needs nobody who spins, and its result follows all feedback before.
        assert client.send_goal(Fibonacci.Goal(order=1)) is not None
        spun(executor, spun(executor, sent).get_result_async())
        other.shutdown()
    thread.join(DEADLINE_SEC)
    assert seen == list(range(100 - FEEDBACK_DEPTH, 100))


def test_a_goal_is_cancelled_while_it_runs(context: Context, node: Node) -> None:
    """The execute callback, in a thread of the pool, sees the request."""

    def execute(goal: Any) -> Fibonacci.Result:
        while not goal.is_cancel_requested:
            cancelled.wait(0.001)
        goal.canceled()
        return Fibonacci.Result(sequence=[1])

    cancelled = threading.Event()
    server = Node("server", context=context)
    ActionServer(
        server,
        Fibonacci,
        "count",
        execute,
        callback_group=ReentrantCallbackGroup(),
        cancel_callback=lambda goal: CancelResponse.ACCEPT,
    )
    client = ActionClient(node, Fibonacci, "count")
    with MultiThreadedExecutor(3, context=context) as executor:
        executor.add_node(node)
        executor.add_node(server)
        handle = spun(executor, client.send_goal_async(Fibonacci.Goal(order=5)))
        answer = spun(executor, handle.cancel_goal_async())
        assert [each.goal_id for each in answer.goals_canceling] == [handle.goal_id]
        response = spun(executor, handle.get_result_async())
    assert (response.status, list(response.result.sequence)) == (GoalStatus.STATUS_CANCELED, [1])


def test_goals_are_refused_aborted_and_deferred(node: Node, executor: SingleThreadedExecutor) -> None:
    """By the goal callback; by an execute callback that raises (spinning goes on); by `execute` later."""
    deferred = list[Any]()

    def fail(goal: Any) -> Fibonacci.Result:
        raise ValueError("in an execute callback")

    server = ActionServer(
        node,
        Fibonacci,
        "count",
        fail,
        goal_callback=lambda goal: GoalResponse.REJECT if goal.order > 9 else GoalResponse.ACCEPT,
    )
    client = ActionClient(node, Fibonacci, "count")
    assert not spun(executor, client.send_goal_async(Fibonacci.Goal(order=10))).accepted
    aborted = spun(executor, client.send_goal_async(Fibonacci.Goal(order=1)))
    assert spun(executor, aborted.get_result_async()).status == GoalStatus.STATUS_ABORTED
    server.register_handle_accepted_callback(deferred.append)
    handle = spun(executor, client.send_goal_async(Fibonacci.Goal(order=1)))
    result = handle.get_result_async()
    deferred[0].execute(succeed)
    assert spun(executor, result).status == GoalStatus.STATUS_SUCCEEDED
    with pytest.raises(TypeError):
        client.send_goal_async(Fibonacci.Result())


def test_clients_and_servers_are_destroyed(node: Node, executor: SingleThreadedExecutor) -> None:
    """A result that was waited for ends with an error; the graph forgets both."""
    server = ActionServer(node, Fibonacci, "count", succeed, handle_accepted_callback=lambda goal: None)
    client = ActionClient(node, Fibonacci, "count")
    handle = spun(executor, client.send_goal_async(Fibonacci.Goal(order=1)))
    result = handle.get_result_async()
    server.destroy()
    with pytest.raises(Exception, match="count"):
        spun(executor, result)
    client.destroy()
    assert not [name for name, _ in node.get_topic_names_and_types() if "count" in name]


def test_actions_are_in_the_graph(node: Node) -> None:
    """The actions of all nodes, and those of one node, are found with their types."""
    ActionServer(node, Fibonacci, "count", succeed)
    other = Node("other", context=node.context)
    ActionClient(other, Fibonacci, "count")
    found = [("/count", ["example_interfaces/action/Fibonacci"])]
    assert get_action_names_and_types(node) == found
    assert get_action_server_names_and_types_by_node(other, node.get_name(), node.get_namespace()) == found
    assert get_action_client_names_and_types_by_node(node, "other", "/") == found
    with pytest.raises(NodeNameNonExistentError):
        get_action_client_names_and_types_by_node(node, "nobody", "/")

"""Actions: states of goals, and wrong answers of callbacks."""

from __future__ import annotations

from rclpy.action import ActionClient, ActionServer, CancelResponse, GoalResponse
from test_msgs.action import Fibonacci

from tests.real_ros.programs.errors import outcome
from tests.real_ros.programs.running import running_node, spin_until


def _run(node, **callbacks):
    """Send a goal to a server with these callbacks; return the goal's handle."""

    def execute(goal):
        goal.succeed()
        return Fibonacci.Result(sequence=[7])

    server = ActionServer(node, Fibonacci, "count", **{"execute_callback": execute, **callbacks})
    client = ActionClient(node, Fibonacci, "count")
    client.wait_for_server(timeout_sec=5.0)
    sent = client.send_goal_async(Fibonacci.Goal(order=1))
    spin_until(node, sent.done)
    return sent.result(), server, client


def goal():
    """Send a goal. Without its feedback, which rclpy may lose: a server need not have matched its clients."""
    with running_node() as node:
        handle, _, _ = _run(node)
        result = handle.get_result_async()
        spin_until(node, result.done)
        return [handle.accepted, result.result().status, list(result.result().result.sequence)]


def wrong_answers():
    """Answer goals with what is no answer."""

    def answer(value):
        with running_node() as node:
            return _run(node, goal_callback=lambda goal: value)[0].accepted

    return [answer(each) for each in (None, True, 2, "accept", GoalResponse.ACCEPT, GoalResponse.REJECT)]


def wrong_answers_to_cancellations():
    """Answer cancellations with what is no answer."""

    def answer(value):
        with running_node() as node:
            handle, _, _ = _run(
                node, handle_accepted_callback=lambda goal: None, cancel_callback=lambda goal: value
            )
            cancelling = handle.cancel_goal_async()
            spin_until(node, cancelling.done)
            return [cancelling.result().return_code, len(cancelling.result().goals_canceling)]

    return [answer(each) for each in (None, True, 2, "accept", CancelResponse.ACCEPT, CancelResponse.REJECT)]


def raising_goal_callback():
    """Let the goal callback raise."""
    with running_node() as node:

        def fail(goal):
            raise ZeroDivisionError

        return outcome(lambda: _run(node, goal_callback=fail)[0].accepted)


def wrong_result():
    """Return what is no result."""

    def result(value):
        with running_node() as node:

            def execute(goal):
                goal.succeed()
                return value

            handle, _, _ = _run(node, execute_callback=execute)
            future = handle.get_result_async()
            spin_until(node, future.done)
            return [future.result().status, list(future.result().result.sequence)]

    return [outcome(result, each) for each in (None, Fibonacci.Result(sequence=[1]))]


def raising_execution():
    """Let the execution raise."""
    with running_node() as node:

        def execute(goal):
            raise ZeroDivisionError

        handle, _, _ = _run(node, execute_callback=execute)
        future = handle.get_result_async()
        spin_until(node, future.done)
        return [future.result().status, list(future.result().result.sequence)]


def execution_without_an_end():
    """Return from the execution without a state."""
    with running_node() as node:
        handle, _, _ = _run(node, execute_callback=lambda goal: Fibonacci.Result(sequence=[4]))
        future = handle.get_result_async()
        spin_until(node, future.done)
        return [future.result().status, list(future.result().result.sequence)]


def states():
    """Change the state of a goal in a wrong order."""
    with running_node() as node:
        steps = []

        def execute(goal):
            steps.extend([goal.is_active, goal.is_cancel_requested, goal.status, outcome(goal.canceled)])
            goal.abort()
            steps.extend([goal.is_active, goal.status, outcome(goal.succeed), outcome(goal.execute)])
            return Fibonacci.Result()

        handle, _, _ = _run(node, execute_callback=execute)
        future = handle.get_result_async()
        spin_until(node, future.done)
        return [future.result().status, steps]


def wrong_messages():
    """Send what is no goal, and publish what is no feedback."""
    with running_node() as node:
        feedback = []

        def execute(goal):
            feedback.extend(outcome(goal.publish_feedback, each) for each in (None, Fibonacci.Goal()))
            goal.succeed()
            return Fibonacci.Result()

        handle, _, client = _run(node, execute_callback=execute)
        future = handle.get_result_async()
        spin_until(node, future.done)
        return [feedback, [outcome(client.send_goal_async, each) for each in (None, Fibonacci.Result())]]

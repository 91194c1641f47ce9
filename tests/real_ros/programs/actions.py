"""Actions: states of goals, and wrong answers of callbacks."""

from __future__ import annotations

from contextlib import contextmanager

from rclpy.action import ActionClient, ActionServer, CancelResponse, GoalResponse
from rclpy.executors import SingleThreadedExecutor
from test_msgs.action import Fibonacci

from tests.real_ros.programs.errors import outcome
from tests.real_ros.programs.running import running_node

SPIN_SEC = 10.0


@contextmanager
def _running():
    """Give a node, and what spins until a future is done: one executor, whose tasks execute the goals."""
    with running_node() as node:
        executor = SingleThreadedExecutor(context=node.context)
        executor.add_node(node)
        yield node, lambda future: executor.spin_until_future_complete(future, timeout_sec=SPIN_SEC)


def _run(node, spin, **callbacks):
    """Send a goal to a server with these callbacks; return the goal's handle."""

    def execute(goal):
        goal.succeed()
        return Fibonacci.Result(sequence=[7])

    server = ActionServer(node, Fibonacci, "count", **{"execute_callback": execute, **callbacks})
    client = ActionClient(node, Fibonacci, "count")
    client.wait_for_server(timeout_sec=5.0)
    sent = client.send_goal_async(Fibonacci.Goal(order=1))
    spin(sent)
    return sent.result(), server, client


def goal():
    """Send a goal. Without its feedback, which rclpy may lose: a server need not have matched its clients."""
    with _running() as (node, spin):
        handle, _, _ = _run(node, spin)
        result = handle.get_result_async()
        spin(result)
        return [handle.accepted, result.result().status, list(result.result().result.sequence)]


def early_feedback():
    """Publish feedback as soon as a goal is accepted: the client may know it only after the first."""
    with _running() as (node, spin):
        events = []

        def accept(goal):
            for number in range(3):
                goal.publish_feedback(Fibonacci.Feedback(sequence=[number]))
            goal.execute()

        def execute(goal):
            goal.succeed()
            return Fibonacci.Result()

        server = ActionServer(node, Fibonacci, "count", execute, handle_accepted_callback=accept)
        client = ActionClient(node, Fibonacci, "count")
        client.wait_for_server(timeout_sec=5.0)
        sent = client.send_goal_async(
            Fibonacci.Goal(order=1), lambda message: events.append(message.feedback.sequence[0])
        )
        sent.add_done_callback(lambda _: events.append("accepted"))
        spin(sent)
        spin(sent.result().get_result_async())
        server.destroy()
        known = events.index("accepted")
        # rclpy loses feedback of a server that does not know the client yet.
        numbers = events[:known] + events[known + 1 :]
        return [known <= 1, numbers == sorted(numbers)]


def wrong_answers():
    """Answer goals with what is no answer."""

    def answer(value):
        with _running() as (node, spin):
            return _run(node, spin, goal_callback=lambda goal: value)[0].accepted

    return [answer(each) for each in (None, True, 2, "accept", GoalResponse.ACCEPT, GoalResponse.REJECT)]


def wrong_answers_to_cancellations():
    """Answer cancellations with what is no answer."""

    def answer(value):
        with _running() as (node, spin):
            handle, _, _ = _run(
                node, spin, handle_accepted_callback=lambda goal: None, cancel_callback=lambda goal: value
            )
            cancelling = handle.cancel_goal_async()
            spin(cancelling)
            return [cancelling.result().return_code, len(cancelling.result().goals_canceling)]

    return [answer(each) for each in (None, True, 2, "accept", CancelResponse.ACCEPT, CancelResponse.REJECT)]


def raising_goal_callback():
    """Let the goal callback raise."""
    with _running() as (node, spin):

        def fail(goal):
            raise ZeroDivisionError

        return outcome(lambda: _run(node, spin, goal_callback=fail)[0].accepted)


def wrong_result():
    """Return what is no result."""

    def result(value):
        with _running() as (node, spin):

            def execute(goal):
                goal.succeed()
                return value

            handle, _, _ = _run(node, spin, execute_callback=execute)
            future = handle.get_result_async()
            spin(future)
            return [future.result().status, list(future.result().result.sequence)]

    return [outcome(result, each) for each in (None, Fibonacci.Result(sequence=[1]))]


def raising_execution():
    """Let the execution raise."""
    with _running() as (node, spin):

        def execute(goal):
            raise ZeroDivisionError

        handle, _, _ = _run(node, spin, execute_callback=execute)
        future = handle.get_result_async()
        spin(future)
        return [future.result().status, list(future.result().result.sequence)]


def execution_without_an_end():
    """Return from the execution without a state."""
    with _running() as (node, spin):
        handle, _, _ = _run(node, spin, execute_callback=lambda goal: Fibonacci.Result(sequence=[4]))
        future = handle.get_result_async()
        spin(future)
        return [future.result().status, list(future.result().result.sequence)]


def states():
    """Change the state of a goal in a wrong order."""
    with _running() as (node, spin):
        steps = []

        def execute(goal):
            steps.extend([goal.is_active, goal.is_cancel_requested, goal.status, outcome(goal.canceled)])
            goal.abort()
            steps.extend([goal.is_active, goal.status, outcome(goal.succeed), outcome(goal.execute)])
            return Fibonacci.Result()

        handle, _, _ = _run(node, spin, execute_callback=execute)
        future = handle.get_result_async()
        spin(future)
        return [future.result().status, steps]


def wrong_messages():
    """Send what is no goal, and publish what is no feedback."""
    with _running() as (node, spin):
        feedback = []

        def execute(goal):
            feedback.extend(outcome(goal.publish_feedback, each) for each in (None, Fibonacci.Goal()))
            goal.succeed()
            return Fibonacci.Result()

        handle, _, client = _run(node, spin, execute_callback=execute)
        future = handle.get_result_async()
        spin(future)
        return [feedback, [outcome(client.send_goal_async, each) for each in (None, Fibonacci.Result())]]

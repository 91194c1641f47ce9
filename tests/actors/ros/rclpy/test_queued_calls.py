"""Calls that the loop wants made where an executor spins: they hold up no shutdown."""

from __future__ import annotations

import gc
import subprocess
import sys
import time
from collections import deque
from typing import TYPE_CHECKING, Any, ClassVar

import pytest

from actors.errors import ServiceUnavailable
from actors.interfaces.action_msgs.msg import GoalStatus
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.std_srvs.srv import Trigger
from actors.node.node_runner import STOP_TIMEOUT_SEC
from actors.ros.rclpy import queued_calls
from actors.ros.rclpy.action.client import ActionClient
from actors.ros.rclpy.action.server import ActionServer
from actors.ros.rclpy.callback_groups import ReentrantCallbackGroup
from actors.ros.rclpy.executors import SingleThreadedExecutor
from actors.ros.rclpy.node import Node
from actors.ros.rclpy.queued_calls import QueuedCalls, RecentCalls
from tests.actors.ros.conftest import running_context

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.ros.rclpy.context import Context
    from actors.ros.rclpy.executors import Executor
    from actors.ros.rclpy.task import Future

DEADLINE_SEC = 20.0

EXIT = """
import atexit, threading, time
ended = []
atexit.register(lambda: print(time.monotonic() - ended[0]))
from actors.ros import finder
finder.install()
import rclpy
from std_srvs.srv import Trigger

def wait(request, response):
    begun.set()
    threading.Event().wait()

rclpy.init()
node = rclpy.create_node("node")
begun = threading.Event()
node.create_service(Trigger, "wait", wait)
node.create_client(Trigger, "wait").call_async(Trigger.Request())
threading.Thread(target=rclpy.spin, args=(node,), daemon=True).start()
begun.wait()
ended.append(time.monotonic())
"""


def spun(executor: Executor, future: Future[Any]) -> Any:
    """Spin until a future is done, and return its result."""
    executor.spin_until_future_complete(future, DEADLINE_SEC)
    assert future.done()
    return future.result()


def seconds(work: Callable[[], object]) -> float:
    """Return how long a call takes."""
    started = time.monotonic()
    work()
    return time.monotonic() - started


def test_a_request_without_an_answer_does_not_hold_up_a_shutdown(context: Context) -> None:
    """A handler shuts its own context down: its client gets an error at once."""
    took = list[float]()
    with running_context() as inner:
        server = Node("server", context=inner)

        def stop(request: Any, response: Any) -> Any:
            took.append(seconds(inner.shutdown))
            return response

        server.create_service(Trigger, "stop", stop)
        node = Node("client", context=context)
        client = node.create_client(Trigger, "stop")
        executor = SingleThreadedExecutor(context=inner)
        executor.add_node(server)
        reply = client.call_async(Trigger.Request())
        executor.spin_once(DEADLINE_SEC)
    assert took[0] < STOP_TIMEOUT_SEC / 2
    with SingleThreadedExecutor(context=context) as waiting:
        waiting.add_node(node)
        with pytest.raises(ServiceUnavailable):
            spun(waiting, reply)


def test_a_goal_that_runs_does_not_hold_up_a_shutdown(context: Context) -> None:
    """Its execute callback shuts its own context down, which aborts the goal."""
    took = list[float]()
    with running_context() as inner:
        server = Node("server", context=inner)

        def execute(goal: Any) -> Fibonacci.Result:
            took.append(seconds(inner.shutdown))
            return Fibonacci.Result()

        ActionServer(server, Fibonacci, "count", execute)
        client = ActionClient(Node("client", context=context), Fibonacci, "count")
        executor = SingleThreadedExecutor(context=inner)
        executor.add_node(server)
        client.send_goal_async(Fibonacci.Goal(order=1))
        while not took:
            executor.spin_once(DEADLINE_SEC)
    assert took[0] < STOP_TIMEOUT_SEC / 2


@pytest.mark.usefixtures("context")
@pytest.mark.processes
def test_a_request_without_an_answer_does_not_hold_up_the_end_of_a_program() -> None:
    """It may end without a shutdown, while a daemon thread spins."""
    program = subprocess.run(
        [sys.executable, "-c", EXIT], capture_output=True, text=True, timeout=60, check=True
    )
    assert float(program.stdout) < STOP_TIMEOUT_SEC / 2
    assert not program.stderr


def test_an_interrupted_goal_is_aborted(context: Context, caplog: pytest.LogCaptureFixture) -> None:
    """KeyboardInterrupt in an execute callback is for the thread that spins; it is no error to be logged."""
    node = Node("node", context=context)

    def execute(goal: Any) -> Fibonacci.Result:
        raise KeyboardInterrupt

    ActionServer(node, Fibonacci, "count", execute)
    client = ActionClient(node, Fibonacci, "count")
    with SingleThreadedExecutor(context=context) as executor:
        executor.add_node(node)
        sent = client.send_goal_async(Fibonacci.Goal(order=1))
        with pytest.raises(KeyboardInterrupt):  # before or after the client has got the handle
            executor.spin()
        assert spun(executor, spun(executor, sent).get_result_async()).status == GoalStatus.STATUS_ABORTED
    assert not caplog.records


def test_a_goal_begins_in_the_executor_that_the_node_has_then(context: Context) -> None:
    """The node is removed from the first one after that has taken the call, and before it makes it."""
    node, accepted = Node("node", context=context), list[Any]()

    def execute(goal: Any) -> Fibonacci.Result:
        goal.succeed()
        return Fibonacci.Result(sequence=[1])

    server = ActionServer(node, Fibonacci, "count", execute, handle_accepted_callback=accepted.append)
    client = ActionClient(node, Fibonacci, "count")
    first, second = SingleThreadedExecutor(context=context), SingleThreadedExecutor(context=context)
    with first, second:
        first.add_node(node)
        result = spun(first, client.send_goal_async(Fibonacci.Goal(order=1))).get_result_async()
        while not accepted:
            first.spin_once(DEADLINE_SEC)
        accepted[0].execute()
        task, entity, _ = first.wait_for_ready_callbacks(DEADLINE_SEC)
        assert entity is server
        first.remove_node(node)
        task()
        task.result()
        second.add_node(node)
        assert list(spun(second, result).result.sequence) == [1]


def test_an_error_that_comes_when_nobody_spins_is_not_logged(
    context: Context, caplog: pytest.LogCaptureFixture
) -> None:
    """The program ends with a call under way, whose server ends as well."""
    with running_context() as inner, SingleThreadedExecutor(context=inner) as executor:
        node = Node("client", context=inner)
        client = node.create_client(Trigger, "wait")
        executor.add_node(node)
        server = Node("server", context=context)
        server.create_service(Trigger, "wait", lambda request, response: response)
        assert client.wait_for_service(DEADLINE_SEC)
        client.call_async(Trigger.Request())
        server.destroy_node()
        task, entity, _ = executor.wait_for_ready_callbacks(DEADLINE_SEC)
        assert entity is client
    del task, entity, _, client, node
    gc.collect()
    assert not [each for each in caplog.records if each.name == "asyncio"]


class InterruptedDeque(deque[Any]):
    """A deque in which another thread runs when its length is asked for: each of `interrupts` once."""

    interrupts: ClassVar[list[Callable[[], object]]] = []

    def __len__(self) -> int:
        length = super().__len__()
        if self.interrupts:
            self.interrupts.pop()()
        return length


def test_the_last_call_is_made(context: Context, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also if it is added just as the executor makes the one before it."""
    monkeypatch.setattr(queued_calls, "deque", InterruptedDeque)
    calls, made = QueuedCalls(context.thread, ReentrantCallbackGroup()), list[str]()
    recent = RecentCalls(calls, 1)

    def make_next() -> None:
        call = calls.take()
        assert call is not None
        call()

    recent.add(lambda: made.append("before"))
    InterruptedDeque.interrupts.append(make_next)
    recent.add(lambda: made.append("last"))
    assert made == ["before"]
    make_next()
    assert made == ["before", "last"]
    assert not calls.has_work()
    assert not recent.dropped

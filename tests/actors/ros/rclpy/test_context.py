"""Contexts and forks: a child has none of its parent's nodes."""

from __future__ import annotations

import asyncio
import os
import subprocess
import sys
from typing import Any, Self

import pytest

from actors.ros.rclpy._rclpy_pybind11 import RCLError, UnknownROSArgsError
from actors.ros.rclpy.context import Context
from actors.ros.rclpy.exceptions import InvalidHandle, NotInitializedException
from actors.ros.rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from actors.ros.rclpy.node import Node
from actors.ros.rclpy.task import Future
from tests.actors.ros.conftest import running_context

DEADLINE_SEC = 20.0

CHILD = """
import os, signal, sys
from actors.ros import finder
finder.install()
import rclpy
from std_msgs.msg import String

rclpy.init()
parents = rclpy.create_node("parent")
publisher = parents.create_publisher(String, "t", 1)
if os.fork() == 0:
    for use in (lambda: publisher.publish(String()), lambda: rclpy.spin(parents)):
        try:
            use()
        except RuntimeError as error:
            print(type(error).__name__, error)
    assert not rclpy.ok()
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
    with rclpy.init():
        with rclpy.create_node("child") as node:
            print(sorted(node.get_node_names()))
            sys.stdout.flush()
    os._exit(0)
os.wait()
print(parents.get_node_names())
"""

EXIT = """
import threading
from actors.ros import finder
finder.install()
import rclpy
from rclpy.executors import {kind}
from std_msgs.msg import String

def publish():
    begun.set()
    while {endless}:
        publisher.publish(String())

rclpy.init()
node = rclpy.create_node("node")
begun = threading.Event()
publisher = node.create_publisher(String, "t", 1)
node.create_timer(0.0, publish)
executor = {kind}()
executor.add_node(node)
threading.Thread(target=executor.spin, daemon=True).start()
begun.wait()
"""


class Failing:
    """A context in a thread that fails on request."""

    async def __aenter__(self) -> Self:
        self._task = asyncio.current_task()
        return self

    def fail(self) -> None:
        """Fail, as a node does."""
        assert self._task is not None
        self._task.cancel()

    async def __aexit__(self, *error: object) -> None:
        raise ValueError("failed")


def test_a_context_is_of_no_use_in_a_forked_child(context: Context) -> None:
    """Whatever uses it says why, and shutting it down touches nothing of the parent's."""
    node = Node("node", context=context)
    context.forked()
    with pytest.raises(RuntimeError, match=r"forked after rclpy.init\(\)"):
        context.ok()
    with pytest.raises(RuntimeError, match=r"make nodes in the child"):
        Node("other", context=context)
    with pytest.raises(RuntimeError, match="forked"), SingleThreadedExecutor(context=context) as executor:
        executor.spin()
    context.try_shutdown()
    assert "node" in node.get_node_names()
    node.destroy_node()


def test_the_domain_is_the_arguments_or_the_environments(monkeypatch: pytest.MonkeyPatch) -> None:
    """0 given to `init` wins over the environment."""
    monkeypatch.setenv("CALLBOARD_DOMAIN", "7")
    for given, expected in ((None, 7), (0, 0), (3, 3)):
        context = Context()
        context.init([], initialize_logging=False, domain_id=given)
        assert context.get_domain_id() == expected
        context.shutdown()
    monkeypatch.delenv("CALLBOARD_DOMAIN")
    monkeypatch.setenv("ROS_DOMAIN_ID", "8")
    context = Context()
    context.init([], initialize_logging=False)
    node = Node("there", context=context)
    assert context.get_domain_id() == node.context.domain_id == 8
    context.shutdown()


def test_wrong_arguments_are_errors_of_rclpy(context: Context) -> None:
    """A program may catch them by rclpy's names."""
    for error, arguments in ((UnknownROSArgsError, ["--nothing"]), (RCLError, ["-r", "no rule"])):
        with pytest.raises(error):
            Context().init(["--ros-args", *arguments])
        with pytest.raises(error):
            Node("node", context=context, cli_args=["--ros-args", *arguments])


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
@pytest.mark.usefixtures("context")
@pytest.mark.processes
def test_a_forked_child_makes_nodes_of_its_own() -> None:
    """What it has from its parent raises; the parent's node goes on."""
    child = subprocess.run(
        [sys.executable, "-c", CHILD], capture_output=True, text=True, timeout=60, check=True
    )
    lines = child.stdout.splitlines()
    assert lines[0].startswith(InvalidHandle.__name__)
    assert "runs in the parent process" in lines[0]
    assert "forked after rclpy.init()" in lines[1]
    assert lines[2:] == ["['child', 'parent']", "['parent']"], child.stdout + child.stderr


@pytest.mark.parametrize("kind", [SingleThreadedExecutor, MultiThreadedExecutor])
def test_a_failure_of_the_thread_ends_the_context(
    context: Context, kind: type[SingleThreadedExecutor | MultiThreadedExecutor]
) -> None:
    """Spinning raises the error, a shutdown does not; the next context has another thread."""
    node, thread, failing = Node("node", context=context), context.thread, Failing()
    thread.enter(failing)
    executor = kind(context=context)
    executor.add_node(node)
    executor.create_task(thread.post, failing.fail)
    with pytest.raises(ValueError, match="failed"):
        executor.spin_until_future_complete(Future[None](), DEADLINE_SEC)
    assert not context.ok()
    with pytest.raises(ValueError, match="failed"):
        executor.spin()
    with pytest.raises(NotInitializedException):
        Node("other", context=context)
    context.shutdown()
    assert executor.shutdown(DEADLINE_SEC)
    with pytest.raises(ValueError, match="failed"):
        thread.stop()
    with running_context() as later:
        assert Node("later", context=later).get_node_names() == ["later"]


def test_a_node_that_is_made_during_a_shutdown_is_destroyed(context: Context) -> None:
    """Whoever makes it gets an error, and the graph has no such node."""
    watching = Node("watching", context=context)

    class Late(Node):
        def create_service(self, *args: Any, **options: Any) -> Any:
            """Shut down before the node is complete."""
            self.context.try_shutdown()
            return super().create_service(*args, **options)

    with running_context() as inner, pytest.raises(NotInitializedException):
        Late("late", context=inner)
    assert watching.get_node_names() == ["watching"]


@pytest.mark.parametrize(
    ("kind", "endless"),
    [
        (SingleThreadedExecutor, True),
        (SingleThreadedExecutor, False),
        (MultiThreadedExecutor, False),  # Python waits for the threads of pools
    ],
)
@pytest.mark.usefixtures("context")
@pytest.mark.processes
def test_a_program_ends_silently_while_a_daemon_thread_spins(kind: type[object], *, endless: bool) -> None:
    """It need not shut down; a callback may be publishing as everything ends."""
    program = subprocess.run(
        [sys.executable, "-c", EXIT.format(kind=kind.__name__, endless=endless)],
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    assert not program.stderr

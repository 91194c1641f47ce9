"""Contexts and forks: a child has none of its parent's nodes."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from actors.ros.rclpy.context import Context
from actors.ros.rclpy.exceptions import InvalidHandle
from actors.ros.rclpy.executors import SingleThreadedExecutor
from actors.ros.rclpy.node import Node

CHILD = """
import os, sys
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
    with rclpy.init():
        with rclpy.create_node("child") as node:
            print(sorted(node.get_node_names()))
            sys.stdout.flush()
    os._exit(0)
os.wait()
print(parents.get_node_names())
"""


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


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
@pytest.mark.usefixtures("context")
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

"""Nodes for the programs: each program has a context of its own, so that none sees what another has left."""

from __future__ import annotations

from contextlib import contextmanager

from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

STEPS = 200
STEP_SEC = 0.05


@contextmanager
def running_node(*ros_args, name="probe", **options):
    """Give a node, and end it and its context.

    Args:
        *ros_args: What follows `--ros-args`.
        name: The node's name.
        **options: Those of `Node`.
    """
    context = Context()
    context.init(["--ros-args", *ros_args] if ros_args else [])
    try:
        node = Node(name, context=context, **options)
        yield node
        node.destroy_node()
    finally:
        context.shutdown()


def spin_until(node, condition):
    """Run the callbacks of a node until a condition is true; raise TimeoutError if it does not become so."""
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    try:
        for _ in range(STEPS):
            if condition():
                return
            executor.spin_once(timeout_sec=STEP_SEC)
    finally:
        executor.remove_node(node)
    raise TimeoutError

"""Contexts that are shut down while threads spin, and before."""

from __future__ import annotations

import sys
import threading

import rclpy
from rclpy.context import Context
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.task import Future

from tests.real_ros.programs.errors import outcome

JOIN_SEC = 10.0


def _while_spinning(spin, end=rclpy.shutdown):
    """Return what `spin(node)` of another thread returns or raises when this thread ends the context."""
    rclpy.init(args=[])
    interval = sys.getswitchinterval()
    # In rclpy the thread that spins would otherwise see the end half done, from time to time.
    sys.setswitchinterval(JOIN_SEC)
    try:
        node, spins = rclpy.create_node("probe"), threading.Event()

        def tick():
            timer.cancel()
            spins.set()

        timer = node.create_timer(0.001, tick)
        ended = []
        thread = threading.Thread(target=lambda: ended.append(outcome(spin, node)), daemon=True)
        thread.start()
        spins.wait(JOIN_SEC)
        end()
        thread.join(JOIN_SEC)
        return ended
    finally:
        sys.setswitchinterval(interval)
        rclpy.try_shutdown()


def spin():
    """Spin a node."""
    return _while_spinning(rclpy.spin)


def spin_and_try_shutdown():
    """Spin a node, and end by `try_shutdown`."""
    return _while_spinning(rclpy.spin, rclpy.try_shutdown)


def spin_and_end_of_context():
    """Spin a node, and end the context by its own method."""
    return _while_spinning(rclpy.spin, lambda: rclpy.utilities.get_default_context().shutdown())


def spin_once():
    """Spin a node once and again, without a limit and with one."""

    def spin_once(timeout_sec):
        def spin(node):
            while rclpy.ok():
                rclpy.spin_once(node, timeout_sec=timeout_sec)

        return _while_spinning(spin)

    return [spin_once(None), spin_once(JOIN_SEC)]


def spin_until_future_complete():
    """Spin until a future is done that never is."""
    return _while_spinning(lambda node: rclpy.spin_until_future_complete(node, Future()))


def spin_with_executors():
    """Spin a node with executors of the program."""
    return [
        _while_spinning(lambda node: rclpy.spin(node, SingleThreadedExecutor())),
        _while_spinning(lambda node: rclpy.spin(node, MultiThreadedExecutor(2))),
    ]


def executors_of_the_program():
    """Spin executors of the program."""

    def spin(method):
        def spin(node):
            executor = SingleThreadedExecutor()
            executor.add_node(node)
            method(executor)

        return _while_spinning(spin)

    return [
        spin(SingleThreadedExecutor.spin),
        spin(lambda executor: executor.spin_until_future_complete(Future())),
    ]


def in_a_callback():
    """Shut down in a callback, of the global executor and of another one."""

    def spin(*executor):
        rclpy.init(args=[])
        node = rclpy.create_node("probe")
        node.create_timer(0.001, rclpy.shutdown)
        return outcome(lambda: rclpy.spin(node, *(each() for each in executor)))

    return [spin(), spin(SingleThreadedExecutor)]


def too_late():
    """Spin a node after the end of its context."""
    rclpy.init(args=[])
    node = rclpy.create_node("probe")
    rclpy.shutdown()
    return [
        outcome(rclpy.spin, node),
        outcome(lambda: rclpy.spin_once(node, timeout_sec=0.0)),
        outcome(lambda: rclpy.spin_until_future_complete(node, Future(), timeout_sec=0.0)),
    ]


def too_late_with_an_executor():
    """Spin an executor after the end of its context."""
    rclpy.init(args=[])
    node, executor = rclpy.create_node("probe"), SingleThreadedExecutor()
    executor.add_node(node)
    rclpy.shutdown()
    return outcome(lambda: executor.spin_once(timeout_sec=0.0))


def executors_without_a_context():
    """Make executors before the beginning and after the end of their context."""
    early, late = Context(), Context()
    late.init([])
    late.shutdown()
    return [outcome(lambda: SingleThreadedExecutor(context=each)) for each in (early, late)]  # noqa: B023

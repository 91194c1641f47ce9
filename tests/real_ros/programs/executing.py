"""Executors and their futures: what runs where, how often, and what ends it."""

from __future__ import annotations

import threading

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.task import Future

from tests.real_ros.programs.errors import outcome
from tests.real_ros.programs.running import running_node

WAIT_SEC = 10.0
SHORT_SEC = 0.05


def nodes_of_executors():
    """Add a node twice, to two executors, and remove it."""
    with running_node() as node:
        first, second = (SingleThreadedExecutor(context=node.context) for _ in range(2))
        results = [first.add_node(node), first.add_node(node), len(first.get_nodes())]
        results += [second.add_node(node), len(first.get_nodes()), node.executor is second]
        first.remove_node(node)
        results += [len(first.get_nodes()), node.executor is second]
        second.remove_node(node)
        results += [len(second.get_nodes()), outcome(second.remove_node, node), outcome(first.add_node, 7)]
        return results


def node_that_moves():
    """A callback runs in the executor that has the node now."""
    with running_node() as node:
        seen = []
        guard = node.create_guard_condition(lambda: seen.append(threading.current_thread().name))
        first, second = (SingleThreadedExecutor(context=node.context) for _ in range(2))
        first.add_node(node)
        guard.trigger()
        first.spin_once(timeout_sec=WAIT_SEC)
        second.add_node(node)
        guard.trigger()
        second.spin_once(timeout_sec=WAIT_SEC)
        first.spin_once(timeout_sec=SHORT_SEC)
        second.remove_node(node)
        return len(seen)


def callbacks_of_a_future_with_an_executor():
    """They run when the executor spins, and those added afterwards as well."""
    with running_node() as node:
        executor = SingleThreadedExecutor(context=node.context)
        seen = []
        future = Future(executor=executor)
        future.add_done_callback(lambda future: seen.append(["before", future.result()]))
        future.set_result(1)
        counts = [len(seen)]
        executor.spin_once(timeout_sec=SHORT_SEC)
        counts.append(len(seen))
        future.add_done_callback(lambda future: seen.append(["after", future.result()]))
        counts.append(len(seen))
        executor.spin_once(timeout_sec=SHORT_SEC)
        counts.append(len(seen))
        return [counts, seen]


def future_that_is_set_twice():
    """The second outcome replaces the first; callbacks are called once."""
    future, seen = Future(), []
    future.add_done_callback(lambda future: seen.append(future.result()))
    future.set_result(1)
    future.set_result(2)
    results = [future.result(), list(seen)]
    future.set_exception(KeyError("late"))
    results += [outcome(future.result), outcome(future.exception) is not None, list(seen)]
    future.cancel()
    return [*results, future.cancelled()]


def callback_of_a_future_that_raises():
    """The others are called, whether there is an executor or not."""
    with running_node() as node:
        seen = []

        def fail(future):
            raise KeyError("wrong")

        alone = Future()
        for each in (fail, lambda future: seen.append("alone")):
            alone.add_done_callback(each)
        results = [outcome(alone.set_result, 1), list(seen)]
        results.append(outcome(alone.add_done_callback, fail))
        executor = SingleThreadedExecutor(context=node.context)
        with_executor = Future(executor=executor)
        for each in (fail, lambda future: seen.append("with an executor")):
            with_executor.add_done_callback(each)
        results.append(outcome(with_executor.set_result, 1))
        results += [outcome(executor.spin_once, timeout_sec=SHORT_SEC) for _ in range(2)]
        return [*results, seen]


def shutdown_of_an_executor():
    """It ends spins, and later ones do nothing."""
    with running_node() as node:
        executor = SingleThreadedExecutor(context=node.context)
        executor.add_node(node)
        timer = node.create_timer(0.01, executor.shutdown)
        results = [outcome(executor.spin)]
        timer.destroy()
        results += [outcome(executor.shutdown), len(executor.get_nodes())]
        seen = []
        guard = node.create_guard_condition(lambda: seen.append("ran"))
        guard.trigger()
        results += [outcome(executor.spin_once, timeout_sec=SHORT_SEC), seen]
        return results


def shutdown_that_waits():
    """A pool's executor waits for a callback that runs, for a time."""
    with running_node() as node:
        began, release = threading.Event(), threading.Event()

        def block():
            began.set()
            release.wait(WAIT_SEC)

        guard = node.create_guard_condition(block)
        executor = MultiThreadedExecutor(2, context=node.context)
        executor.add_node(node)
        guard.trigger()
        executor.spin_once(timeout_sec=WAIT_SEC)
        began.wait(WAIT_SEC)
        results = [executor.shutdown(timeout_sec=SHORT_SEC, wait_for_threads=False)]
        release.set()
        results.append(executor.shutdown(timeout_sec=WAIT_SEC))
        return results


def coroutines_that_wait_for_one_another():
    """Tasks that await futures of others, in one executor."""
    with running_node() as node:
        executor = SingleThreadedExecutor(context=node.context)
        gate, seen = Future(), []

        async def first():
            seen.append("first waits")
            seen.append(await gate)
            return "first"

        async def second(task):
            seen.append("second waits")
            seen.append(await task)
            return "second"

        one = executor.create_task(first())
        two = executor.create_task(second, one)
        executor.create_task(gate.set_result, "gate")
        executor.spin_until_future_complete(two, timeout_sec=WAIT_SEC)
        return [seen, one.result(), two.result()]


def coroutine_that_awaits_a_failure():
    """The error of a future is raised where it is awaited."""
    with running_node() as node:
        executor = SingleThreadedExecutor(context=node.context)
        failed, cancelled = Future(), Future()
        failed.set_exception(KeyError("wrong"))
        cancelled.cancel()

        async def wait(future):
            try:
                return ["result", await future]
            except KeyError:
                return ["raised"]

        tasks = [executor.create_task(wait, each) for each in (failed, cancelled)]
        for task in tasks:
            executor.spin_until_future_complete(task, timeout_sec=WAIT_SEC)
        return [task.result() for task in tasks]


def coroutine_callbacks_hold_their_group():
    """Another callback of an exclusive group waits for the coroutine; one of a reentrant group does not."""
    results = []
    for group in (MutuallyExclusiveCallbackGroup(), ReentrantCallbackGroup()):
        with running_node() as node:
            gate, seen = Future(), []

            async def wait(gate=gate, seen=seen):
                seen.append("waits")
                await gate
                seen.append("goes on")

            guards = [
                node.create_guard_condition(each, callback_group=group)
                for each in (wait, lambda seen=seen: seen.append("other"))
            ]
            executor = SingleThreadedExecutor(context=node.context)
            executor.add_node(node)
            guards[0].trigger()
            executor.spin_once(timeout_sec=WAIT_SEC)
            guards[1].trigger()
            for _ in range(3):
                executor.spin_once(timeout_sec=SHORT_SEC)
            before = list(seen)
            gate.set_result(None)
            for _ in range(4):
                executor.spin_once(timeout_sec=SHORT_SEC)
            executor.remove_node(node)
            results.append([before, sorted(seen)])
    return results


def spins_from_callbacks():
    """Spin another executor, and the same one, in a callback."""
    with running_node() as node:
        other = Node("other", context=node.context)
        executor, inner = (SingleThreadedExecutor(context=node.context) for _ in range(2))
        executor.add_node(node)
        inner.add_node(other)
        seen = []
        inner_guard = other.create_guard_condition(lambda: seen.append("inner"))

        def spin_inner():
            inner_guard.trigger()
            inner.spin_once(timeout_sec=WAIT_SEC)
            seen.append("outer")

        guard = node.create_guard_condition(spin_inner)
        guard.trigger()
        executor.spin_once(timeout_sec=WAIT_SEC)
        other.destroy_node()
        return seen


def timers_that_change():
    """A timer that is cancelled, reset, and gets another period."""
    with running_node() as node:
        seen = []
        executor = SingleThreadedExecutor(context=node.context)
        executor.add_node(node)
        first = node.create_timer(1000.0, lambda: seen.append("first"))
        results = [first.is_canceled(), first.is_ready()]
        first.cancel()
        results += [first.is_canceled(), first.is_ready(), outcome(first.time_until_next_call)]
        first.reset()
        results += [first.is_canceled(), first.time_until_next_call() > 0]
        first.timer_period_ns = 1_000_000
        results.append(first.timer_period_ns)
        first.reset()
        while not seen:
            executor.spin_once(timeout_sec=WAIT_SEC)
        return [*results, seen[0]]


def arguments_of_executors():
    """Executors of wrong arguments."""
    with running_node() as node:
        wrong = [
            outcome(MultiThreadedExecutor, 0, context=node.context) is None,
            outcome(SingleThreadedExecutor, context=7),
        ]
        executor = SingleThreadedExecutor(context=node.context)
        results = [executor.spin_once(timeout_sec=0), executor.spin_once(timeout_sec=-0.0)]
        return [wrong[1], results, outcome(executor.spin_once, timeout_sec="1")]

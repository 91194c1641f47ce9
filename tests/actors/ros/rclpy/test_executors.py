"""Executors: order, threads, callback groups, coroutines, timeouts and the ends of spinning."""

from __future__ import annotations

import asyncio
import gc
import threading
import time
import weakref
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

import pytest

from actors.interfaces.std_msgs.msg import String
from actors.ros.rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from actors.ros.rclpy.executors import (
    ExternalShutdownException,
    MultiThreadedExecutor,
    SingleThreadedExecutor,
    TimeoutException,
    await_or_execute,
)
from actors.ros.rclpy.node import Node
from actors.ros.rclpy.task import Future

if TYPE_CHECKING:
    from collections.abc import Iterator

    from actors.ros.rclpy.context import Context
    from actors.ros.rclpy.executors import Executor

DEADLINE_SEC = 20.0


@pytest.fixture
def node(context: Context) -> Node:
    """A node of the context."""
    return Node("node", context=context)


@pytest.fixture
def executor(context: Context) -> Iterator[SingleThreadedExecutor]:
    """An executor of the context."""
    with SingleThreadedExecutor(context=context) as executor:
        yield executor


def spin_until(executor: Executor, future: Future[Any]) -> None:
    """Spin until a future is done."""
    executor.spin_until_future_complete(future, DEADLINE_SEC)
    assert future.done()


def test_callbacks_run_in_the_thread_that_spins(node: Node, executor: SingleThreadedExecutor) -> None:
    """Messages, timers, guard conditions and tasks: none runs elsewhere, or without spinning."""
    threads, done = list[int](), Future[None](executor=executor)

    def note(*args: object) -> None:
        threads.append(threading.get_ident())
        if len(threads) == 4:
            done.set_result(None)

    def tick() -> None:
        timer.cancel()
        note()

    timer = node.create_timer(0.001, tick)
    guard = node.create_guard_condition(note)
    node.create_subscription(String, "t", note, 10)
    publisher = node.create_publisher(String, "t", 10)
    executor.add_node(node)
    executor.create_task(note)
    guard.trigger()
    publisher.publish(String(data="x"))
    assert not threads
    spin_until(executor, done)
    assert threads == [threading.get_ident()] * 4


def test_spin_once_runs_one_callback(node: Node, executor: SingleThreadedExecutor) -> None:
    """With no work it returns when the time is over."""
    seen = list[str]()
    guard = node.create_guard_condition(lambda: seen.append("guard"))
    executor.add_node(node)
    executor.create_task(seen.append, "task")
    guard.trigger()
    executor.spin_once()
    assert len(seen) == 1
    executor.spin_once(0)
    assert len(seen) == 2
    started = time.monotonic()
    executor.spin_once(0.01)
    assert time.monotonic() - started >= 0.01
    assert len(seen) == 2


def test_an_error_in_a_callback_is_raised_by_spin(node: Node, executor: SingleThreadedExecutor) -> None:
    """The group is free again afterwards."""
    seen = list[int]()

    def fail() -> None:
        seen.append(1)
        raise ValueError("in a callback")

    guard = node.create_guard_condition(fail)
    executor.add_node(node)
    for _ in range(2):
        guard.trigger()
        with pytest.raises(ValueError, match="in a callback"):
            executor.spin_once(DEADLINE_SEC)
    assert len(seen) == 2


def test_a_coroutine_callback_waits_for_futures(node: Node, executor: SingleThreadedExecutor) -> None:
    """Meanwhile its group runs nothing else, and other groups do."""
    seen, future, done = list[str](), Future[str](), Future[None](executor=executor)

    async def wait() -> None:
        seen.append("begin")
        seen.append(str(await future))

    async def finish() -> None:
        seen.append("same group")
        done.set_result(None)

    first, second = node.create_guard_condition(wait), node.create_guard_condition(finish)
    other = node.create_guard_condition(lambda: seen.append("other group"), ReentrantCallbackGroup())
    executor.add_node(node)
    first.trigger()
    executor.spin_once(DEADLINE_SEC)
    second.trigger()
    other.trigger()
    executor.spin_once(0)
    executor.spin_once(0)
    assert seen == ["begin", "other group"]
    threading.Thread(target=future.set_result, args=("result",)).start()
    spin_until(executor, done)
    assert seen == ["begin", "other group", "result", "same group"]


def test_rclpy_futures_can_be_awaited_in_asyncio(node: Node, executor: SingleThreadedExecutor) -> None:
    """A coroutine of a loop that also spins gets the result."""
    future = Future[int](executor=executor)
    node.create_timer(0.001, lambda: future.set_result(8))
    executor.add_node(node)

    async def spin() -> None:
        while not future.done():
            executor.spin_once(0)
            await asyncio.sleep(0)

    async def main() -> int | None:
        spinning = asyncio.create_task(spin())
        result = await future
        await spinning
        return result

    assert asyncio.run(asyncio.wait_for(main(), DEADLINE_SEC)) == 8


def test_a_pool_runs_reentrant_callbacks_at_the_same_time(context: Context, node: Node) -> None:
    """Two callbacks meet in a barrier; those of a mutually exclusive group never overlap."""
    barrier, done = threading.Barrier(2), Future[None]()
    overlaps, running, runs = list[int](), list[int](), list[int]()

    def meet() -> None:
        barrier.wait(DEADLINE_SEC)

    def alone() -> None:
        running.append(1)
        overlaps.append(len(running))
        time.sleep(0)
        running.pop()
        runs.append(1)
        if len(runs) == 50:
            done.set_result(None)

    group, exclusive = ReentrantCallbackGroup(), MutuallyExclusiveCallbackGroup()
    guards = [node.create_guard_condition(meet, group) for _ in range(2)]
    timers = [node.create_timer(0.0005, alone, exclusive) for _ in range(3)]
    with MultiThreadedExecutor(4, context=context) as executor:
        executor.add_node(node)
        for guard in guards:
            guard.trigger()
        spin_until(executor, done)
        for timer in timers:
            timer.cancel()
        assert executor.shutdown(DEADLINE_SEC)
    assert set(overlaps) == {1}
    assert not barrier.broken


def test_an_error_in_a_pool_is_raised_by_spin(context: Context, node: Node) -> None:
    """In the thread that spins, soon after."""

    def fail() -> None:
        raise ValueError("in a pool")

    node.create_guard_condition(fail).trigger()
    with MultiThreadedExecutor(2, context=context) as executor:
        executor.add_node(node)
        with pytest.raises(ValueError, match="in a pool"):
            executor.spin_until_future_complete(Future[None](), DEADLINE_SEC)


def test_callbacks_in_a_pool_may_shut_it_down(context: Context, node: Node) -> None:
    """Two that do so at the same time wait for no callback but the others, and spinning ends."""
    barrier, group = threading.Barrier(2, timeout=DEADLINE_SEC), ReentrantCallbackGroup()
    executor, ended = MultiThreadedExecutor(2, context=context), list[bool]()

    def stop() -> None:
        barrier.wait()
        ended.append(executor.shutdown(DEADLINE_SEC))

    for _ in range(2):
        node.create_guard_condition(stop, group).trigger()
    executor.add_node(node)
    executor.spin()
    assert executor.shutdown(DEADLINE_SEC)
    assert ended == [True, True]


def test_an_error_in_a_pool_after_the_end_of_spinning_is_printed(
    context: Context, node: Node, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As that of any thread; but not what the end of the context itself has caused."""
    begun, left, printed = threading.Semaphore(0), threading.Event(), list[object]()

    def print_error(arguments: threading.ExceptHookArgs) -> None:
        printed.append(arguments.exc_type)

    monkeypatch.setattr(threading, "excepthook", print_error)

    def fail(error: Exception) -> None:
        begun.release()
        left.wait(DEADLINE_SEC)
        raise error

    executor = MultiThreadedExecutor(2, context=context)
    executor.add_node(node)
    for error in (ValueError("late"), ExternalShutdownException()):
        executor.create_task(fail, error)

    def shut_down() -> None:
        for _ in range(2):
            assert begun.acquire(timeout=DEADLINE_SEC)
        context.end()

    thread = threading.Thread(target=shut_down)
    thread.start()
    executor.spin()
    left.set()
    thread.join()
    assert executor.shutdown(DEADLINE_SEC)
    assert printed == [ValueError]


def test_an_executor_of_a_user_gets_tasks(context: Context, node: Node) -> None:
    """`wait_for_ready_callbacks` gives a task, its entity and its node; without work it raises in time."""
    seen = list[str]()
    guard = node.create_guard_condition(lambda: seen.append("ran"))
    with SingleThreadedExecutor(context=context) as executor:
        executor.add_node(node)
        guard.trigger()
        handler, entity, owner = executor.wait_for_ready_callbacks(timeout_sec=DEADLINE_SEC)
        assert (entity, owner, seen) == (guard, node, [])
        handler()
        assert seen == ["ran"]
        with pytest.raises(TimeoutException):
            executor.wait_for_ready_callbacks(timeout_sec=0)


def test_a_shutdown_ends_spinning(context: Context, node: Node, executor: SingleThreadedExecutor) -> None:
    """A wait for work, by a shutdown in another thread; later ones raise, too, and `spin` returns at once."""
    executor.add_node(node)
    threading.Thread(target=context.shutdown).start()
    for _ in range(2):
        with pytest.raises(ExternalShutdownException):
            executor.spin_once(DEADLINE_SEC)
    executor.spin()


def test_a_callback_may_shut_down(context: Context, node: Node, executor: SingleThreadedExecutor) -> None:
    """`spin` returns after it."""
    node.create_guard_condition(context.shutdown).trigger()
    executor.add_node(node)
    executor.spin()
    assert not context.ok()


def test_a_node_moves_between_executors(
    context: Context, node: Node, executor: SingleThreadedExecutor
) -> None:
    """Work that waits goes with it, and nothing of it is left behind."""
    seen = list[str]()
    guard = node.create_guard_condition(lambda: seen.append("ran"))
    executor.add_node(node)
    guard.trigger()
    with SingleThreadedExecutor(context=context) as other:
        assert other.add_node(node)
        assert not other.add_node(node)
        executor.spin_once(0)
        assert seen == []
        other.spin_once(0)
        assert seen == ["ran"]
        assert (executor.get_nodes(), other.get_nodes()) == ([], [node])


def test_spinning_ends_with_a_future_of_another_library(executor: SingleThreadedExecutor) -> None:
    """Such as that of a pool of threads."""
    begun = threading.Event()
    with ThreadPoolExecutor(1) as pool:
        future: Any = pool.submit(begun.wait, DEADLINE_SEC)
        executor.create_task(begun.set)
        executor.spin_until_future_complete(future, DEADLINE_SEC)
        assert future.done()
    assert future.result()


def test_a_future_does_not_keep_the_executors_that_waited_for_it(context: Context) -> None:
    """Once the wait is over, the executor is freed, though the future never ends."""
    future = Future[None]()
    executor = SingleThreadedExecutor(context=context)
    executor.spin_until_future_complete(future, 0)
    executor.spin_once_until_future_complete(future, 0)
    freed = weakref.ref(executor)
    del executor
    gc.collect()
    assert freed() is None
    future.cancel()


async def test_plain_functions_and_coroutines_are_called_alike() -> None:
    """`await_or_execute` returns the result of either."""

    async def twice(number: int) -> int:
        return 2 * number

    assert await await_or_execute(twice, 2) == 4
    assert await await_or_execute(abs, -1) == 1
    assert await await_or_execute(twice(3)) == 6


def test_a_pool_resumes_coroutines_that_await_something_unknown(context: Context, node: Node) -> None:
    """`asyncio.sleep(0)` only gives way: the coroutine goes on while the executor spins."""
    done = Future[Any]()

    async def give_way() -> None:
        await asyncio.sleep(0)
        done.set_result(1)

    with MultiThreadedExecutor(2, context=context) as executor:
        executor.add_node(node)
        executor.create_task(give_way)
        executor.spin_until_future_complete(done, 20)
    assert done.done()


def test_each_spin_without_time_resumes_coroutines(executor: SingleThreadedExecutor) -> None:
    """As in rclpy: those that give way go on by one step at least, however short the spins are."""
    steps = list[int]()

    async def give_way() -> None:
        for each in range(3):
            steps.append(each)
            await asyncio.sleep(0)

    task = executor.create_task(give_way)
    for count in (1, 2, 3, 3):
        executor.spin_once(timeout_sec=0)
        assert len(steps) == count
    assert task.done()


def test_a_coroutine_that_waits_for_time_leaves_the_processor_alone(
    executor: SingleThreadedExecutor,
) -> None:
    """One that gives way until a time has come is resumed about every millisecond."""
    resumed = list[int]()

    async def wait() -> None:
        until = time.monotonic() + 0.2
        while time.monotonic() < until:
            resumed.append(1)
            await asyncio.sleep(0)

    spin_until(executor, executor.create_task(wait))
    assert len(resumed) <= 201


def test_a_group_of_two_executors_lets_the_other_one_run(context: Context) -> None:
    """A callback that the group refused in one executor runs once the one in the other executor has ended."""
    group = MutuallyExclusiveCallbackGroup()
    begun, go_on, ran = threading.Event(), threading.Event(), Future[Any]()
    first, second = Node("first", context=context), Node("second", context=context)

    def hold() -> None:
        begun.set()
        go_on.wait(20)

    busy = first.create_guard_condition(hold, group)
    refused = second.create_guard_condition(lambda: ran.set_result(1), group)
    with (
        SingleThreadedExecutor(context=context) as holding,
        SingleThreadedExecutor(context=context) as waiting,
    ):
        holding.add_node(first)
        waiting.add_node(second)
        busy.trigger()
        thread = threading.Thread(target=holding.spin_once, args=(20,))
        thread.start()
        assert begun.wait(20)
        refused.trigger()
        waiting.spin_once(0)
        assert not ran.done()
        releasing = threading.Timer(0.05, go_on.set)
        releasing.start()
        waiting.spin_until_future_complete(ran, 20)
        thread.join()
    assert ran.done()


@pytest.mark.parametrize("error", [KeyboardInterrupt, SystemExit])
def test_an_interrupted_coroutine_frees_its_group(
    node: Node, executor: SingleThreadedExecutor, error: type[BaseException]
) -> None:
    """Spinning raises what interrupts it, once, and goes on with the group's callbacks afterwards."""
    seen = list[int]()

    async def interrupt() -> None:
        seen.append(1)
        if len(seen) == 1:
            raise error

    guard = node.create_guard_condition(interrupt)
    executor.add_node(node)
    guard.trigger()
    with pytest.raises(error):
        executor.spin_once(DEADLINE_SEC)
    guard.trigger()
    executor.spin_once(DEADLINE_SEC)
    assert len(seen) == 2


def test_each_of_two_threads_that_wait_is_woken(context: Context) -> None:
    """Tasks that need both threads run at once, and each future ends the spinning of its thread."""
    barrier, futures = threading.Barrier(2, timeout=DEADLINE_SEC), [Future[None]() for _ in range(2)]
    with SingleThreadedExecutor(context=context) as executor:
        threads = [
            threading.Thread(target=executor.spin_until_future_complete, args=(each, DEADLINE_SEC))
            for each in futures
        ]
        for thread in threads:
            thread.start()
        for _ in range(100):
            for task in [executor.create_task(barrier.wait) for _ in range(2)]:
                ended = threading.Event()
                task.when_done(ended.set)
                assert ended.wait(DEADLINE_SEC)
        started = time.monotonic()
        for future, thread in zip(futures, threads, strict=True):
            future.set_result(None)
            thread.join()
    assert time.monotonic() - started < DEADLINE_SEC / 2

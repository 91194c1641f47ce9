"""Executors, threads and entities in random orders: what must hold in all of them."""

from __future__ import annotations

import random
import threading
from contextlib import contextmanager, suppress
from functools import partial
from typing import TYPE_CHECKING

import pytest

from actors.errors import NodeDestroyed
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.rcl_interfaces.msg import Parameter, ParameterValue
from actors.interfaces.rcl_interfaces.srv import SetParameters
from actors.interfaces.std_msgs.msg import Int64
from actors.ros.rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from actors.ros.rclpy.exceptions import InvalidHandle, NotInitializedException
from actors.ros.rclpy.executors import (
    ExternalShutdownException,
    MultiThreadedExecutor,
    SingleThreadedExecutor,
)
from actors.ros.rclpy.node import Node
from actors.ros.rclpy.qos import HistoryPolicy, QoSProfile
from actors.ros.rclpy.task import Future

if TYPE_CHECKING:
    from collections.abc import Callable, Generator

    from actors.ros.rclpy.context import Context
    from actors.ros.rclpy.executors import Executor

DEADLINE_SEC = 30.0
KEEP_ALL = QoSProfile(history=HistoryPolicy.KEEP_ALL)
SEEDS = range(8)


class Exclusive:
    """A callback group whose callbacks note when two run at once."""

    def __init__(self) -> None:
        self.group = MutuallyExclusiveCallbackGroup()
        self.overlaps = 0
        self._running = threading.Lock()

    @contextmanager
    def running(self) -> Generator[None]:
        """Note that a callback runs."""
        alone = self._running.acquire(blocking=False)
        self.overlaps += not alone
        try:
            yield
        finally:
            if alone:
                self._running.release()


class Talk:
    """A topic whose messages are published in one thread, and counted where they arrive."""

    def __init__(self, node: Node, name: str, exclusive: Exclusive | None = None) -> None:
        self.seen: list[int] = []
        self._exclusive = exclusive or Exclusive()
        node.create_subscription(Int64, name, self._take, KEEP_ALL, callback_group=self._exclusive.group)
        self.publisher = node.create_publisher(Int64, name, KEEP_ALL)

    def publish(self, count: int) -> None:
        """Publish so many numbers."""
        for number in range(count):
            self.publisher.publish(Int64(data=number))

    def _take(self, msg: Int64) -> None:
        with self._exclusive.running():
            self.seen.append(msg.data)


def executor_of(chance: random.Random, context: Context) -> Executor:
    """Return an executor of a random kind."""
    if chance.random() < 0.4:
        return SingleThreadedExecutor(context=context)
    return MultiThreadedExecutor(chance.randint(2, 4), context=context)


def spin(executor: Executor) -> threading.Thread:
    """Spin in a thread until the executor or the context is shut down."""

    def run() -> None:
        with suppress(ExternalShutdownException):
            executor.spin()

    thread = threading.Thread(target=run)
    thread.start()
    return thread


def run_all(*works: Callable[[], object]) -> None:
    """Run functions at the same time, each in a thread; raise what they raise."""
    errors: list[BaseException] = []

    def guarded(work: Callable[[], object]) -> None:
        try:
            work()
        except BaseException as error:  # noqa: BLE001 - raised below
            errors.append(error)

    threads = [threading.Thread(target=guarded, args=(work,)) for work in works]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(DEADLINE_SEC)
        assert not thread.is_alive()
    if errors:
        raise errors[0]


def ignore(msg: Int64) -> None:
    """Take a message."""


def create_and_destroy(node: Node) -> None:
    """Make entities of topics in use, and destroy them."""
    for number in range(15):
        timer = node.create_timer(0.0001, lambda: None, ReentrantCallbackGroup())
        subscription = node.create_subscription(Int64, f"exclusive{number % 2}", ignore, 1)
        assert node.destroy_timer(timer)
        assert node.destroy_subscription(subscription)


def until_it_ends(work: Callable[[], object]) -> None:
    """Call a function until it says that the context is shut down, or its node destroyed."""
    with suppress(InvalidHandle, NotInitializedException, NodeDestroyed):
        while True:
            work()


@pytest.mark.parametrize("seed", SEEDS)
def test_nothing_is_lost_or_out_of_order(context: Context, seed: int) -> None:
    """Threads publish, trigger, and make and destroy entities while an executor of any kind spins.

    All messages come once and in order, tasks run once, a trigger is followed by a call, and callbacks of an
    exclusive group never overlap.
    """
    chance = random.Random(seed)
    node, other = Node("node", context=context), Node("other", context=context)
    exclusive = Exclusive()
    talks = [Talk(node, f"exclusive{n}", exclusive) for n in range(2)]
    talks.append(Talk(other, "alone"))
    calls, tasks = list[int](), list[int]()
    triggered = threading.Semaphore(0)

    def guarded() -> None:
        with exclusive.running():
            calls.append(1)
            triggered.release()

    guard = node.create_guard_condition(guarded, exclusive.group)
    executor = executor_of(chance, context)
    executor.add_node(node)
    spinning = spin(executor)
    counts = [chance.randint(50, 300) for _ in talks]

    def trigger() -> None:
        for _ in range(20):
            guard.trigger()
            assert triggered.acquire(timeout=DEADLINE_SEC)

    def create_tasks() -> None:
        for number in range(100):
            executor.create_task(tasks.append, number)

    works: list[Callable[[], object]] = [
        partial(talk.publish, count) for talk, count in zip(talks, counts, strict=True)
    ]
    works += [trigger, create_tasks, partial(create_and_destroy, node), partial(executor.add_node, other)]
    chance.shuffle(works)
    run_all(*works)
    done = Future[None](executor=executor)
    ended = threading.Event()
    done.when_done(ended.set)

    def check() -> None:
        if [len(talk.seen) for talk in talks] == counts and len(tasks) == 100 and not done.done():
            done.set_result(None)

    node.create_timer(0.01, check)
    assert ended.wait(DEADLINE_SEC), ([len(talk.seen) for talk in talks], counts, len(tasks))
    executor.shutdown()
    spinning.join(DEADLINE_SEC)
    assert not spinning.is_alive()
    assert exclusive.overlaps == 0
    assert [talk.seen for talk in talks] == [list(range(count)) for count in counts]
    assert sorted(tasks) == list(range(100))
    assert 20 <= len(calls) <= 21


def call(node: Node, chance: random.Random) -> None:
    """Call `add`, once or several times at once; give calls up, and destroy clients, now and then."""
    client = node.create_client(AddTwoInts, "add")
    assert client.wait_for_service(DEADLINE_SEC)
    for number in range(30):
        count = chance.choice((1, 1, 1, 3, 40))
        calls = [client.call_async(AddTwoInts.Request(a=number, b=each)) for each in range(count)]
        if chance.random() < 0.2:
            client.remove_pending_request(calls.pop())
        for each, future in enumerate(calls):
            done = threading.Event()
            future.when_done(done.set)
            assert done.wait(DEADLINE_SEC)
            response = future.result()
            assert response is not None
            assert response.sum == number + each
        if chance.random() < 0.1:
            assert node.destroy_client(client)
            client = node.create_client(AddTwoInts, "add")
            assert client.wait_for_service(DEADLINE_SEC)


@pytest.mark.parametrize("seed", SEEDS[:4])
def test_each_call_gets_its_own_reply(context: Context, seed: int) -> None:
    """Threads call, and write to the connection, while executors of any kind do, and the loop."""
    chance = random.Random(seed)
    served = list[int]()

    def serve(request: AddTwoInts.Request, response: AddTwoInts.Response) -> AddTwoInts.Response:
        served.append(request.a)
        response.sum = request.a + request.b
        return response

    server, caller = Node("server", context=context), Node("caller", context=context)
    group = chance.choice((MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup))()
    server.create_service(AddTwoInts, "add", serve, callback_group=group)
    executors = [executor_of(chance, context) for _ in range(2)]
    for node, executor in zip((server, caller), executors, strict=True):
        executor.add_node(node)
    threads = [spin(executor) for executor in executors]
    run_all(*(partial(call, caller, random.Random(chance.random())) for _ in range(3)))
    context.shutdown()
    for thread in threads:
        thread.join(DEADLINE_SEC)
        assert not thread.is_alive()
    assert served


@pytest.mark.parametrize("seed", SEEDS[:4])
def test_the_calls_of_a_thread_stay_in_order(context: Context, seed: int) -> None:
    """Threads share a client; each calls in bursts, also of large requests, which the loop sends."""
    chance = random.Random(seed)
    served: dict[str, list[int]] = {"a": [], "b": []}

    def serve(request: SetParameters.Request, response: SetParameters.Response) -> SetParameters.Response:
        parameter = request.parameters[0]
        served[parameter.name].append(parameter.value.integer_value)
        return response

    server, caller = Node("server", context=context), Node("caller", context=context)
    server.create_service(SetParameters, "set", serve)
    client = caller.create_client(SetParameters, "set")
    executors = [SingleThreadedExecutor(context=context) for _ in range(2)]
    for node, executor in zip((server, caller), executors, strict=True):
        executor.add_node(node)
    threads = [spin(executor) for executor in executors]
    assert client.wait_for_service(DEADLINE_SEC)

    def call_in_bursts(name: str, chance: random.Random) -> None:
        number = 0
        while number < 300:
            futures = list[Future[SetParameters.Response]]()
            for _ in range(chance.choice((1, 2, 16, 50))):
                text = "x" * chance.choice((0, 0, 0, 100, 5000))
                value = ParameterValue(integer_value=number, string_value=text)
                parameter = Parameter(name=name, value=value)
                futures.append(client.call_async(SetParameters.Request(parameters=[parameter])))
                number += 1
            for future in futures:
                done = threading.Event()
                future.when_done(done.set)
                assert done.wait(DEADLINE_SEC)

    run_all(*(partial(call_in_bursts, name, random.Random(chance.random())) for name in served))
    context.shutdown()
    for thread in threads:
        thread.join(DEADLINE_SEC)
    assert [len(numbers) >= 300 for numbers in served.values()] == [True, True]
    assert served == {name: list(range(len(numbers))) for name, numbers in served.items()}


@pytest.mark.parametrize("seed", SEEDS)
def test_a_shutdown_at_any_moment_ends_everything(context: Context, seed: int) -> None:
    """Threads that spin, publish and make entities end, with rclpy's errors only."""
    chance = random.Random(seed)
    nodes = [Node(f"node{n}", context=context) for n in range(2)]
    executors = [executor_of(chance, context) for _ in nodes]
    moment = chance.randint(1, 100)
    reached = threading.Event()
    seen = list[int]()

    def take(msg: Int64) -> None:
        seen.append(msg.data)
        if len(seen) == moment:
            reached.set()

    for node, executor in zip(nodes, executors, strict=True):
        node.create_subscription(Int64, "t", take, 10)
        node.create_timer(0.001, lambda: None)
        executor.add_node(node)
    publisher = nodes[0].create_publisher(Int64, "t", 10)
    threads = [spin(executor) for executor in executors]

    def create() -> None:
        nodes[1].destroy_timer(nodes[1].create_timer(0.1, lambda: None))
        nodes[1].destroy_publisher(nodes[1].create_publisher(Int64, "u", 1))

    def end() -> None:
        assert reached.wait(DEADLINE_SEC)
        context.shutdown()

    message = Int64(data=1)
    run_all(partial(until_it_ends, partial(publisher.publish, message)), partial(until_it_ends, create), end)
    for thread in threads:
        thread.join(DEADLINE_SEC)
        assert not thread.is_alive()
    for executor in executors:
        assert executor.shutdown(DEADLINE_SEC)

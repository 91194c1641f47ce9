"""What rclpy programs make and destroy many times leaves nothing behind."""

from __future__ import annotations

import gc
import threading
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int64
from actors.ros.rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from actors.ros.rclpy.node import Node
from tests.actors.ros.conftest import running_context

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.ros.rclpy.context import Context

ROUNDS = 300
NODE_ROUNDS = 100
"""A node makes and destroys ten endpoints of its own."""
WARM_UP_ROUNDS = 20
CACHED_BY_THE_ENCODER = "proto.wire.frames"
"""The module whose objects stay in a cache of limited size."""
DESCRIPTORS = Path("/proc/self/fd")


def left_behind(action: Callable[[], object], rounds: int, node: Node) -> dict[str, int]:
    """Return the objects, by class, of which at least one for two rounds has stayed.

    In both halves of the rounds: what is made once and kept, as the caches of abstract classes are, is there
    after one of them.

    Args:
        action: What is done in a round.
        rounds: How many.
        node: A node that has nothing to do with it.
    """
    for _ in range(WARM_UP_ROUNDS):
        action()
    before, half = _objects(node), rounds // 2
    grown = list[Counter[str]]()
    for _ in range(2):
        for _ in range(half):
            action()
        after = _objects(node)
        grown.append(after - before)
        before = after
    return {name: count for name, count in (grown[0] & grown[1]).items() if count >= half // 2}


def _objects(node: Node) -> Counter[str]:
    node.get_node_names()  # answered after everything before it
    gc.collect()
    types = (type(each) for each in gc.get_objects())
    return Counter(each.__qualname__ for each in types if each.__module__ != CACHED_BY_THE_ENCODER)


def _descriptors() -> int:
    return len(list(DESCRIPTORS.iterdir())) if DESCRIPTORS.exists() else 0


def ignore(msg: Int64) -> None:
    """Take a message."""


def test_entities_leave_nothing(context: Context) -> None:
    """Many of each kind, used once and destroyed, in a node that goes on."""
    node = Node("node", context=context)
    threads, descriptors = threading.active_count(), _descriptors()
    with SingleThreadedExecutor(context=context) as executor:
        executor.add_node(node)

        def round_() -> None:
            publisher = node.create_publisher(Int64, "t", 1)
            subscription = node.create_subscription(Int64, "t", ignore, 1)
            timer = node.create_timer(0, lambda: None)
            guard = node.create_guard_condition(lambda: None)
            guard.trigger()
            publisher.publish(Int64(data=1))
            executor.spin_once(0)
            executor.spin_once(0)
            assert node.destroy_timer(timer)
            assert node.destroy_guard_condition(guard)
            assert node.destroy_subscription(subscription)
            assert node.destroy_publisher(publisher)

        assert not left_behind(round_, ROUNDS, node)
    # Threads and descriptors of others may have ended meanwhile.
    assert threading.active_count() <= threads
    assert _descriptors() <= descriptors


def test_clients_and_services_leave_nothing(context: Context) -> None:
    """Calls are answered, given up or unanswered when their client is destroyed."""
    node = Node("node", context=context)

    def add(request: Any, response: Any) -> Any:
        response.sum = request.a + request.b
        return response

    with SingleThreadedExecutor(context=context) as executor:
        executor.add_node(node)

        def round_() -> None:
            service = node.create_service(AddTwoInts, "add", add)
            client, other = node.create_client(AddTwoInts, "add"), node.create_client(AddTwoInts, "none")
            answered = client.call_async(AddTwoInts.Request(a=1, b=2))
            executor.spin_until_future_complete(answered, 20)
            response = answered.result()
            assert response is not None
            assert response.sum == 3
            other.call_async(AddTwoInts.Request())
            other.remove_pending_request(other.call_async(AddTwoInts.Request()))
            assert node.destroy_client(client)
            assert node.destroy_client(other)
            assert node.destroy_service(service)

        assert not left_behind(round_, ROUNDS, node)


def test_nodes_contexts_and_executors_leave_nothing(context: Context) -> None:
    """A program may initialize and shut down as often as it likes."""
    watching = Node("watching", context=context)
    threads, descriptors = threading.active_count(), _descriptors()

    def round_() -> None:
        with running_context() as inner, MultiThreadedExecutor(2, context=inner) as executor:
            node = Node("node", context=inner)
            executor.add_node(node)
            executor.create_task(lambda: None)
            executor.spin_once(0)

    assert not left_behind(round_, NODE_ROUNDS, watching)
    # Threads and descriptors of others may have ended meanwhile.
    assert threading.active_count() <= threads
    assert _descriptors() <= descriptors

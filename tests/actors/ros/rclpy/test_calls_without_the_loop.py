"""Calls, one or many at a time, need no change of threads to be sent, and neither do their replies."""

from __future__ import annotations

import asyncio
import sys
import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors.endpoints.thread_entries import BURST
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.rcl_interfaces.msg import Parameter, ParameterValue
from actors.interfaces.rcl_interfaces.srv import SetParameters
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import Trigger
from actors.ros.rclpy.executors import SingleThreadedExecutor
from actors.ros.rclpy.node import Node
from actors.threads import NodeThread
from tests.actors.ros.rclpy.test_queued_calls import DEADLINE_SEC, spun
from tests.seams.ros import counted_calls, requests_waiting

if TYPE_CHECKING:
    from collections.abc import Generator, Iterator

    from actors.ros.rclpy.context import Context

on_linux = pytest.mark.skipif(sys.platform != "linux", reason="elsewhere the loop writes all frames")


@pytest.fixture
def executor(context: Context) -> Iterator[SingleThreadedExecutor]:
    """An executor with a node."""
    with SingleThreadedExecutor(context=context) as executor:
        executor.add_node(Node("node", context=context))
        yield executor


@pytest.fixture
def peer(context: Context) -> Iterator[tuple[NodeThread, actors.Node]]:
    """A node of callboard in a thread of its own."""
    del context  # has started the broker
    with NodeThread("peer") as thread:
        yield thread, thread.enter(actors.Node("peer"))


@contextmanager
def blocked_loop(context: Context) -> Generator[None]:
    """Block the loop of the nodes."""
    blocked, release = threading.Event(), threading.Event()

    def block() -> None:
        blocked.set()
        release.wait(2 * DEADLINE_SEC)

    call = context.thread.submit(block)
    assert blocked.wait(DEADLINE_SEC)
    try:
        yield
    finally:
        release.set()
        call.result(DEADLINE_SEC)


@on_linux
def test_a_request_leaves_in_the_thread_that_calls(
    context: Context, executor: SingleThreadedExecutor, peer: tuple[NodeThread, actors.Node]
) -> None:
    """A server gets it while the loop of the client is blocked."""
    thread, server = peer
    served = threading.Event()

    def serve(request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        served.set()
        response.success = True
        return response

    thread.call(lambda: server.create_service(Trigger, "serve", serve))
    client = executor.get_nodes()[0].create_client(Trigger, "serve")
    assert client.wait_for_service(DEADLINE_SEC)
    with blocked_loop(context):
        future = client.call_async(Trigger.Request())
        assert served.wait(DEADLINE_SEC)
    assert spun(executor, future).success


@on_linux
def test_a_response_leaves_in_the_thread_that_spins(
    context: Context, executor: SingleThreadedExecutor, peer: tuple[NodeThread, actors.Node]
) -> None:
    """A client gets it while the loop of the server is blocked."""
    thread, node = peer
    blocking, began = blocked_loop(context), threading.Event()

    def serve(request: Any, response: Any) -> Any:
        began.set()
        blocking.__enter__()
        response.message = "here"
        return response

    executor.get_nodes()[0].create_service(Trigger, "serve", serve)
    client = thread.call(lambda: node.create_client(Trigger, "serve"))
    assert thread.call(client.wait_for_service)
    reply = thread.submit(lambda: client.call(Trigger.Request()))
    try:
        while not began.is_set():
            executor.spin_once(DEADLINE_SEC)
        assert reply.result(DEADLINE_SEC).message == "here"
    finally:
        blocking.__exit__(None, None, None)


@on_linux
def test_many_requests_leave_in_the_thread_that_calls(
    context: Context, executor: SingleThreadedExecutor, peer: tuple[NodeThread, actors.Node]
) -> None:
    """A server gets each whole frame while the loop of the client is blocked."""
    thread, server = peer
    served, enough = list[int](), threading.Event()
    first = 1 + 2 * BURST  # the first is alone

    def serve(request: AddTwoInts.Request, response: AddTwoInts.Response) -> AddTwoInts.Response:
        served.append(request.a)
        if len(served) == first:
            enough.set()
        return response

    thread.call(lambda: server.create_service(AddTwoInts, "add", serve))
    client = executor.get_nodes()[0].create_client(AddTwoInts, "add")
    assert client.wait_for_service(DEADLINE_SEC)
    with blocked_loop(context):
        futures = [client.call_async(AddTwoInts.Request(a=each)) for each in range(first + 3)]
        assert enough.wait(DEADLINE_SEC)
    for future in futures:
        spun(executor, future)
    assert served == list(range(first + 3))


@on_linux
def test_many_responses_leave_in_the_thread_that_spins(
    context: Context, executor: SingleThreadedExecutor, peer: tuple[NodeThread, actors.Node]
) -> None:
    """A client gets all of them while the loop of the server is blocked."""
    thread, node = peer
    count = 2 * BURST + 5

    def serve(request: AddTwoInts.Request, response: AddTwoInts.Response) -> AddTwoInts.Response:
        response.sum = request.a
        return response

    service = executor.get_nodes()[0].create_service(AddTwoInts, "add", serve)
    client = thread.call(lambda: node.create_client(AddTwoInts, "add"))
    assert thread.call(client.wait_for_service)

    async def call_all() -> list[AddTwoInts.Response]:
        return await asyncio.gather(*(client.call(AddTwoInts.Request(a=each)) for each in range(count)))

    replies = thread.submit(call_all)
    while requests_waiting(service) < count:
        context.thread.call(lambda: None)
    with blocked_loop(context):
        for _ in range(count):
            executor.spin_once(DEADLINE_SEC)
        assert [each.sum for each in replies.result(DEADLINE_SEC)] == list(range(count))


@pytest.mark.parametrize("kind", ["message", "log line"])
def test_a_response_does_not_leave_before_what_its_handler_has_published(
    context: Context,
    executor: SingleThreadedExecutor,
    peer: tuple[NodeThread, actors.Node],
    kind: str,
) -> None:
    """The loop of the server is blocked, and sends both: who gets the response finds them at the broker."""
    thread, caller = peer
    node = executor.get_nodes()[0]
    publisher = node.create_publisher(String, "t", 10)

    def serve(request: Any, response: Any) -> Any:
        if kind == "message":
            publisher.publish(String(data="served"))
        else:
            node.get_logger().info("served")
        return response

    service = node.create_service(Trigger, "serve", serve)
    client = thread.call(lambda: caller.create_client(Trigger, "serve"))
    assert thread.call(client.wait_for_service)
    reply = thread.submit(lambda: client.call(Trigger.Request()))
    while not requests_waiting(service):
        context.thread.call(lambda: None)
    with blocked_loop(context):
        executor.spin_once(DEADLINE_SEC)
        thread.call(caller.get_node_names)  # the broker has handled what was sent by now
        assert not reply.done()
    assert reply.result(DEADLINE_SEC) == Trigger.Response()


def test_a_request_that_has_not_left_can_be_given_up(
    context: Context, executor: SingleThreadedExecutor, peer: tuple[NodeThread, actors.Node]
) -> None:
    """It waits for a whole frame, and no server gets it."""
    thread, server = peer
    served = list[int]()

    def serve(request: AddTwoInts.Request, response: AddTwoInts.Response) -> AddTwoInts.Response:
        served.append(request.a)
        return response

    thread.call(lambda: server.create_service(AddTwoInts, "add", serve))
    client = executor.get_nodes()[0].create_client(AddTwoInts, "add")
    assert client.wait_for_service(DEADLINE_SEC)
    with blocked_loop(context):
        client.call_async(AddTwoInts.Request(a=1))
        second = client.call_async(AddTwoInts.Request(a=2))
        client.remove_pending_request(second)
        last = client.call_async(AddTwoInts.Request(a=3))
    spun(executor, last)
    assert served == [1, 3]


def test_requests_that_have_been_answered_do_not_count(
    context: Context,
    executor: SingleThreadedExecutor,
    peer: tuple[NodeThread, actors.Node],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A service handles more requests, one after another, than it may at the same time."""
    monkeypatch.setattr("actors.endpoints.service.endpoint.MAX_RUNNING", 2)
    thread, node = peer
    executor.get_nodes()[0].create_service(Trigger, "serve", lambda request, response: response)
    client = thread.call(lambda: node.create_client(Trigger, "serve"))
    assert thread.call(client.wait_for_service)
    for _ in range(5):
        reply = thread.submit(lambda: client.call(Trigger.Request()))
        while not reply.done():
            executor.spin_once(0.001)
        assert reply.result() == Trigger.Response()


def test_no_call_overtakes_another(
    context: Context, executor: SingleThreadedExecutor, peer: tuple[NodeThread, actors.Node]
) -> None:
    """The first of several leaves at once, and the loop sends the others."""
    thread, server = peer
    numbers = list[int]()

    def serve(request: AddTwoInts.Request, response: AddTwoInts.Response) -> AddTwoInts.Response:
        numbers.append(request.a)
        return response

    thread.call(lambda: server.create_service(AddTwoInts, "add", serve))
    client = executor.get_nodes()[0].create_client(AddTwoInts, "add")
    assert client.wait_for_service(DEADLINE_SEC)
    for first in range(0, 30, 3):
        for future in [client.call_async(AddTwoInts.Request(a=first + each)) for each in range(3)]:
            spun(executor, future)
    assert numbers == list(range(30))


def test_a_large_request_and_its_response(
    context: Context, executor: SingleThreadedExecutor, peer: tuple[NodeThread, actors.Node]
) -> None:
    """The loop sends what a thread might write only in part."""
    thread, server = peer
    seen = list[int]()

    def serve(request: SetParameters.Request, response: SetParameters.Response) -> SetParameters.Response:
        seen.append(len(request.parameters[0].value.string_value))
        return response

    thread.call(lambda: server.create_service(SetParameters, "set", serve))
    client = executor.get_nodes()[0].create_client(SetParameters, "set")
    assert client.wait_for_service(DEADLINE_SEC)
    value = ParameterValue(string_value="x" * 100_000)
    spun(executor, client.call_async(SetParameters.Request(parameters=[Parameter(name="a", value=value)])))
    assert seen == [100_000]
    assert counted_calls(client) == 1


def test_a_call_fails_with_its_server(
    context: Context, executor: SingleThreadedExecutor, peer: tuple[NodeThread, actors.Node]
) -> None:
    """The server goes away before it replies."""
    thread, server = peer
    begun = threading.Event()

    async def serve(request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        begun.set()
        await asyncio.sleep(DEADLINE_SEC)
        return response

    service = thread.call(lambda: server.create_service(Trigger, "serve", serve))
    client = executor.get_nodes()[0].create_client(Trigger, "serve")
    assert client.wait_for_service(DEADLINE_SEC)
    future = client.call_async(Trigger.Request())
    assert begun.wait(DEADLINE_SEC)
    thread.call(service.destroy)
    with pytest.raises(actors.ServiceUnavailable):
        spun(executor, future)

"""Nodes of `rclpy.experimental`: callbacks are tasks of the loop that enters the node."""

from __future__ import annotations

import asyncio
import gc
import weakref
from typing import TYPE_CHECKING, Any

import pytest

from actors.errors import CallFailed
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import SetBool
from actors.ros.rclpy.action import ActionClient, ActionServer
from actors.ros.rclpy.exceptions import TimeSourceChangedError
from actors.ros.rclpy.experimental import AsyncClock, AsyncNode, AsyncTimer
from actors.ros.rclpy.parameter import Parameter
from actors.ros.rclpy.timer import TimerInfo

if TYPE_CHECKING:
    from actors.ros.rclpy.context import Context

LIMIT_SEC = 20.0


def invert(request: Any, response: Any) -> Any:
    """Answer with the opposite."""
    response.success = not request.data
    return response


async def test_callbacks_run_in_the_loop_that_enters_the_node(context: Context) -> None:
    """Plain and coroutine functions of entities made before and after the entry."""
    loops, received = set[object](), asyncio.Queue[str]()

    def note(message: Any) -> None:
        loops.add(asyncio.get_running_loop())
        received.put_nowait(message.data)

    async def note_later(message: Any, info: Any) -> None:
        await asyncio.sleep(0)
        note(message)
        assert info["source_timestamp"] > 0

    node = AsyncNode("node", context=context)
    publisher = node.create_publisher(String, "a", 10)
    node.create_subscription(String, "a", note, 10)
    async with asyncio.timeout(LIMIT_SEC), node:
        later = node.create_publisher(String, "b", 10)
        node.create_subscription(String, "b", note_later, 10)
        await until(lambda: publisher.get_subscription_count() == later.get_subscription_count() == 1)
        publisher.publish(String(data="a"))
        assert await received.get() == "a"
        later.publish(String(data="b"))
        assert await received.get() == "b"
    assert loops == {asyncio.get_running_loop()}
    with pytest.raises(RuntimeError, match="destroyed"):
        node.create_publisher(String, "c", 1)
    with pytest.raises(RuntimeError, match="destroyed"):
        await node.run()


async def until(condition: Any) -> None:
    """Wait until a condition of the other thread holds."""
    while not condition():
        await asyncio.sleep(0.005)


@pytest.mark.parametrize("concurrent", [False, True])
async def test_messages_of_a_topic_one_by_one_or_at_the_same_time(context: Context, concurrent: bool) -> None:
    """Without `concurrent` the next message waits for the end of the callback."""
    running, most, done = 0, 0, asyncio.Semaphore(0)
    gate = asyncio.Event()

    async def callback(message: Any) -> None:
        nonlocal running, most
        running += 1
        most = max(most, running)
        if concurrent and running == 3:
            gate.set()
        if concurrent:
            await gate.wait()
        await asyncio.sleep(0)
        running -= 1
        done.release()

    async with asyncio.timeout(LIMIT_SEC), AsyncNode("node", context=context) as node:
        publisher = node.create_publisher(String, "a", 10)
        node.create_subscription(String, "a", callback, 10, concurrent=concurrent)
        await until(lambda: publisher.get_subscription_count() == 1)
        for _ in range(3):
            publisher.publish(String())
        for _ in range(3):
            await done.acquire()
    assert most == (3 if concurrent else 1)


@pytest.mark.parametrize("concurrent", [False, True])
async def test_calls(context: Context, concurrent: bool) -> None:
    """A call is awaited; one that times out does not disturb the next."""
    async with asyncio.timeout(LIMIT_SEC):
        async with AsyncNode("server", context=context) as server, AsyncNode("c", context=context) as node:
            client = node.create_client(SetBool, "invert")
            with pytest.raises(TimeoutError):
                async with asyncio.timeout(0.01):
                    await client.call(SetBool.Request())
            server.create_service(SetBool, "invert", invert, concurrent=concurrent)
            await client.wait_for_service()
            answers = await asyncio.gather(
                *(client.call(SetBool.Request(data=each)) for each in (True, False))
            )
            assert [each.success for each in answers] == [False, True]
            client.destroy()
            with pytest.raises(RuntimeError):
                await client.call(SetBool.Request())


async def test_requests_at_the_same_time(context: Context) -> None:
    """Three handlers of a concurrent service meet."""
    barrier = asyncio.Barrier(3)

    async def handle(request: Any, response: Any) -> Any:
        await barrier.wait()
        return response

    async with asyncio.timeout(LIMIT_SEC), AsyncNode("node", context=context) as node:
        node.create_service(SetBool, "meet", handle, concurrent=True)
        client = node.create_client(SetBool, "meet")
        await asyncio.gather(*(client.call(SetBool.Request()) for _ in range(3)))


@pytest.mark.parametrize("concurrent", [False, True])
async def test_an_error_of_a_callback_ends_the_node(context: Context, concurrent: bool) -> None:
    """It leaves the block in a group, and the caller gets an error."""

    def fail(request: Any, response: Any) -> Any:
        raise ZeroDivisionError

    async with asyncio.timeout(LIMIT_SEC), AsyncNode("caller", context=context) as caller:
        client = caller.create_client(SetBool, "fail")
        node = AsyncNode("node", context=context)
        node.create_service(SetBool, "fail", fail, concurrent=concurrent)
        call = asyncio.ensure_future(client.call(SetBool.Request()))
        with pytest.raises(ExceptionGroup) as caught:
            await node.run()
        assert caught.value.subgroup(ZeroDivisionError)
        with pytest.raises(CallFailed):
            await call


async def test_run_ends_with_the_node(context: Context) -> None:
    """A callback destroys it; entered twice, it raises."""
    node = AsyncNode("node", context=context)

    def callback(message: Any) -> None:
        node.destroy_node()

    publisher = node.create_publisher(String, "a", 10)
    node.create_subscription(String, "a", callback, 10)
    async with asyncio.timeout(LIMIT_SEC):
        await until(lambda: publisher.get_subscription_count() == 1)
        publisher.publish(String())
        await node.run()
        async with AsyncNode("other", context=context) as other:
            with pytest.raises(RuntimeError, match="runs already"):
                await other.run()


async def test_run_ends_with_the_context(context: Context) -> None:
    """Also if a signal has ended it, without a shutdown."""
    node = AsyncNode("node", context=context)
    async with asyncio.timeout(LIMIT_SEC):
        running = asyncio.ensure_future(node.run())
        await asyncio.sleep(0)
        context.end()
        await running


async def test_run_ends_if_the_context_has_ended_before(context: Context) -> None:
    """A signal may come between the making of the node and its entry."""
    node = AsyncNode("node", context=context)
    context.end()
    async with asyncio.timeout(LIMIT_SEC):
        await node.run()


async def test_goals_are_executed_in_the_loop(context: Context) -> None:
    """An execute callback awaits what it likes; one that waits for ever is cancelled with the node."""
    begun, cancelled = asyncio.Event(), asyncio.Event()

    async def execute(goal: Any) -> Any:
        await asyncio.sleep(0.001)
        if goal.request.order == 0:
            begun.set()
            try:
                await asyncio.Event().wait()
            finally:
                cancelled.set()
        goal.succeed()
        return Fibonacci.Result(sequence=[goal.request.order])

    async with asyncio.timeout(LIMIT_SEC), AsyncNode("node", context=context) as node:
        ActionServer(node, Fibonacci, "count", execute)
        client = ActionClient(node, Fibonacci, "count")
        handle = await client.send_goal_async(Fibonacci.Goal(order=3))
        assert handle is not None
        response: Any = await handle.get_result_async()
        assert list(response.result.sequence) == [3]
        client.send_goal_async(Fibonacci.Goal(order=0))
        await begun.wait()
    assert cancelled.is_set()


async def test_a_destroyed_concurrent_subscription_is_freed(context: Context) -> None:
    """Also if it was notified of a message that is not there any more."""
    async with asyncio.timeout(LIMIT_SEC), AsyncNode("node", context=context) as node:
        subscription = node.create_subscription(String, "a", print, 1, concurrent=True)
        await asyncio.sleep(0)  # the dispatcher looks at it
        node.destroy_subscription(subscription)
        subscription.notify()
        await asyncio.sleep(0)
        freed = weakref.ref(subscription)
        del subscription
        gc.collect()
        assert freed() is None


async def test_subclasses_have_attributes_of_their_own(context: Context) -> None:
    """Names that programs are likely to use do not disturb the node."""

    class Mine(AsyncNode):
        def __init__(self) -> None:
            super().__init__("node", context=context)
            self._group = self._dispatcher = self._left = self._loop = "mine"

    async with asyncio.timeout(LIMIT_SEC), Mine() as node:
        node.destroy_node()


async def test_destroying_cancels_a_handler(context: Context) -> None:
    """The caller gets an error: rclpy's would wait for ever."""
    begun = asyncio.Event()
    cancelled = asyncio.Event()

    async def handle(request: Any, response: Any) -> Any:
        begun.set()
        try:
            await asyncio.Event().wait()
        finally:
            cancelled.set()

    async with asyncio.timeout(LIMIT_SEC), AsyncNode("node", context=context) as node:
        service = node.create_service(SetBool, "never", handle)
        call = asyncio.ensure_future(node.create_client(SetBool, "never").call(SetBool.Request()))
        await begun.wait()
        service.destroy()
        await cancelled.wait()
        with pytest.raises(CallFailed):
            await call


async def test_timers(context: Context) -> None:
    """They tick, also with period zero and with a TimerInfo; cancelled ones do not."""
    ticks, infos = asyncio.Semaphore(0), asyncio.Queue[TimerInfo]()

    async def tick() -> None:
        ticks.release()

    node = AsyncNode("node", context=context)
    timer = node.create_timer(0.01, tick)
    waiting = node.create_timer(0.0, tick, autostart=False)
    node.create_timer(0.01, infos.put_nowait)
    with pytest.raises(RuntimeError, match="callback"):
        node.create_timer(1.0, invert)
    async with asyncio.timeout(LIMIT_SEC), node:
        for _ in range(3):
            await ticks.acquire()
        assert isinstance(timer, AsyncTimer)
        info = await infos.get()
        assert info.actual_call_time >= info.expected_call_time
        timer.cancel()
        assert timer.is_canceled()
        assert waiting.is_canceled()
        waiting.reset()
        await ticks.acquire()
        timer.reset()
        timer.destroy()


async def test_a_clock_is_awaited(context: Context) -> None:
    """Sleeps end when they are over, with the node, and when the source of time changes."""
    node = AsyncNode("node", context=context)
    clock = node.get_clock()
    async with asyncio.timeout(LIMIT_SEC), node:
        before = clock.now()
        await clock.sleep(0.02)
        assert (clock.now() - before).nanoseconds >= 20_000_000
        await clock.sleep(0)
        await clock.sleep(-1.0)
        await AsyncClock().sleep(0.001)
        sleeping, simulated = asyncio.ensure_future(clock.sleep(1000.0)), False
        while not sleeping.done():  # the first change may come before the sleep has begun
            simulated = not simulated
            node.set_parameters([Parameter("use_sim_time", Parameter.Type.BOOL, value=simulated)])
            await asyncio.sleep(0.005)
        with pytest.raises(TimeSourceChangedError):
            await sleeping
        sleeping = asyncio.ensure_future(clock.sleep(1000.0))
        await asyncio.sleep(0)
        node.destroy_node()
        with pytest.raises(asyncio.CancelledError):
            await sleeping
    with pytest.raises(RuntimeError, match="destroyed"):
        await clock.sleep(1.0)


async def test_the_graph(context: Context) -> None:
    """Queries answer at once, and other nodes are awaited."""
    async with asyncio.timeout(LIMIT_SEC), AsyncNode("node", context=context, namespace="/ns") as node:
        await node.wait_for_node("/ns/node")
        assert "node" in node.get_node_names()
        node.create_publisher(String, "/a", 10)
        assert node.count_publishers("/a") == 1
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(0.01):
                await node.wait_for_node("nobody")

"""How a broker stops: what it has accepted reaches its readers, within a limit."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING
from unittest import mock

import pytest

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int64, String
from broker import Broker, BrokerOptions
from broker.routing.routes import Routes
from broker.serving.drain import LAST_STEP_SEC
from proto.wire import frames
from tests.actors.meeting import KEEP_ALL
from tests.broker.rawclient import link
from tests.simulation.stage import play

if TYPE_CHECKING:
    from tests.simulation.stage import Stage

DRAIN_SEC = BrokerOptions().drain_timeout_sec

PATIENT = BrokerOptions(drain_timeout_sec=60)
"""So that a wait for the whole drain shows."""
KEEPALIVE_SEC = PATIENT.keepalive_sec


def test_pending_calls_are_answered() -> None:
    """They get their replies, new ones fail at once, and the broker waits for nothing else."""

    async def scene(stage: Stage) -> None:
        server, caller = await stage.enter("server"), await stage.enter("caller")

        async def slow(request: AddTwoInts.Request) -> AddTwoInts.Response:
            await asyncio.sleep(2)
            return AddTwoInts.Response(sum=request.a + request.b)

        server.create_service(AddTwoInts, "/add", slow)
        client = caller.create_client(AddTwoInts, "/add")
        assert await client.wait_for_service(10)
        call = client.call_async(AddTwoInts.Request(a=1, b=2))
        await asyncio.sleep(0.5)
        began = stage.loop.time()
        stopping = asyncio.create_task(stage.stop_broker())
        await asyncio.sleep(0.1)
        with pytest.raises(actors.ServiceUnavailable, match="stopping"):
            await client.call(AddTwoInts.Request())
        assert stage.loop.time() - began < 0.3
        assert (await call).sum == 3
        await stopping
        assert stage.loop.time() - began < 2.0

    play(scene)


def test_a_handler_may_call_other_services_for_its_answer() -> None:
    """Peers without pending calls of their own are refused."""

    async def scene(stage: Stage) -> None:
        front, back, caller = [await stage.enter(name) for name in ("front", "back", "caller")]
        inner = front.create_client(AddTwoInts, "/inner")
        stopping = asyncio.Event()

        async def ask(request: AddTwoInts.Request) -> AddTwoInts.Response:
            await stopping.wait()
            return await inner.call(request)

        def add(request: AddTwoInts.Request) -> AddTwoInts.Response:
            return AddTwoInts.Response(sum=request.a + request.b)

        back.create_service(AddTwoInts, "/inner", add)
        front.create_service(AddTwoInts, "/outer", ask)
        client = caller.create_client(AddTwoInts, "/outer")
        assert await client.wait_for_service(10)
        assert await inner.wait_for_service(10)
        call = client.call_async(AddTwoInts.Request(a=1, b=2))
        await asyncio.sleep(0.1)
        stop = asyncio.create_task(stage.stop_broker())
        await asyncio.sleep(0.1)
        with pytest.raises(actors.ServiceUnavailable, match="stopping"):
            await client.call(AddTwoInts.Request())
        stopping.set()
        assert (await call).sum == 3
        await stop
        with pytest.raises(actors.ServiceUnavailable):
            await inner.call(AddTwoInts.Request())

    play(scene)


def test_a_call_that_is_not_answered_in_time_ends_with_the_link() -> None:
    """The drain has a limit; the caller gets an error when its link closes."""

    async def scene(stage: Stage) -> None:
        server, caller = await stage.enter("server"), await stage.enter("caller")

        async def endless(request: AddTwoInts.Request) -> AddTwoInts.Response:
            await asyncio.Event().wait()
            return AddTwoInts.Response(sum=request.a)

        server.create_service(AddTwoInts, "/add", endless)
        client = caller.create_client(AddTwoInts, "/add")
        assert await client.wait_for_service(10)
        call = client.call_async(AddTwoInts.Request(), 60)
        await asyncio.sleep(0.5)
        began = stage.loop.time()
        await stage.stop_broker()
        assert DRAIN_SEC <= stage.loop.time() - began < DRAIN_SEC + 2 * LAST_STEP_SEC
        with pytest.raises(actors.ServiceUnavailable):
            await call

    play(scene)


@pytest.mark.parametrize("seed", range(5))
def test_keep_all_loses_nothing_to_a_stop_under_load(seed: int) -> None:
    """With a busy publisher and a slow reader, sent messages are delivered and the rest stays queued."""

    async def scene(stage: Stage) -> None:
        source, sink = await stage.enter("source"), await stage.enter("sink")
        received: list[int] = []

        async def take(message: Int64) -> None:
            received.append(message.data)
            if message.data % 100 == 0:
                await asyncio.sleep(0.01)

        sink.create_subscription(Int64, "/numbers", take, KEEP_ALL)
        publisher = source.create_publisher(Int64, "/numbers", KEEP_ALL)
        await stage.until(lambda: publisher.get_subscription_count() == 1)
        stage.network.slow_down("sink", read=2000, pause=0.002)

        async def publish() -> None:
            while publisher.get_subscription_count():
                try:
                    await publisher.ready(1)
                except actors.WaitTimeout:
                    continue
                for _ in range(50):
                    publisher.publish(Int64(data=publisher.published))
                await asyncio.sleep(0.001)

        publishing = asyncio.create_task(publish())
        await asyncio.sleep(0.5)
        assert received
        await stage.stop_broker()
        await publishing
        assert publisher.queued
        sent = publisher.published - publisher.queued
        await stage.until(lambda: len(received) >= sent, 60)
        assert received == list(range(sent))

    play(scene, seed)


def test_a_slow_reader_gets_all_queued_messages() -> None:
    """A full queue is read to its end before the goodbye."""

    async def scene(stage: Stage) -> None:
        source, sink = await stage.enter("source"), await stage.enter("sink")
        received: list[int] = []
        sink.create_subscription(String, "/texts", lambda m: received.append(1), 100)
        publisher = source.create_publisher(String, "/texts", 100)
        await stage.until(lambda: publisher.get_subscription_count() == 1)
        stage.network.slow_down("sink", read=10_000, pause=0.01)
        for _ in range(100):
            publisher.publish(String(data="x" * 20_000))
        await publisher.flush()
        assert len(received) < 100
        # Evaluated in each loop iteration: adding up all queues there would block a large broker.
        with mock.patch.object(Routes, "tallies", side_effect=AssertionError("queues are added up")):
            await stage.stop_broker()
        assert len(received) == 100

    play(scene)


def test_a_frozen_reader_delays_a_stop_by_its_keepalive_only() -> None:
    """The broker does not wait for the whole drain timeout."""

    async def scene(stage: Stage) -> None:
        source, sink = await stage.enter("source"), await stage.enter("sink")
        sink.create_subscription(Int64, "/numbers", lambda _: None, KEEP_ALL)
        publisher = source.create_publisher(Int64, "/numbers", KEEP_ALL)
        await stage.until(lambda: publisher.get_subscription_count() == 1)
        stage.network.partition("sink")
        for number in range(50_000):
            await publisher.ready(60)
            publisher.publish(Int64(data=number))
        began = stage.loop.time()
        await stage.stop_broker()
        assert stage.loop.time() - began <= 2 * KEEPALIVE_SEC

    play(scene, options=PATIENT)


def test_a_suspended_link_does_not_delay_a_stop() -> None:
    """Neither its close nor the queues of departed publishers to it are waited for."""

    async def scene(stage: Stage) -> None:
        source, sink = await stage.enter("source"), await stage.enter("sink")
        sink.create_subscription(String, "/texts", lambda _: None, 1000)
        publisher = source.create_publisher(String, "/texts", 1000)
        await stage.until(lambda: publisher.get_subscription_count() == 1)
        stage.network.partition("sink")
        for _ in range(100):
            publisher.publish(String(data="x" * 50_000))
        await publisher.flush()
        source.destroy_publisher(publisher)
        await stage.until(lambda: stage.broker.stats().suspended == 1)
        assert stage.broker.stats().queued
        began = stage.loop.time()
        await stage.stop_broker()
        assert stage.loop.time() - began < 1.0

    play(scene, options=PATIENT)


async def test_a_cancelled_stop_closes_at_once() -> None:
    """Cancelling the stop leaves no connection, no task and no socket."""
    loop = asyncio.get_running_loop()
    async with (
        Broker(BrokerOptions(port=0, drain_timeout_sec=3600)) as running,
        link(running, "/n") as client,
    ):
        stopping = loop.create_task(running.stop())
        await client.next(frames.Goodbye)
        stopping.cancel()
        await client.gone()
        with pytest.raises(asyncio.CancelledError):
            await stopping
    assert asyncio.all_tasks() == {asyncio.current_task()}


def test_a_link_that_does_not_confirm_the_hold_delays_a_stop_by_its_keepalive() -> None:
    """Even if nothing relies on the link."""

    async def scene(stage: Stage) -> None:
        await stage.enter("mute")
        stage.network.partition("mute")
        began = stage.loop.time()
        await stage.stop_broker()
        assert stage.loop.time() - began <= 2 * KEEPALIVE_SEC

    play(scene, options=PATIENT)

"""How a node stops: what runs may end, what waits is answered, and nothing holds it up for ever."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors.endpoints.endpoint import endpoint_of
from actors.endpoints.subscription.credit import WINDOW_MESSAGES
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int64
from actors.node.node_runner import GRACE_SEC, STOP_TIMEOUT_SEC
from tests.actors.meeting import KEEP_ALL
from tests.seams.nodes import context_of
from tests.simulation.network import on_host
from tests.simulation.stage import play

if TYPE_CHECKING:
    from tests.actors.meeting import Meeting
    from tests.simulation.stage import Stage

Call = asyncio.Future[Any]


class Actor:
    """A node that runs in a task of its own, on a host of its own, until it is told to leave."""

    def __init__(self, stage: Stage, **options: Any) -> None:
        self.stage = stage
        self.node = actors.Node("actor", use_global_arguments=False, **options)
        self.leave = asyncio.Event()
        with on_host("actor"):
            self.task = asyncio.create_task(self._run())
        self.began = 0.0

    async def _run(self) -> None:
        async with self.node:
            await self.leave.wait()

    async def connected(self) -> None:
        await self.stage.until(lambda: self.node.connected)

    def stop(self) -> None:
        """Let the body end; the node begins to stop."""
        self.began = self.stage.loop.time()
        self.leave.set()

    async def ended(self) -> float:
        """Wait for the end; return how long the stop took."""
        await asyncio.wait({self.task})
        return self.stage.loop.time() - self.began


async def sums(stage: Stage, node: actors.Node, count: int) -> list[Call]:
    """Make calls of /add, of 0 + 0, 1 + 0, ..."""
    client = node.create_client(AddTwoInts, "/add")
    assert await client.wait_for_service(10)
    calls = [client.call_async(AddTwoInts.Request(a=number), 60) for number in range(count)]
    await asyncio.sleep(0.2)
    return calls


def test_a_handler_that_runs_answers_and_what_waits_is_refused_at_once() -> None:
    """The call in the handler is answered, those behind it end at once, and so do new ones."""

    async def scene(stage: Stage) -> None:
        actor = Actor(stage)
        caller = await stage.enter("caller")

        async def slow(request: AddTwoInts.Request) -> AddTwoInts.Response:
            await asyncio.sleep(2)
            return AddTwoInts.Response(sum=request.a + 40)

        actor.node.create_service(AddTwoInts, "/add", slow)
        first, second = await sums(stage, caller, 2)
        actor.stop()
        with pytest.raises(actors.ServiceUnavailable, match="stopping"):
            await second
        assert stage.loop.time() - actor.began < 0.1
        third = caller.create_client(AddTwoInts, "/add").call_async(AddTwoInts.Request())
        with pytest.raises(actors.ServiceUnavailable):
            await third
        assert stage.loop.time() - actor.began < 0.2
        assert (await first).sum == 40
        assert 1.5 < await actor.ended() < 2.0
        with pytest.raises(actors.ServiceUnavailable):
            await caller.create_client(AddTwoInts, "/add").call(AddTwoInts.Request())

    play(scene)


def test_callbacks_that_run_may_call_and_publish_to_their_end() -> None:
    """With the link up: calls, the clock and KEEP_ALL topics work for a callback in a node that stops."""

    async def scene(stage: Stage) -> None:
        actor = Actor(stage)
        helper, received = await stage.enter("helper"), []
        helper.create_subscription(Int64, "/out", lambda message: received.append(message.data), KEEP_ALL)

        async def add(request: AddTwoInts.Request) -> AddTwoInts.Response:
            await helper.get_clock().sleep_for(actors.Duration(seconds=0.5))
            return AddTwoInts.Response(sum=request.a + 1)

        helper.create_service(AddTwoInts, "/add", add)
        client = actor.node.create_client(AddTwoInts, "/add")
        publisher = actor.node.create_publisher(Int64, "/out", KEEP_ALL)
        begun: list[str] = []

        async def work() -> None:
            timer.cancel()
            begun.append("yes")
            value = 0
            for _ in range(3):
                value = (await client.call(AddTwoInts.Request(a=value))).sum
            for number in range(value, 2000):
                publisher.publish(Int64(data=number))

        timer = actor.node.create_timer(0.5, work)
        await stage.until(lambda: bool(begun and client.pending))
        actor.stop()
        assert 1.0 < await actor.ended() < 2.0
        await stage.until(lambda: len(received) == 1997)
        assert received == list(range(3, 2000))

    play(scene)


def test_nothing_new_begins(caplog: pytest.LogCaptureFixture) -> None:
    """A node that stops takes no message and no tick, and says how many messages it has not read."""
    caplog.set_level("INFO", "callboard")

    async def scene(stage: Stage) -> None:
        actor = Actor(stage)
        source, taken, ticks = await stage.enter("source"), [], []

        async def slow(message: Int64) -> None:
            taken.append(message.data)
            await asyncio.sleep(1)

        actor.node.create_subscription(Int64, "/in", slow)
        publisher = source.create_publisher(Int64, "/in")
        await stage.until(lambda: publisher.get_subscription_count() == 1)
        for number in range(4):
            publisher.publish(Int64(data=number))
        await stage.until(lambda: bool(taken))
        actor.node.create_timer(0.1, lambda: ticks.append(1))
        await asyncio.sleep(0.05)
        actor.stop()
        publisher.publish(Int64(data=4))
        assert 0.8 < await actor.ended() < 1.1
        assert (taken, ticks) == ([0], [])

    play(scene)
    assert "3 received messages unread" in caplog.text


@pytest.mark.parametrize("concurrent", [False, True])
def test_callbacks_have_a_limit_and_are_then_cancelled(
    caplog: pytest.LogCaptureFixture, *, concurrent: bool
) -> None:
    """After `stop_timeout_sec` what runs is cancelled, its callers hear of it, and it may clean up."""

    async def scene(stage: Stage) -> None:
        actor = Actor(stage, stop_timeout_sec=1.0)
        caller, cleaned = await stage.enter("caller"), []

        async def endless(request: AddTwoInts.Request) -> AddTwoInts.Response:
            try:
                await asyncio.Event().wait()
            finally:
                await asyncio.sleep(0.1)
                cleaned.append("yes")
            return AddTwoInts.Response()

        actor.node.create_service(AddTwoInts, "/add", endless, concurrent=concurrent)
        (call,) = await sums(stage, caller, 1)
        actor.stop()
        with pytest.raises(actors.ServiceUnavailable, match="cancelled"):
            await call
        assert 1.0 <= await actor.ended() < 1.3
        assert cleaned == ["yes"]
        assert actor.node.callback_errors == 0

    play(scene)
    assert "endless" in caplog.text


@pytest.mark.parametrize("kind", ["subscription", "service", "timer"])
def test_a_callback_that_ignores_its_cancellation_is_named_and_abandoned(
    caplog: pytest.LogCaptureFixture, kind: str
) -> None:
    """The stop is bounded whatever a callback does; callers hear that the server has gone."""

    async def scene(stage: Stage) -> None:
        actor = Actor(stage)
        other, begun, over = await stage.enter("other"), [], asyncio.Event()

        async def stubborn(*_: object) -> None:
            begun.append("yes")
            while not over.is_set():
                try:
                    await over.wait()
                except asyncio.CancelledError:
                    begun.append("ignored")

        calls: list[Call] = []
        if kind == "timer":
            actor.node.create_timer(0.1, stubborn)
        elif kind == "service":
            actor.node.create_service(AddTwoInts, "/add", stubborn)  # type: ignore[arg-type]
            calls = await sums(stage, other, 1)
        else:
            actor.node.create_subscription(Int64, "/in", stubborn)
            publisher = other.create_publisher(Int64, "/in")
            await stage.until(lambda: publisher.get_subscription_count() == 1)
            publisher.publish(Int64())
        await stage.until(lambda: bool(begun))
        actor.stop()
        took = await actor.ended()
        assert STOP_TIMEOUT_SEC + GRACE_SEC <= took < STOP_TIMEOUT_SEC + 2 * GRACE_SEC
        for call in calls:
            with pytest.raises(actors.ServiceUnavailable):
                await call
        assert "ignored" in begun
        over.set()
        await asyncio.sleep(0.1)

    play(scene)
    errors = [record.getMessage() for record in caplog.records if record.levelname == "ERROR"]
    assert len(errors) == 1
    assert "ignore their cancellation" in errors[0]
    assert "stubborn" in errors[0]


def test_a_second_cancellation_forces_the_stop() -> None:
    """Whoever cancels a node's task again does not want to wait for callbacks; the cancellation counts."""

    async def scene(stage: Stage) -> None:
        actor, cancelled = Actor(stage, stop_timeout_sec=100.0), []

        async def endless() -> None:
            try:
                await asyncio.Event().wait()
            except asyncio.CancelledError:
                cancelled.append(stage.loop.time())
                raise

        timer = actor.node.create_timer(0.1, endless)
        await stage.until(lambda: timer.ticks > 0)
        actor.began = stage.loop.time()
        actor.task.cancel()
        await asyncio.sleep(3)
        assert not cancelled
        actor.task.cancel()
        assert 3.0 <= await actor.ended() < 3.2
        assert actor.task.cancelled()
        assert len(cancelled) == 1

    play(scene)


def test_a_timeout_around_a_node_that_stops_is_a_timeout() -> None:
    """`asyncio.timeout` that ends while the node stops raises TimeoutError, and forces the stop."""

    async def scene(stage: Stage) -> None:
        node = actors.Node("n", use_global_arguments=False, stop_timeout_sec=100.0)

        async def endless() -> None:
            await asyncio.Event().wait()

        timer = node.create_timer(0.1, endless)
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(5), node:
                await stage.until(lambda: timer.ticks > 0)
        assert 5 <= stage.loop.time() < 6

    play(scene)


@pytest.mark.parametrize("inside", [False, True])
def test_destroy_node_cancels_at_once_and_callers_learn_of_it(*, inside: bool) -> None:
    """Handlers are cancelled, `run` returns, and nobody waits for a dead node's answer."""

    async def scene(stage: Stage) -> None:
        node = actors.Node("actor", use_global_arguments=False)
        caller, cancelled = await stage.enter("caller"), []

        async def endless(*_: object) -> AddTwoInts.Response:
            try:
                await asyncio.Event().wait()
            except asyncio.CancelledError:
                cancelled.append("yes")
                raise
            return AddTwoInts.Response()

        async def destroy() -> None:
            node.destroy_node()
            await asyncio.Event().wait()

        node.create_service(AddTwoInts, "/add", endless, concurrent=True)
        node.create_subscription(Int64, "/in", endless, concurrent=True)
        running = asyncio.create_task(node.run())
        publisher = caller.create_publisher(Int64, "/in")
        await stage.until(lambda: publisher.get_subscription_count() == 1)
        publisher.publish(Int64())
        (call,) = await sums(stage, caller, 1)
        began = stage.loop.time()
        if inside:
            node.create_timer(0, destroy)
        else:
            node.destroy_node()
        with pytest.raises(actors.ServiceUnavailable):
            await call
        await running
        assert stage.loop.time() - began < 0.2
        assert cancelled == ["yes", "yes"]
        assert node.callback_errors == 0

    play(scene)


def test_a_frozen_broker_does_not_hold_up_a_stop() -> None:
    """With a broker that answers nothing the bound holds, from the first moment of the stop."""

    async def scene(stage: Stage) -> None:
        actor = Actor(stage, stop_timeout_sec=2.0)
        publisher = actor.node.create_publisher(Int64, "/out", KEEP_ALL)
        await actor.connected()
        stage.network.partition("actor")
        publisher.publish(Int64())
        actor.stop()
        assert await actor.ended() <= 2.0 + 2 * GRACE_SEC

    play(scene)


def test_new_calls_go_elsewhere_while_a_server_stops() -> None:
    """With another server there, a stop in the middle of the work costs no call that comes after it."""

    async def scene(stage: Stage) -> None:
        actor = Actor(stage)
        caller, other = await stage.enter("caller"), await stage.enter("other")

        async def slow(request: AddTwoInts.Request) -> AddTwoInts.Response:
            await asyncio.sleep(2)
            return AddTwoInts.Response(sum=1)

        actor.node.create_service(AddTwoInts, "/add", slow)
        (first,) = await sums(stage, caller, 1)
        other.create_service(AddTwoInts, "/add", lambda _: AddTwoInts.Response(sum=2))
        client = caller.create_client(AddTwoInts, "/add")
        await stage.until(lambda: client.peers == 2)
        actor.stop()
        await stage.until(lambda: client.peers == 1)
        assert not first.done()
        assert [(await client.call(AddTwoInts.Request())).sum for _ in range(20)] == [2] * 20
        assert (await first).sum == 1
        await actor.ended()

    play(scene)


@pytest.mark.parametrize("first", ["failure", "cancellation"])
def test_a_cancellation_is_not_lost_when_the_node_fails_too(first: str) -> None:
    """Somebody cancels the task in the turn in which its node fails: it ends cancelled, whoever was first."""

    async def scene(stage: Stage) -> None:
        actor = Actor(stage)
        await actor.connected()
        if first == "cancellation":
            actor.task.cancel()
        context_of(actor.node).stop(ValueError("broken"))
        if first == "failure":
            actor.task.cancel()
        await actor.ended()
        assert actor.task.cancelled()

    play(scene)


def test_a_node_that_fails_leaves_no_cancellation_behind() -> None:
    """Whoever handles a node's failure goes on as a task that nobody has asked to end."""

    async def scene(stage: Stage) -> None:
        async def use() -> None:
            async with actors.Node("actor", use_global_arguments=False) as node:
                stage.loop.call_later(0.1, context_of(node).stop, ValueError("broken"))
                await asyncio.sleep(60)

        async def body() -> int:
            with pytest.raises(ValueError, match="broken"):
                await use()
            task = asyncio.current_task()
            assert task is not None
            return task.cancelling()

        with on_host("actor"):
            assert await asyncio.create_task(body()) == 0

    play(scene)


def test_a_node_destroyed_inside_its_block_leaves_after_what_it_has_published() -> None:
    """`destroy_node` frees the name although the block goes on; what was published arrives before."""

    async def scene(stage: Stage) -> None:
        watcher, received = await stage.enter("watcher"), []
        watcher.create_subscription(Int64, "/out", lambda message: received.append(message.data), KEEP_ALL)
        actor = Actor(stage)
        await actor.connected()
        publisher = actor.node.create_publisher(Int64, "/out", KEEP_ALL)
        await stage.until(lambda: publisher.get_subscription_count() == 1)
        for number in range(20_000):
            publisher.publish(Int64(data=number))
        actor.node.destroy_node()
        await stage.until(lambda: not actor.node.connected)
        assert await watcher.get_node_names() == ["watcher"]
        assert received == list(range(20_000))
        assert (await stage.enter("actor", host="other")).connected
        assert not actor.task.done()
        actor.stop()
        assert await actor.ended() < 0.1
        assert actor.task.exception() is None

    play(scene)


def test_a_destroyed_node_whose_queue_is_stuck_leaves_in_time(caplog: pytest.LogCaptureFixture) -> None:
    """A reader that takes nothing does not keep a destroyed node in the graph; the loss is reported once."""

    async def scene(stage: Stage) -> None:
        reader = await stage.enter("reader")
        stuck = reader.create_subscription(Int64, "/out", qos_profile=KEEP_ALL)
        actor = Actor(stage, stop_timeout_sec=2)
        await actor.connected()
        publisher = actor.node.create_publisher(Int64, "/out", KEEP_ALL)
        await stage.until(lambda: endpoint_of(publisher).diagnostics().credit is not None)
        for number in range(WINDOW_MESSAGES + 1000):
            publisher.publish(Int64(data=number))
        actor.node.destroy_node()
        assert 1.9 < await stage.until(lambda: not actor.node.connected) < 2.5
        actor.stop()
        assert await actor.ended() < 0.1
        stuck.destroy()

    play(scene)
    assert caplog.text.count("1000 published messages were never sent: no time was left") == 1


async def test_a_task_of_the_node_that_fails_is_logged_and_ends_it(
    meeting: Meeting, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """A bug in the keepalive is no silent end of it: the node stops with the error."""

    def fail(*_: object, **__: object) -> None:
        raise RuntimeError("a bug")

    await meeting.restart_broker(keepalive_sec=0.1)
    monkeypatch.setattr("actors.session.connection.Keepalive.check", fail)
    with pytest.raises(RuntimeError, match="a bug"):
        async with meeting.absent("node"):
            await asyncio.sleep(30)
    assert "a task of its own has failed" in caplog.text
    assert "Traceback" in caplog.text

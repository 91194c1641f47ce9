"""Entering a node waits for the first attempt to connect; leaving sends what waits, or counts it."""

from __future__ import annotations

import asyncio
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING, Any, cast

import pytest

import actors
from actors.endpoints.timer import TimerSource
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int64
from actors.session.first_attempt import FIRST_ANSWER_SEC
from broker import Broker, BrokerOptions
from proto import limits
from proto.wire import frames
from proto.wire.codec import encode
from tests.simulation.network import BROKER, on_host
from tests.simulation.stage import play
from tests.simulation.test_alone import Mute

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator

    from actors import Node
    from tests.actors.meeting import Meeting
    from tests.simulation.stage import Stage

MUTE_PORT = 7412
MUTE = f"callboard://127.0.0.1:{MUTE_PORT}"
NOBODY = "callboard://127.0.0.1:7413"
BROKER_URL = "callboard://127.0.0.1:7411"


def make(name: str = "one", **options: Any) -> actors.Node:
    """Return a node that the command line of the tests does not reach."""
    return actors.Node(name, **{"use_global_arguments": False, **options})


@pytest.fixture
def adder() -> Any:
    """A callback of AddTwoInts."""
    return lambda request: AddTwoInts.Response(sum=request.a + request.b)


async def mute(stage: Stage) -> AsyncGenerator[None]:
    """Something that takes connections and never says a word."""
    with on_host(BROKER):
        listener = await stage.loop.create_server(Mute, "127.0.0.1", MUTE_PORT)
    try:
        yield
    finally:
        listener.close()
        await listener.wait_closed()


async def test_the_first_statement_may_publish(meeting: Meeting) -> None:
    """A node of one statement: its message arrives."""
    received: list[int] = []
    reader = await meeting.node("reader")
    reader.create_subscription(Int64, "out", lambda message: received.append(message.data))
    await meeting.settled(reader)
    async with meeting.absent("one") as node:
        node.create_publisher(Int64, "out").publish(Int64(data=7))
    await meeting.settled(reader)
    assert received == [7]


@pytest.mark.parametrize("timeout", [None, 20.0])
async def test_the_first_statement_may_call_and_query(
    meeting: Meeting, adder: Any, timeout: float | None
) -> None:
    """The node is in the graph when its body begins, and its clients can call."""
    (await meeting.node("server")).create_service(AddTwoInts, "add", adder)
    node = meeting.absent("one", connect_timeout_sec=timeout)
    early = node.create_client(AddTwoInts, "add")
    async with node:
        assert node.connected
        assert (await early.call(AddTwoInts.Request(a=1, b=2))).sum == 3
        assert (await node.create_client(AddTwoInts, "add").call(AddTwoInts.Request(a=4))).sum == 4
        assert await node.get_node_names() == ["one", "server"]


async def test_a_taken_name_ends_the_entry(meeting: Meeting) -> None:
    """The body of a second node of the same name does not begin."""
    await meeting.node("same")
    with pytest.raises(actors.NodeNameTaken):
        async with meeting.absent("same"):
            pytest.fail("it must not enter")


@pytest.mark.parametrize(("url", "seconds"), [(NOBODY, 0.0), (MUTE, FIRST_ANSWER_SEC)])
def test_without_a_broker_it_enters_soon(url: str, seconds: float) -> None:
    """At once after a refusal, and after a second without an answer; then it goes on trying."""

    async def scene(stage: Stage) -> None:
        async for _ in mute(stage):
            async with make(url=f"{url},{url}") as node:
                assert stage.loop.time() == pytest.approx(seconds, abs=0.01)
                assert not node.connected

    play(scene)


@pytest.mark.parametrize("first", [NOBODY, MUTE])
def test_a_second_broker_is_tried_within_the_same_second(first: str) -> None:
    """A first one that refuses or says nothing leaves time for the next."""

    async def scene(stage: Stage) -> None:
        async for _ in mute(stage):
            async with make(url=f"{first},{BROKER_URL}") as node:
                assert node.connected
                assert stage.loop.time() < FIRST_ANSWER_SEC

    play(scene)


class Greeter(Mute):
    """A peer that welcomes a node, and accepts none.

    Attributes:
        stays: Whether it keeps the connection after that.
    """

    stays = True

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Keep the transport."""
        self._transport = cast("asyncio.Transport", transport)
        self._welcome = encode(frames.Welcome(limits.PROTOCOL_VERSION, {"keepalive_ms": 60_000}))

    def buffer_updated(self, nbytes: int) -> None:
        """Welcome at the first bytes."""
        self._transport.write(self._welcome)
        self._welcome = b""
        if not self.stays:
            self._transport.close()


class Leaver(Greeter):
    """It hangs up after its welcome."""

    stays = False


@pytest.mark.parametrize(
    ("peer", "text"),
    [(Greeter, "has not accepted this node within 2 s$"), (Leaver, "within 2 s; it has closed the session")],
)
def test_a_connect_timeout_includes_the_acceptance_of_the_node(
    peer: type[Greeter], text: str, caplog: pytest.LogCaptureFixture
) -> None:
    """A session is not enough. What was published before is reported as not sent."""

    async def scene(stage: Stage) -> None:
        with on_host(BROKER):
            listener = await stage.loop.create_server(peer, "127.0.0.1", MUTE_PORT)
        node = make(url=MUTE, connect_timeout_sec=2.0)
        node.create_publisher(Int64, "/out").publish(Int64())
        with pytest.raises(actors.BrokerUnreachable, match=text) as caught:
            async with node:
                pytest.fail("it must not enter")
        assert f"The broker at {MUTE} has not accepted" in str(caught.value)
        assert stage.loop.time() == pytest.approx(2.0, abs=0.01)
        listener.close()
        await listener.wait_closed()

    play(scene)
    assert f"1 published messages were never sent: no link to a broker at {MUTE}" in caplog.text


async def test_an_entry_that_fails_leaves_nothing_running(
    meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also before it waits for the broker: the node is stopped, and can not be entered again."""
    node = meeting.absent("one")
    node.create_timer(1.0, lambda: None)
    tasks = asyncio.all_tasks()

    def fail(self: TimerSource) -> None:
        raise OSError("a bug")

    monkeypatch.setattr(TimerSource, "start", fail)
    with pytest.raises(OSError, match="a bug"):
        await node.__aenter__()
    assert asyncio.all_tasks() == tasks
    with pytest.raises(actors.NodeDestroyed):
        await node.__aenter__()


def test_many_nodes_wait_once() -> None:
    """Nodes entered one after the other do not each wait for a broker that says nothing."""

    async def scene(stage: Stage) -> None:
        async for _ in mute(stage):
            async with AsyncExitStack() as stack:
                for number in range(20):
                    await stack.enter_async_context(make(f"n{number}", url=MUTE))
                assert stage.loop.time() < FIRST_ANSWER_SEC + 0.1

    play(scene)


def test_a_wait_in_vain_counts_only_while_its_node_runs() -> None:
    """A later node enters connected to the broker that has come meanwhile."""

    async def scene(stage: Stage) -> None:
        async for _ in mute(stage):
            async with make(url=MUTE) as node:
                assert not node.connected
        with on_host(BROKER):
            late = Broker(BrokerOptions(port=MUTE_PORT))
            async with late, make("two", url=MUTE) as node:
                assert node.connected

    play(scene)


def test_nodes_that_start_before_the_broker_find_it() -> None:
    """Scripts start in any order: their first queries and calls end well when the broker is there."""

    async def scene(stage: Stage) -> None:
        await stage.crash_broker()
        async with make("server") as server, make("one") as node:
            server.create_service(AddTwoInts, "/add", lambda request: AddTwoInts.Response(sum=request.a))
            client = node.create_client(AddTwoInts, "/add")
            query = asyncio.create_task(node.count_clients("/add"))
            wait = asyncio.create_task(client.wait_for_service(10))
            await asyncio.sleep(1)
            await stage.start_broker()
            assert await query == 1
            assert await wait
            assert (await client.call(AddTwoInts.Request(a=5))).sum == 5

    play(scene)


def serve_add(node: Node) -> list[int]:
    """Serve /add; return a list that gets the first number of each request."""
    served: list[int] = []

    def add(request: AddTwoInts.Request) -> AddTwoInts.Response:
        served.append(request.a)
        return AddTwoInts.Response(sum=request.a + request.b)

    node.create_service(AddTwoInts, "/add", add)
    return served


def test_a_call_waits_for_the_first_session() -> None:
    """It is sent when there is one, with what is left of its deadline; a cancelled one is not."""

    async def scene(stage: Stage) -> None:
        await stage.crash_broker()
        async with make() as node:
            served = serve_add(node)
            client = node.create_client(AddTwoInts, "/add")
            calls = [client.call_async(AddTwoInts.Request(a=number), 5.0) for number in range(3)]
            calls[1].cancel()
            await asyncio.sleep(1)
            assert not calls[0].done()
            await stage.start_broker()
            assert [(await calls[number]).sum for number in (0, 2)] == [0, 2]
            assert served == [0, 2]

    play(scene)


def test_calls_keep_their_order_around_the_first_session() -> None:
    """A call made when the session is open, and the client not accepted yet, does not overtake others."""

    async def scene(stage: Stage) -> None:
        await stage.crash_broker()
        async with make() as node:
            served = serve_add(node)
            client = node.create_client(AddTwoInts, "/add")
            calls = [client.call_async(AddTwoInts.Request(a=number)) for number in range(2)]
            await stage.start_broker()
            await stage.until(lambda: node.connected, step=1e-6)
            assert not client.service_is_ready()  # the answers to the declarations are still on their way
            calls += [client.call_async(AddTwoInts.Request(a=number)) for number in range(2, 4)]
            await asyncio.gather(*calls)
            assert served == [0, 1, 2, 3]

    play(scene)


def test_without_a_broker_calls_and_queries_end_at_their_deadline() -> None:
    """And the error names the broker. Calls have a limit, and a node that stops ends them."""

    async def scene(stage: Stage) -> None:
        async with make(url=NOBODY) as node:
            client = node.create_client(AddTwoInts, "/add")
            with pytest.raises(actors.ServiceUnavailable, match=NOBODY):
                await client.call(AddTwoInts.Request(), 3.0)
            assert stage.loop.time() == pytest.approx(3, abs=0.01)
            with pytest.raises(actors.BrokerUnreachable, match=NOBODY):
                await node.get_node_names()
            calls = [client.call_async(AddTwoInts.Request()) for _ in range(1001)]
            assert [call.done() for call in calls] == [*[False] * 1000, True]
            with pytest.raises(actors.ServiceOverloaded):
                await calls[1000]
        for call in calls[:1000]:
            assert isinstance(call.exception(), actors.ServiceUnavailable)
        assert client.pending == 0

    play(scene)


def test_after_a_lost_session_calls_fail_at_once() -> None:
    """Only the first session is waited for."""

    async def scene(stage: Stage) -> None:
        node = await stage.enter("one")
        client = node.create_client(AddTwoInts, "/add")
        await stage.crash_broker()
        await stage.until(lambda: not node.connected)
        call = client.call_async(AddTwoInts.Request())
        assert call.done()
        with pytest.raises(actors.ServiceUnavailable, match="not connected to the broker at callboard://"):
            await call
        await stage.start_broker()

    play(scene)


def test_a_node_destroyed_or_cancelled_while_it_enters_ends() -> None:
    """`run` returns, `async with` goes on with a destroyed node, and a cancellation leaves nothing behind."""

    async def scene(stage: Stage) -> None:
        async for _ in mute(stage):
            runner, entered = make(url=MUTE, connect_timeout_sec=10.0), make(url=MUTE)
            running = asyncio.create_task(runner.run())
            stage.loop.call_later(0.1, entered.destroy_node)
            stage.loop.call_later(0.1, runner.destroy_node)
            async with entered:
                with pytest.raises(actors.NodeDestroyed):
                    entered.create_publisher(Int64, "/out")
            await running
            late = asyncio.create_task(make(url=f"{MUTE},{NOBODY}").run())
            await asyncio.sleep(0.1)
            late.cancel()
            await asyncio.wait({late})
            assert late.cancelled()
            assert stage.loop.time() < 0.5

    play(scene)


def test_leaving_waits_for_an_attempt_in_progress() -> None:
    """A broker that answers late still gets what was published."""

    async def scene(stage: Stage) -> None:
        reader, received = await stage.enter("reader"), []
        reader.create_subscription(Int64, "/out", lambda message: received.append(message.data))
        stage.network.block("one", BROKER)
        stage.loop.call_later(2.5, stage.network.heal)
        with on_host("one"):
            async with make() as node:
                assert not node.connected
                node.create_publisher(Int64, "/out").publish(Int64(data=7))
        await stage.until(lambda: received == [7])

    play(scene)


def test_leaving_waits_no_longer_than_its_time(caplog: pytest.LogCaptureFixture) -> None:
    """A broker that never answers gets `stop_timeout_sec`; then the loss is reported."""

    async def scene(stage: Stage) -> None:
        async for _ in mute(stage):
            async with make(url=MUTE, stop_timeout_sec=2.0) as node:
                node.create_publisher(Int64, "/out").publish(Int64())
                began = stage.loop.time()
            assert stage.loop.time() == pytest.approx(began + 2, abs=0.1)

    play(scene)
    assert f"1 published messages were never sent: no link to a broker at {MUTE}" in caplog.text


@pytest.mark.parametrize("destroy", [False, True])
def test_what_was_never_sent_is_counted_exactly(caplog: pytest.LogCaptureFixture, *, destroy: bool) -> None:
    """What an overflowing queue dropped before counts, too; and after a refusal nobody waits."""

    async def scene(stage: Stage) -> None:
        async with make(url=NOBODY) as node:
            for depth in (3, 10):
                publisher = node.create_publisher(Int64, "/out", depth)
                for number in range(15):
                    publisher.publish(Int64(data=number))
            if destroy:
                node.destroy_node()
        assert stage.loop.time() < 0.1

    play(scene)
    warnings = [each.getMessage() for each in caplog.records if "never sent" in each.getMessage()]
    assert warnings == [f"30 published messages were never sent: no link to a broker at {NOBODY}"]


async def test_a_host_that_cannot_be_resolved_is_named() -> None:
    """Nobody can start a broker there."""
    with pytest.raises(actors.BrokerUnreachable, match=r"The host name '\.\.' cannot be resolved"):
        async with make(url="callboard://..", connect_timeout_sec=0.5):
            pass

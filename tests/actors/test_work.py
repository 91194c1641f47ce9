"""How much is done per message: frames, tasks and copies are counted, where a timed test could only guess."""

from __future__ import annotations

import asyncio
from collections import Counter
from typing import TYPE_CHECKING, Any

import pytest

from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String, UInt8MultiArray
from proto import limits
from proto.aio.channel import Channel
from proto.wire import codec, frames
from proto.wire.codec import Decoder, encode
from tests.actors.meeting import KEEP_ALL, MIB, stop_budget_clock, until
from tests.seams.nodes import link_of
from tests.simulation.stage import Stage, play

if TYPE_CHECKING:
    from proto.wire.frames import Buffer, Frame
    from tests.actors.meeting import Meeting


@pytest.fixture(autouse=True)
async def _no_limit_for_callbacks() -> None:
    """Stop the clock of the callback budget: a slow machine would spread the work over more loop turns."""
    stop_budget_clock()


class Work:
    """What has been done since it began."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.frames: Counter[str] = Counter()
        self.tasks = 0
        self.flushes = 0
        self.encoded_runs = 0
        decode, flush, head = Decoder.decode_content, Channel.flush, codec.batch_head

        def counted_decode(decoder: Decoder, raw: Buffer) -> Frame:
            frame = decode(decoder, raw)
            self.frames[type(frame).__name__] += 1
            return frame

        def counted_flush(channel: Channel) -> None:
            self.flushes += 1
            flush(channel)

        def counted_head(*arguments: Any) -> bytes:
            self.encoded_runs += 1
            return head(*arguments)

        def counted_task(
            loop: asyncio.AbstractEventLoop, coroutine: Any, **options: Any
        ) -> asyncio.Task[Any]:
            self.tasks += 1
            return asyncio.Task(coroutine, loop=loop, **options)

        monkeypatch.setattr(Decoder, "decode_content", counted_decode)
        monkeypatch.setattr(Channel, "flush", counted_flush)
        monkeypatch.setattr("proto.queues.batches.batch_head", counted_head)
        asyncio.get_running_loop().set_task_factory(counted_task)


async def test_messages_of_a_turn_travel_in_few_frames(
    meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """1,000 messages of 256 bytes: a frame per 48 KiB and hop, each encoded once, and no task for any."""
    talker, listener = await meeting.node("talker"), await meeting.node("listener")
    received: list[str] = []
    listener.create_subscription(String, "t", lambda msg: received.append(msg.data), KEEP_ALL)
    publisher = talker.create_publisher(String, "t", KEEP_ALL)
    await until(lambda: publisher.get_subscription_count() == 1)
    await meeting.settled(listener, talker)  # the whole window has been granted
    work = Work(monkeypatch)
    message = String(data="x" * 256)
    for _ in range(1000):
        publisher.publish(message)
    await until(lambda: len(received) == 1000)
    most = 1000 * 300 // limits.BATCH_FLUSH_BYTES + 1
    assert work.encoded_runs <= most
    assert work.frames["Batch"] == 2 * work.encoded_runs  # once in the broker, once in the listener
    assert work.flushes <= 4 * work.encoded_runs
    assert work.tasks == 0


async def test_a_run_for_ten_subscriptions_of_a_link_crosses_it_once(
    meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The node fans out to its own subscriptions; the broker sends each link one copy."""
    talker, listener = await meeting.node("talker"), await meeting.node("listener")
    received: list[str] = []
    for _ in range(10):
        listener.create_subscription(String, "t", lambda msg: received.append(msg.data), 10)
    publisher = talker.create_publisher(String, "t", 10)
    await until(lambda: publisher.get_subscription_count() == 10)
    work = Work(monkeypatch)
    publisher.publish(String(data="once"))
    await until(lambda: len(received) == 10)
    assert (work.frames["Batch"], work.encoded_runs) == (2, 1)


async def test_calls_of_a_turn_travel_together(meeting: Meeting, monkeypatch: pytest.MonkeyPatch) -> None:
    """96 calls: three frames of 32 on each of four hops, no task for a plain handler, one timer."""
    server, caller = await meeting.node("server"), await meeting.node("caller")
    server.create_service(AddTwoInts, "add", lambda request: AddTwoInts.Response(sum=request.a + request.b))
    client = caller.create_client(AddTwoInts, "add")
    assert await client.wait_for_service(20)
    work = Work(monkeypatch)
    calls = [client.call_async(AddTwoInts.Request(a=n, b=1)) for n in range(3 * limits.CALLS_FLUSH_COUNT)]
    async with asyncio.timeout(20):
        sums = [(await call).sum for call in calls]
    assert sums == [n + 1 for n in range(3 * limits.CALLS_FLUSH_COUNT)]
    assert (work.frames["Request"], work.frames["Reply"]) == (6, 6)
    assert work.tasks == 0


async def test_cancellations_of_a_turn_travel_together(
    meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """10,000 calls given up in one turn: three frames to the broker, and three to the server."""
    server, caller = await meeting.node("server"), await meeting.node("caller")

    async def never(request: AddTwoInts.Request) -> AddTwoInts.Response:
        await asyncio.Event().wait()
        return AddTwoInts.Response()

    service = server.create_service(AddTwoInts, "add", never)
    client = caller.create_client(AddTwoInts, "add")
    assert await client.wait_for_service(20)
    calls = [client.call_async(AddTwoInts.Request(a=number)) for number in range(10_000)]
    await until(lambda: service.pending == 10_000)
    work = Work(monkeypatch)
    for call in calls:
        call.cancel()
    await until(lambda: service.pending == 0)
    assert work.frames["Cancel"] == 2 * 3
    assert work.tasks == 0


async def test_a_large_message_is_not_copied_into_its_reader(meeting: Meeting) -> None:
    """What the callback gets is a view of the bytes that came, read-only."""
    talker, listener = await meeting.node("talker"), await meeting.node("listener")
    received: list[UInt8MultiArray] = []
    listener.create_subscription(UInt8MultiArray, "t", received.append, KEEP_ALL)
    publisher = talker.create_publisher(UInt8MultiArray, "t", KEEP_ALL)
    await until(lambda: publisher.get_subscription_count() == 1)
    publisher.publish(UInt8MultiArray(data=bytes(MIB)))
    await until(lambda: received)
    data = received[0].data
    assert isinstance(data, memoryview)
    assert (len(data), data.readonly) == (MIB, True)
    assert len(memoryview(data.obj)) > MIB  # the frame around it, too


def test_idle_nodes_cost_nothing() -> None:
    """Nodes that nobody is matched with exchange no frame in 30 seconds; matched ones do."""

    async def scene(stage: Stage) -> None:
        nodes = [await stage.enter(f"idle{number}") for number in range(3)]
        await asyncio.sleep(10)
        channels = [link_of(node).channel for node in nodes]
        before = [channel.bytes_received for channel in channels if channel is not None]
        await asyncio.sleep(30)
        assert [channel.bytes_received for channel in channels if channel is not None] == before
        nodes[0].create_publisher(String, "t", 10)
        nodes[1].create_subscription(String, "t", lambda msg: None, 10)
        await asyncio.sleep(10)
        after = [channel.bytes_received for channel in channels if channel is not None]
        assert after[0] >= before[0] + 5 * len(encode(frames.Pong(0)))
        assert after[2] == before[2]

    play(scene)

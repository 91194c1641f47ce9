"""Calls that the broker refuses because others of the same node wait for the server are sent again."""

from __future__ import annotations

import asyncio
import math
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING

import pytest

import actors
from actors.interfaces.codec import codec_for
from actors.interfaces.message import type_hash, type_name
from proto.wire import frames
from tests.actors.meeting import DEADLINE_SEC, Blow, until
from tests.broker.rawclient import RawClient, link
from tests.seams.limits import set_limits

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from tests.actors.meeting import Meeting

MIB = 1024 * 1024
LIMIT = MIB
"""Bytes of calls that may wait for the server."""
SIZE = LIMIT * 5 // 8
"""Of a call beside which no other one fits."""
FIRST_SIZE = 16 * MIB
"""Much more than the kernel keeps for a connection that is not read."""


class Slow:
    """A server that does not read, and a node that calls it: one call waits, others are refused.

    Attributes:
        server: The server's link.
        node: The node.
        client: Its client.
        meeting: The broker.
    """

    def __init__(self, meeting: Meeting, server: RawClient, node: actors.Node) -> None:
        self.meeting = meeting
        self.server = server
        self.node = node
        self.client = node.create_client(Blow, "blow")

    def call(
        self, number: int, size: int = SIZE, timeout_sec: float = math.inf
    ) -> asyncio.Future[Blow.Response]:
        """Call the server."""
        return self.client.call_async(Blow.Request(size=number, data=bytes(size)), timeout_sec)

    async def first(self) -> asyncio.Future[Blow.Response]:
        """Make call 0, which uses up the limit, and wait until the broker has it."""
        before = self.meeting.broker.stats().pending_calls
        call = self.call(0, FIRST_SIZE)
        await until(lambda: self.meeting.broker.stats().pending_calls > before)
        return call

    async def refused(self, count: int) -> None:
        """Wait until the broker has refused this many calls."""
        await until(lambda: self.meeting.broker.stats().overloaded_calls >= count)

    async def serve(self, count: int) -> list[int]:
        """Read and answer this many requests; return the numbers in them."""
        self.server.go_on_reading()
        numbers: list[int] = []
        while len(numbers) < count:
            request = await self.server.next(frames.Request)
            for entry in request.entries:
                numbers.append(_number(entry.body))
                answer = frames.ReplyEntry(entry.call, 0, more=False, attributes=None, body=_ANSWER)
                self.server.send(frames.Reply(1, (answer,)))
        return numbers


_ANSWER = codec_for(Blow.Response).encode(Blow.Response())


def _number(body: bytes) -> int:
    return codec_for(Blow.Request).decode(body).size


@pytest.fixture
async def slow(meeting: Meeting) -> AsyncIterator[Slow]:
    await meeting.restart_broker(keepalive_sec=60, max_queued_call_bytes=LIMIT)
    async with AsyncExitStack() as stack:
        server = await stack.enter_async_context(link(meeting.broker, "/server"))
        server.send(frames.Service(1, 0, "/blow", type_name(Blow), type_hash(Blow), None))
        await server.synchronise()
        server.stop_reading()
        made = Slow(meeting, server, await meeting.node("caller"))
        assert await made.client.wait_for_service(DEADLINE_SEC)
        yield made


async def test_two_large_calls_at_once_succeed(slow: Slow) -> None:
    """Together they exceed the broker's limit: the second waits in the client until the server reads."""
    calls = [await slow.first(), slow.call(1), slow.call(2)]
    await slow.refused(2)
    assert slow.client.pending == 3
    assert sorted(await slow.serve(3)) == [0, 1, 2]
    await asyncio.gather(*calls)
    assert (slow.client.pending, slow.client.failed) == (0, 0)


async def test_refused_calls_are_sent_in_order(slow: Slow, monkeypatch: pytest.MonkeyPatch) -> None:
    """Calls that are made while others wait are sent after them, if the broker answers within the delay."""
    set_limits(monkeypatch, refused_call_delay_sec=1.0)
    slow.client = slow.node.create_client(Blow, "blow")
    calls = [await slow.first()]
    for number in range(1, 4):
        calls.append(slow.call(number, SIZE + number))
        await slow.refused(1)
    assert await slow.serve(4) == [0, 1, 2, 3]
    await asyncio.gather(*calls)


async def test_small_calls_wait_for_a_large_one(slow: Slow) -> None:
    """A small call that finds the limit used up by a large one succeeds, too."""
    calls = [await slow.first()]
    calls += [slow.call(number, 1) for number in range(1, 20)]
    await slow.refused(19)
    assert await slow.serve(20) == list(range(20))
    await asyncio.gather(*calls)


async def test_a_deadline_ends_a_refused_call(slow: Slow) -> None:
    """The time in the client counts; the error names the limit, and the server never gets the call."""
    first = await slow.first()
    with pytest.raises((actors.ServiceOverloaded, actors.ServiceTimeout)):
        await slow.call(2, timeout_sec=0.3)
    assert slow.client.timeouts == 1
    last = slow.call(3)
    assert await slow.serve(2) == [0, 3]
    await asyncio.gather(first, last)


async def test_a_refused_call_can_be_cancelled(slow: Slow) -> None:
    """It leaves nothing behind and is not sent."""
    first = await slow.first()
    second = slow.call(2)
    await slow.refused(1)
    second.cancel()
    last = slow.call(3)
    assert await slow.serve(2) == [0, 3]
    await asyncio.gather(first, last)
    assert slow.client.pending == 0


async def test_a_lost_session_fails_refused_calls(slow: Slow) -> None:
    """Like all calls in flight, at once."""
    calls = [await slow.first(), slow.call(2)]
    await slow.refused(1)
    await slow.meeting.stop_broker()
    for call in calls:
        with pytest.raises(actors.ServiceUnavailable):
            await call
    assert slow.client.pending == 0


async def test_the_end_of_the_node_ends_refused_calls(slow: Slow) -> None:
    """They fail as overloaded, or end with the client."""
    calls = [await slow.first(), slow.call(2)]
    await slow.refused(1)
    await slow.node.__aexit__(None, None, None)
    for call in calls:
        with pytest.raises((actors.ServiceUnavailable, actors.NodeDestroyed)):
            await call


async def test_too_many_refused_calls_fail(slow: Slow, monkeypatch: pytest.MonkeyPatch) -> None:
    """What waits in the client is limited; calls within the limit are not harmed."""
    set_limits(monkeypatch, refused_calls=1, refused_call_delay_sec=60)
    slow.client = slow.node.create_client(Blow, "blow")
    first = await slow.first()
    second = slow.call(2)
    await slow.refused(1)
    third = slow.call(3)
    fourth = slow.call(4, 1)
    for call in (third, fourth):
        with pytest.raises(actors.ServiceOverloaded, match="max-queued-call-bytes"):
            await call
    assert not second.done()
    assert await slow.serve(1) == [0]
    await first
    await slow.node.__aexit__(None, None, None)
    with pytest.raises((actors.ServiceOverloaded, actors.ServiceUnavailable, actors.NodeDestroyed)):
        await second  # otherwise its error would be logged while another test runs

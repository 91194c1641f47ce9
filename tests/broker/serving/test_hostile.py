"""Hostile input beyond `tests/hostile/bytes`: only the connection at fault closes, with a reason."""

from __future__ import annotations

import asyncio
import logging
import struct
from typing import TYPE_CHECKING

import pytest

from broker import Broker, BrokerOptions
from proto.errors import ErrorCode
from proto.wire import frames
from proto.wire.codec import encode
from proto.wire.type_hash import hash_of
from tests.broker import frame_makers as make
from tests.broker.rawclient import DEADLINE_SEC, RawClient, hello, link, read_error, stream, until
from tests.broker.rawclient import GREETING_BYTES as GREETING

if TYPE_CHECKING:
    from collections.abc import AsyncIterator


@pytest.fixture
async def broker() -> AsyncIterator[Broker]:
    """A broker on a free port."""
    async with Broker(BrokerOptions(port=0, drain_timeout_sec=0.2)) as running:
        yield running


@pytest.fixture
async def bystander(broker: Broker) -> AsyncIterator[RawClient]:
    """An innocent link; afterwards it is still served, alone, and nothing of the guilty one is left."""
    async with link(broker, "/bystander") as client:
        yield client
        await until(lambda: broker.stats().connections == 1)
        await client.synchronise()
        assert client.problem is None
        assert broker.stats().endpoints == 1


@pytest.mark.usefixtures("bystander")
async def test_frames_sent_before_the_welcome_are_handled_after_it(broker: Broker) -> None:
    """Case 61: HELLO, NODE and a publisher in one write (§4.1.1): the answers come in this order."""
    async with RawClient().connected(broker) as client:
        client.send(hello(), frames.Node(0, "/early"), make.publisher(1), frames.Ping(3))
        kinds = [type(await client.next(object)) for _ in range(4)]
        assert kinds == [frames.Welcome, frames.Accepted, frames.Accepted, frames.Pong]


@pytest.mark.usefixtures("bystander")
async def test_frames_sent_before_an_error_are_lost(broker: Broker) -> None:
    """Case 61: what follows a HELLO that is refused declares nothing (§4.1.1)."""
    bad = frames.Hello(99, {"instance": b"i" * 16, "token": b"t" * 16})
    async with stream(broker) as (reader, writer):
        writer.write(encode(bad) + encode(frames.Node(0, "/early")))
        error = await read_error(reader)
        assert error is not None
        assert error.code == ErrorCode.VERSION


@pytest.mark.usefixtures("bystander")
async def test_an_id_can_be_declared_again_after_undeclare(broker: Broker) -> None:
    """Case 61: an id in use ends the session; a free one is accepted, as another endpoint too (§5.1.1)."""
    async with link(broker, "/n") as client:
        client.send(make.publisher(1), frames.Undeclare(1), make.subscription(1), make.publisher(2))
        numbers = [(await client.next(frames.Accepted)).id for _ in range(3)]
        assert numbers == [1, 1, 2]
        matched = {await client.next(frames.Matched) for _ in range(2)}
        assert matched == {frames.Matched(1, 1, 1), frames.Matched(2, 1, 1)}
        client.send(make.publisher(2))
        assert (await client.next(frames.Error)).code == ErrorCode.UNEXPECTED


@pytest.mark.usefixtures("bystander")
async def test_a_session_split_at_every_byte_is_understood(broker: Broker) -> None:
    """Case 5: segment boundaries have no meaning."""
    async with stream(broker) as (reader, writer):
        for byte in GREETING + encode(frames.Node(0, "/split")) + encode(frames.Ping(77)):
            writer.write(bytes([byte]))
            await asyncio.sleep(0)
        async with asyncio.timeout(DEADLINE_SEC):
            await reader.readuntil(encode(frames.Pong(77)))


@pytest.mark.usefixtures("bystander")
async def test_ten_thousand_frames_in_one_segment_are_all_answered(broker: Broker) -> None:
    """Case 5: the broker handles a whole burst."""
    async with link(broker) as client:
        client.send(*(frames.Ping(token) for token in range(10_000)))
        for token in range(10_000):
            assert (await client.next(frames.Pong)).token == token


@pytest.mark.usefixtures("bystander")
@pytest.mark.parametrize("how", ["reset", "half-close"])
async def test_an_end_in_mid_frame_leaves_nothing(broker: Broker, how: str) -> None:
    """Case 9: a reset or a half-close removes the endpoints of the link."""
    async with stream(broker) as (reader, writer):
        writer.write(GREETING + encode(frames.Node(0, "/short")) + encode(frames.Ping(1)))
        await reader.readuntil(encode(frames.Pong(1)))
        writer.write(encode(make.publisher(1))[:-3])
        if how == "reset":
            writer.transport.get_extra_info("socket").setsockopt(1, 13, struct.pack("ii", 1, 0))
            writer.transport.abort()
        else:
            writer.write_eof()
            assert await read_error(reader) is None


@pytest.mark.usefixtures("bystander")
async def test_the_log_has_one_escaped_line(broker: Broker, caplog: pytest.LogCaptureFixture) -> None:
    """Case 20: a closed link is one warning, without control characters from the peer."""
    async with link(broker, agent="evil\x1b[2J\nforged line") as client:
        with caplog.at_level(logging.INFO, "callboard.broker"):
            client.send(make.batch(12345, 0))
            assert (await client.next(frames.Error)).code == ErrorCode.UNKNOWN_ID
            await client.gone()
    lines = [record.getMessage() for record in caplog.records if record.name == "callboard.broker"]
    assert len(lines) == 1
    assert "\x1b" not in lines[0]
    assert "\n" not in lines[0]


@pytest.mark.usefixtures("bystander")
async def test_questions_without_reading_the_answers_close_the_link() -> None:
    """Case 29: control frames are never dropped, so a peer that does not read them is closed at the limit."""
    options = BrokerOptions(port=0, max_queue_bytes=2**20, drain_timeout_sec=0.2)
    async with Broker(options) as small, link(small, "/n") as deaf:
        definition = bytes(60_000)
        defined = hash_of(definition)
        deaf.send(make.publisher(1, type_hash=defined)._replace(definition=definition))
        await deaf.synchronise()
        deaf.stop_reading()
        async with asyncio.timeout(30):
            while small.stats().endpoints:
                deaf.send(*[frames.Describe(defined)] * 20)
                await asyncio.sleep(0)


async def test_a_keep_all_reader_that_lies_about_its_window_is_bounded() -> None:
    """Case 29: unlimited credit from a reader that does not read must not fill the broker's memory."""
    most = 2**20
    options = BrokerOptions(port=0, max_queue_bytes=most, drain_timeout_sec=0.2)
    async with Broker(options) as small, link(small, "/a") as a, link(small, "/b") as b:
        b.send(make.subscription(1, qos=make.KEEP_ALL, window=2**63, window_bytes=2**63))
        await b.synchronise()
        a.send(make.publisher(1, qos=make.KEEP_ALL))
        number = (await a.next(frames.Accepted)).number
        a.send(await a.next(frames.Credit))
        b.stop_reading()
        for first in range(500):
            a.send(make.batch(number, first, 1, size=200_000))
            await a.synchronise()
            if small.stats().unmatched:
                break
        assert small.stats().unmatched
        assert small.stats().queued == 0
        b.go_on_reading()
        assert (await b.next(frames.Error)).code == ErrorCode.LIMIT
        await b.gone()


async def test_a_keep_last_reader_that_stops_costs_its_depth() -> None:
    """Cases 29 and 30: a stopped reader holds `depth` messages; the rest is dropped, and counted."""
    async with (
        Broker(BrokerOptions(port=0, drain_timeout_sec=0.2)) as running,
        link(running, "/a") as a,
        link(running, "/b") as b,
    ):
        b.send(make.subscription(1, qos={"depth": 5}))
        await b.synchronise()
        a.send(make.publisher(1))
        number = (await a.next(frames.Accepted)).number
        b.stop_reading()
        for first in range(400):
            a.send(make.batch(number, first, 1, size=100_000))
            await a.synchronise()
        stats = running.stats()
        assert stats.queued == 5
        assert stats.dropped > 300
        assert stats.accounted == stats.copies


async def test_endpoints_beyond_the_limit_are_refused() -> None:
    """Case 27: one link cannot declare without end, and another one still can."""
    options = BrokerOptions(port=0, max_endpoints=10, drain_timeout_sec=0.2)
    async with (
        Broker(options) as running,
        link(running, "/greedy") as greedy,
        link(running, "/other") as other,
    ):
        greedy.send(*(make.subscription(n, f"/t{n}") for n in range(1, 101)))
        await greedy.synchronise()
        assert (running.stats().endpoints, running.stats().refused_declarations) == (11, 91)
        other.send(make.subscription(1))
        await other.synchronise()
        assert (running.stats().endpoints, running.stats().connections) == (12, 2)


async def test_a_subscription_on_each_of_many_topics_costs_the_same() -> None:
    """Case 27: ten thousand endpoints of one link are declared, and forgotten, in seconds."""
    async with (
        Broker(BrokerOptions(port=0, drain_timeout_sec=0.2)) as running,
        link(running, "/viewer") as viewer,
    ):
        async with link(running, "/many") as many:
            many.send(*(make.subscription(n, f"/t{n}") for n in range(1, 10_001)))
            await many.synchronise()
            assert running.stats().endpoints == 10_002
        await until(lambda: running.stats().connections == 1)
        await viewer.synchronise()
        assert running.stats().endpoints == 1

"""Messages that are never finished: what is held of them is limited for each link, in all, and in time."""

from __future__ import annotations

import asyncio
from contextlib import AsyncExitStack
from typing import cast

import pytest

import actors
from actors.interfaces.std_msgs.msg import String
from broker import Broker, BrokerOptions
from proto import limits
from proto.errors import ErrorCode
from proto.wire import frames
from proto.wire.codec import BIN_32
from proto.wire.fragments import MAP_ABOVE_BYTES, Reassembler, ReassemblyTotal
from tests.allocations import peak_bytes
from tests.broker import frame_makers as make
from tests.broker.rawclient import link, until
from tests.seams.nodes import link_of

pytestmark = pytest.mark.usefixtures("patience")

KIB = 1024


async def test_incomplete_messages_of_a_link_are_limited() -> None:
    """Case 47: the link that sends more than max_reassembly_bytes of incomplete messages is closed."""
    options = BrokerOptions(
        port=0, max_message_bytes=16 * KIB * KIB, max_reassembly_bytes=65_536, drain_timeout_sec=0.2
    )
    async with Broker(options) as broker, link(broker) as guilty, link(broker, "/other") as other:
        for transfer in range(3):
            guilty.send(*make.fragments(transfer, 6 * KIB * KIB))
        error = await guilty.next(frames.Error)
        assert (error.code, "max_reassembly_bytes" in error.text) == (ErrorCode.LIMIT, True)
        await until(lambda: broker.stats().connections == 1)
        assert broker.stats().reassembly_bytes == 0
        await other.synchronise()


async def test_incomplete_messages_of_all_links_are_limited() -> None:
    """Case 47: beyond max_total_reassembly_bytes the link with most of them is closed, and no other."""
    options = BrokerOptions(port=0, max_total_reassembly_bytes=4 * KIB * KIB, drain_timeout_sec=0.2)
    async with AsyncExitStack() as stack:
        broker = await stack.enter_async_context(Broker(options))
        modest, guilty, other = [await stack.enter_async_context(link(broker)) for _ in range(3)]
        modest.send(*make.fragments(1, KIB * KIB))
        guilty.send(*make.fragments(1, 2 * KIB * KIB))
        await guilty.synchronise()
        other.send(*make.fragments(1, 1800 * KIB))
        error = await guilty.next(frames.Error)
        assert (error.code, "--max-total-reassembly-bytes" in error.text) == (ErrorCode.LIMIT, True)
        await until(lambda: broker.stats().connections == 2)
        await modest.synchronise()
        await other.synchronise()
        assert 2 * KIB * KIB < broker.stats().reassembly_bytes < 3 * KIB * KIB
        modest.send(frames.Abort(1))
        other.send(frames.Abort(1))
        await modest.synchronise()
        await other.synchronise()
        assert broker.stats().reassembly_bytes == 0


def test_a_very_large_message_is_not_copied_while_it_grows() -> None:
    """Cases 47, 53: its buffer has its final size after the first eighth, and no fragment moves it again."""
    size, part = MAP_ABOVE_BYTES + KIB, bytes(range(256)) * 1024

    def receive() -> None:
        reassembler = Reassembler()
        whole: frames.Buffer | None = None
        for start in range(0, size, len(part)):
            more = start + len(part) < size
            fragment = frames.Fragment(1, None if start else size, more, part[: size - start])
            whole = reassembler.add(fragment)
            assert (whole is None) == more
        assert whole is not None
        assert len(whole) == size
        assert bytes(whole[: 2 * len(part)]) == part * 2
        assert bytes(whole[-KIB:]) == part[:KIB]
        assert not reassembler.held_bytes

    assert peak_bytes(receive) < size // 4


def test_a_reassembler_knows_for_how_long_a_message_has_not_grown() -> None:
    """Case 47: each incomplete message has a time of its own; completing one, or giving it up, ends it."""
    total = ReassemblyTotal()
    reassembler = Reassembler(total=total)
    reassembler.add(frames.Fragment(1, 10, True, b"ab"))
    assert reassembler.idle_sec(100.0) == 0
    reassembler.add(frames.Fragment(2, 10, True, b"ab"))
    assert reassembler.idle_sec(110.0) == 10
    reassembler.add(frames.Fragment(1, None, True, b"c"))
    assert (reassembler.idle_sec(115.0), total.bytes) == (5, 5)
    reassembler.abort(frames.Abort(2))
    assert (reassembler.idle_sec(116.0), total.bytes, reassembler.held_bytes) == (1, 3, 3)
    assert bytes(reassembler.add(frames.Fragment(1, None, False, b"defghij")) or b"") == b"abcdefghij"
    assert (reassembler.idle_sec(200.0), total.bytes, reassembler.held_bytes) == (0, 0, 0)


async def test_a_link_with_an_idle_incomplete_message_is_closed() -> None:
    """Case 47: the periodic check closes the link that does not go on, and no other."""
    options = BrokerOptions(port=0, reassembly_timeout_sec=0.2, keepalive_sec=0.6, drain_timeout_sec=0.2)
    async with Broker(options) as broker, link(broker) as guilty, link(broker) as other:
        guilty.send(*make.fragments(1, 200 * KIB))
        error = await guilty.next(frames.Error)
        assert (error.code, "--reassembly-timeout-sec" in error.text) == (ErrorCode.TIMEOUT, True)
        await other.synchronise()
        await until(lambda: broker.stats().connections == 1)
        assert broker.stats().reassembly_timeouts == 1


async def test_large_messages_wait_at_the_client_for_the_limit_of_the_broker() -> None:
    """Eight transfers at once are no attack: the client keeps the limit that WELCOME has announced."""
    options = BrokerOptions(
        port=0, max_message_bytes=2**21, max_reassembly_bytes=2**22, drain_timeout_sec=0.2
    )
    async with Broker(options) as broker, actors.Node("writer", url=broker.url) as node:
        channel = link_of(node).channel
        assert channel is not None
        for index in range(8):
            publisher = node.create_publisher(String, f"t{index}", 10)
            publisher.publish(String(data="x" * 2_000_000))
        most = 0
        while sum(topic.messages for topic in broker.topic_stats()) < 8:
            await asyncio.sleep(0)
            most = max(most, broker.stats().reassembly_bytes)
        assert most <= 2**22
        assert broker.stats().connections == 1


async def test_starts_of_large_frames_count() -> None:
    """Case 47: each start claims memory for the whole frame; at the limit links that hold most close."""
    size, limit = limits.MAX_FRAME_BYTES, 2 * KIB * KIB
    start = bytes((BIN_32,)) + size.to_bytes(4, "big") + bytes(size // 8)
    options = BrokerOptions(port=0, max_broker_bytes=limit, drain_timeout_sec=0.2)
    async with AsyncExitStack() as stack:
        broker = await stack.enter_async_context(Broker(options))
        links = [await stack.enter_async_context(link(broker)) for _ in range(12)]
        for each in links[:4]:
            cast("asyncio.WriteTransport", each.transport).write(start)
        await until(lambda: broker.stats().received_bytes > 4 * size)
        assert broker.stats().held_bytes == broker.stats().received_bytes
        for each in links[4:]:
            cast("asyncio.WriteTransport", each.transport).write(start)
        await until(lambda: broker.stats().closed_for_memory and broker.stats().held_bytes <= limit)
        assert broker.stats().connections >= 6
    assert broker.stats().received_bytes == 0

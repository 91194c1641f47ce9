"""Floods of calls: the client at fault is refused; the server and other clients lose nothing."""

from __future__ import annotations

import logging
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING

from broker import Broker, BrokerOptions
from proto.limited_log import MAX_LINES
from proto.wire import frames
from proto.wire.codes import Status
from tests.broker import frame_makers as make
from tests.broker.rawclient import RawClient, link

if TYPE_CHECKING:
    import pytest

KIB = 1024


async def serve(stack: AsyncExitStack, broker: Broker) -> RawClient:
    """Declare a server that does not read."""
    server = await stack.enter_async_context(link(broker, "/server"))
    server.send(make.service(1))
    await server.synchronise()
    server.stop_reading()
    return server


async def caller(stack: AsyncExitStack, broker: Broker, node: str) -> RawClient:
    """Declare a client of the same service."""
    client = await stack.enter_async_context(link(broker, node))
    client.send(make.client(1))
    await client.synchronise()
    return client


async def flood(broker: Broker, client: RawClient, body: bytes) -> int:
    """Call until 50 more calls are refused as OVERLOADED; return how many were not."""
    before, calls = broker.stats().overloaded_calls, 0
    while (refused := broker.stats().overloaded_calls - before) < 50:
        client.send(make.request(1, *range(calls, calls + 10), body=body))
        calls += 10
        await client.synchronise()
    return calls - refused


async def test_a_flood_of_calls_is_refused_and_the_server_stays() -> None:
    """Case 52: the flooding client gets OVERLOADED; the server and other clients lose nothing."""
    options = BrokerOptions(
        port=0, max_queue_bytes=512 * KIB, max_queued_call_bytes=128 * KIB, drain_timeout_sec=0.2
    )
    async with AsyncExitStack() as stack:
        broker = await stack.enter_async_context(Broker(options))
        server = await serve(stack, broker)
        greedy = await caller(stack, broker, "/greedy")
        innocent = await caller(stack, broker, "/innocent")
        accepted = await flood(broker, greedy, bytes(20 * KIB))
        innocent.send(make.request(1, 7))
        await innocent.synchronise()
        stats = broker.stats()
        assert (stats.connections, stats.overloaded_calls) == (3, stats.refused_calls)
        server.go_on_reading()
        served = 0
        while served <= accepted:
            request = await server.next(frames.Request)
            served += len(request.entries)
            server.send(make.reply(1, *(entry.call for entry in request.entries)))
        answer = await innocent.next(frames.Reply)
        assert [(entry.call, entry.status) for entry in answer.entries] == [(7, Status.OK)]
        greedy.send(make.request(1, 2**32))
        await server.next(frames.Request)


async def test_refused_calls_are_logged_together(caplog: pytest.LogCaptureFixture) -> None:
    """Case 52: floods give a few lines with the option, and then one with the number of the others."""
    caplog.set_level(logging.WARNING, "callboard.broker")
    options = BrokerOptions(port=0, max_queued_call_bytes=4 * KIB, drain_timeout_sec=0.2)
    async with AsyncExitStack() as stack:
        broker = await stack.enter_async_context(Broker(options))
        await serve(stack, broker)
        await flood(broker, await caller(stack, broker, "/first"), bytes(200 * KIB))
        await flood(broker, await caller(stack, broker, "/second"), bytes(200 * KIB))
    *lines, total = [each.getMessage() for each in caplog.records if "efused calls" in each.getMessage()]
    assert len(lines) == MAX_LINES
    assert "--max-queued-call-bytes" in lines[0]
    assert total.endswith("more like this: refused calls")


async def test_many_flooding_clients_leave_space_for_others() -> None:
    """Case 52: shares shrink as more clients flood one server, so that a small call still passes."""
    options = BrokerOptions(port=0, max_bulk_bytes=KIB * KIB, drain_timeout_sec=0.2)
    async with AsyncExitStack() as stack:
        broker = await stack.enter_async_context(Broker(options))
        await serve(stack, broker)
        for index in range(3):
            await flood(broker, await caller(stack, broker, f"/greedy{index}"), bytes(20 * KIB))
        innocent = await caller(stack, broker, "/innocent")
        innocent.send(make.request(1, 7))
        refused = broker.stats().overloaded_calls
        await innocent.synchronise()
        assert (broker.stats().overloaded_calls, broker.stats().connections) == (refused, 5)


async def test_one_larger_call_is_allowed_if_no_other_waits() -> None:
    """Case 52: a call above the limit waits alone; a second one, and a cancelled call, are not too many."""
    options = BrokerOptions(port=0, max_queued_call_bytes=4 * KIB, drain_timeout_sec=0.2)
    async with AsyncExitStack() as stack:
        broker = await stack.enter_async_context(Broker(options))
        server = await serve(stack, broker)
        client = await caller(stack, broker, "/client")
        large = bytes(8 * KIB * KIB)
        client.send(make.request(1, 1, body=large))
        await client.synchronise()
        client.send(make.request(1, 2, body=large))
        refusal = await client.next(frames.Reply)
        assert [(entry.call, entry.status) for entry in refusal.entries] == [(2, Status.OVERLOADED)]
        assert b"--max-queued-call-bytes" in refusal.entries[0].body
        client.send(frames.Cancel(1, (1,)), make.request(1, 3, body=large))
        await client.synchronise()
        assert broker.stats().overloaded_calls == 1
        server.go_on_reading()
        assert len((await server.next(frames.Request)).entries[0].body) == len(large)

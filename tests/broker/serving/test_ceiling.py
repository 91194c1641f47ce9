"""The ceiling of a link (docs/protocol.md §6.4.3): a link with more than may wait is closed."""

from __future__ import annotations

import logging
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING, Final

import pytest

from broker import Broker, BrokerOptions
from proto.errors import ErrorCode
from proto.wire import frames
from tests.broker import frame_makers as make
from tests.broker.rawclient import RawClient, link, until
from tests.seams.brokers import dispatcher_of

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

CEILING: Final = 2**20
TOPICS: Final = 4
SIZE: Final = 20_000
TEXT: Final = (
    f"more than {CEILING} bytes of messages that must not be dropped wait for this link: it reads too slowly"
    " (the broker's --max-link-bytes)"
)


@pytest.fixture
async def broker() -> AsyncIterator[Broker]:
    """A broker of which little may wait for one link."""
    async with Broker(BrokerOptions(port=0, max_link_bytes=CEILING, drain_timeout_sec=0.2)) as running:
        yield running


async def writers(stack: AsyncExitStack, broker: Broker, count: int) -> list[tuple[RawClient, int]]:
    """Bring up so many links with a publisher each, on topics /t0 and so on; return them and its number."""
    found = []
    for index in range(count):
        writer = await stack.enter_async_context(link(broker, f"/writer{index}"))
        writer.send(make.publisher(1, f"/t{index}", qos=make.KEEP_ALL))
        found.append((writer, (await writer.next(frames.Accepted)).number))
    return found


def held(broker: Broker) -> int:
    """Return the most that waits for one link."""
    return max(connection.channel.outbox.held_bytes for connection in dispatcher_of(broker).links)


@pytest.mark.parametrize("late", [False, True])
async def test_keep_all_beyond_the_ceiling_ends_the_link_and_no_other(
    broker: Broker, caplog: pytest.LogCaptureFixture, *, late: bool
) -> None:
    """The peer gets the reason if it reads in time; other links miss nothing."""
    caplog.set_level(logging.WARNING, "callboard.broker")
    async with AsyncExitStack() as stack:
        sources = await writers(stack, broker, TOPICS)
        greedy = await stack.enter_async_context(link(broker, "/greedy"))
        bystander = await stack.enter_async_context(link(broker, "/bystander"))
        for index in range(TOPICS):
            greedy.send(
                make.subscription(
                    index + 1, f"/t{index}", qos=make.KEEP_ALL, window=2**40, window_bytes=2**40
                )
            )
            bystander.send(make.subscription(index + 1, f"/t{index}", qos={"depth": 1000}))
        await greedy.synchronise()
        await bystander.synchronise()
        for writer, _ in sources:
            writer.send(await writer.next(frames.Credit))
        greedy.stop_reading()
        most = sent = 0
        while broker.stats().connections == TOPICS + 2 and not caplog.records:
            for writer, number in sources:
                writer.send(make.batch(number, sent, 1, size=SIZE))
                await writer.synchronise()
                most = max(most, held(broker))
            sent += 1
        # The last batch may have exceeded the limit before the link ended.
        assert most <= CEILING + SIZE + 1000
        assert [TEXT in record.getMessage() for record in caplog.records] == [True]
        if not late:
            greedy.go_on_reading()
            error = await greedy.next(frames.Error)
            assert (error.code, error.text) == (ErrorCode.LIMIT, TEXT)
            await greedy.gone()
        await until(lambda: broker.stats().connections == TOPICS + 1)
        stats = broker.stats()
        assert stats.lost_on_break
        assert (stats.accounted, stats.queued, stats.dropped) == (stats.copies, 0, 0)
        received: dict[int, list[int]] = {number: [] for _, number in sources}
        for _ in range(sent * TOPICS):
            batch = await bystander.next(frames.Batch)
            received[batch.publisher].append(batch.first_sequence)
        assert all(numbers == list(range(sent)) for numbers in received.values())
        for writer, _ in sources:
            await writer.synchronise()


LARGE: Final = 1_000_000


@pytest.fixture
async def narrow() -> AsyncIterator[Broker]:
    """A broker of which few small frames may wait for one link, and some large ones."""
    options = BrokerOptions(port=0, max_queue_bytes=LARGE, max_bulk_bytes=8 * LARGE, drain_timeout_sec=0.2)
    async with Broker(options) as running:
        yield running


async def test_a_reader_gets_all_latched_messages(narrow: Broker) -> None:
    """Large latched messages have a limit of their own, above the one of small frames."""
    async with AsyncExitStack() as stack:
        talker = await stack.enter_async_context(link(narrow, "/talker"))
        for index in range(5):
            talker.send(make.publisher(index + 1, f"/t{index}", qos=make.LATCHED))
            number = (await talker.next(frames.Accepted)).number
            talker.send(make.batch(number, 0, 1, size=LARGE))
        await until(lambda: narrow.stats().latched == 5)
        late = await stack.enter_async_context(link(narrow, "/late"))
        late.send(*(make.subscription(index + 1, f"/t{index}", qos=make.LATCHED) for index in range(5)))
        got = [await late.next(frames.Replay) for _ in range(5)]
        assert sorted(replay.subscription for replay in got) == [1, 2, 3, 4, 5]
        assert narrow.stats().connections == 2


async def test_a_caller_gets_all_large_answers(narrow: Broker) -> None:
    """Large answers have a limit of their own, above the one of small calls."""
    async with link(narrow, "/server") as server, link(narrow, "/caller") as caller:
        server.send(make.service(1))
        await server.synchronise()
        caller.send(make.client(1), make.request(1, 1, 2, 3, 4, 5))
        calls: list[int] = []
        while len(calls) < 5:
            calls += [entry.call for entry in (await server.next(frames.Request)).entries]
        server.send(*(make.reply(1, call, body=bytes(LARGE)) for call in calls))
        got = [(await caller.next(frames.Reply)).entries[0] for _ in range(5)]
        assert [(entry.call, len(entry.body)) for entry in got] == [(n, LARGE) for n in range(1, 6)]


async def test_large_answers_beyond_the_ceiling_end_the_link(narrow: Broker) -> None:
    """A caller that does not read its answers is closed."""
    async with link(narrow, "/server") as server, link(narrow, "/caller") as caller:
        server.send(make.service(1))
        await server.synchronise()
        caller.send(make.client(1), make.request(1, *range(1, 31)))
        calls: list[int] = []
        while len(calls) < 30:
            calls += [entry.call for entry in (await server.next(frames.Request)).entries]
        caller.stop_reading()
        server.send(*(make.reply(1, call, body=bytes(LARGE)) for call in calls))
        await until(lambda: narrow.stats().connections == 1)
        await server.synchronise()

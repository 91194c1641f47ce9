"""Iterations whose steps are cancelled, as by a time limit: they go on, and nothing is lost."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import pytest

import actors
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.std_msgs.msg import Int64
from proto.wire.codes import EntryKind
from tests.actors.meeting import DEADLINE_SEC, KEEP_ALL, turns, until

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from actors.endpoints.iteration import Iteration
    from tests.actors.meeting import Meeting

COUNT: Final = 40


class Source(NamedTuple):
    """What is iterated over.

    Attributes:
        items: The iteration.
        emit: Adds an item with a number.
        numbers: Return the numbers of what the iteration has returned.
    """

    items: Iteration[Any]
    emit: Callable[[int], object]
    numbers: Callable[[Any], list[int]]


async def messages(meeting: Meeting) -> Source:
    """Return the messages of a subscription."""
    talker, listener = await meeting.node("talker"), await meeting.node("listener")
    publisher = talker.create_publisher(Int64, "numbers", KEEP_ALL)
    subscription = listener.create_subscription(Int64, "numbers", qos_profile=KEEP_ALL)
    await publisher.wait_for_subscriptions()
    return Source(
        aiter(subscription),
        lambda number: publisher.publish(Int64(data=number)),
        lambda message: [message.data],
    )


async def feedback(meeting: Meeting) -> Source:
    """Return the feedback of a goal."""
    goals: list[actors.ServerGoalHandle[Any, Any, Any]] = []

    async def execute(goal: actors.ServerGoalHandle[Any, Any, Any]) -> Fibonacci.Result:
        goals.append(goal)
        await asyncio.Event().wait()
        raise AssertionError

    server, caller = await meeting.node("server", stop_timeout_sec=0.1), await meeting.node("caller")
    server.create_action_server(Fibonacci, "count", execute)
    client = caller.create_action_client(Fibonacci, "count")
    await client.wait_for_server(DEADLINE_SEC)
    handle = await client.send_goal(Fibonacci.Goal(), timeout_sec=DEADLINE_SEC)
    await until(lambda: goals)
    return Source(
        aiter(handle),
        lambda number: goals[0].publish_feedback(Fibonacci.Feedback(sequence=[number])),
        lambda item: list(item.sequence),
    )


def number_of(change: actors.GraphChange) -> list[int]:
    """Return the number of a topic that has appeared; nothing for other changes."""
    is_numbered = change.entry_kind is EntryKind.PUBLISHER and change.name.startswith("/n")
    return [int(change.name[2:])] if is_numbered else []


def numbers_of(found: list[actors.GraphChange]) -> list[int]:
    """Return the numbers of the topics that have appeared."""
    return [number for change in found for number in number_of(change)]


async def until_nothing_comes(items: Iteration[Any]) -> None:
    """Step until a step has been cancelled by a time limit."""
    while True:
        await asyncio.wait_for(anext(items), 0.01)


async def changes(meeting: Meeting) -> Source:
    """Return the changes of the graph, one by one."""
    talker, watcher = await meeting.node("talker"), await meeting.node("watcher")
    return Source(
        aiter(watcher.watch_graph()),
        lambda number: talker.create_publisher(Int64, f"n{number}", 1),
        number_of,
    )


async def batches(meeting: Meeting) -> Source:
    """Return the changes of the graph that arrived together."""
    talker, watcher = await meeting.node("talker"), await meeting.node("watcher")
    return Source(
        watcher.watch_graph().batches(),
        lambda number: talker.create_publisher(Int64, f"n{number}", 1),
        numbers_of,
    )


SOURCES = pytest.mark.parametrize("source", [messages, feedback, changes, batches])


@SOURCES
async def test_a_step_that_is_cancelled_loses_nothing(
    meeting: Meeting, source: Callable[[Meeting], Awaitable[Source]]
) -> None:
    """At whatever moment: before an item arrives, when it has arrived, when the step has it."""
    items, emit, numbers = await source(meeting)
    found: list[int] = []
    for number in range(COUNT):
        step = asyncio.ensure_future(anext(items))
        emit(number)
        await turns(number % 8)
        step.cancel()
        await asyncio.wait({step})
        if not step.cancelled():
            found += numbers(step.result())
    async with asyncio.timeout(DEADLINE_SEC):
        while len(found) < COUNT:
            found += numbers(await anext(items))
    assert found == list(range(COUNT))


@SOURCES
async def test_a_time_limit_for_a_step_is_no_end(
    meeting: Meeting, source: Callable[[Meeting], Awaitable[Source]]
) -> None:
    """It raises TimeoutError each time, not StopAsyncIteration, and the next step goes on."""
    items, emit, numbers = await source(meeting)
    found: list[int] = []
    for _ in range(3):
        with pytest.raises(TimeoutError):
            await until_nothing_comes(items)
    emit(7)
    async with asyncio.timeout(DEADLINE_SEC):
        while not found:
            found = numbers(await anext(items))
    assert found == [7]


@SOURCES
async def test_closing_ends_a_step_that_waits(
    meeting: Meeting, source: Callable[[Meeting], Awaitable[Source]]
) -> None:
    """Another task closes it; later steps end, too, whatever arrives."""
    items, emit, numbers = await source(meeting)
    emit(0)
    async with asyncio.timeout(DEADLINE_SEC):
        while not numbers(await anext(items)):
            pass  # what the graph had before comes first, however late
    with pytest.raises(TimeoutError):
        await until_nothing_comes(items)
    step = asyncio.ensure_future(anext(items, None))
    await turns()
    await items.aclose()
    async with asyncio.timeout(DEADLINE_SEC):
        assert await step is None
    emit(1)
    assert [item async for item in items] == []


async def test_what_one_iteration_leaves_the_next_one_gets(meeting: Meeting) -> None:
    """Leaving the loop in the middle of changes that arrived together loses none of them."""
    source = await changes(meeting)
    watch = (await meeting.node("other")).watch_graph()
    for number in range(5):
        source.emit(number)
    found: list[int] = []
    async with asyncio.timeout(DEADLINE_SEC):
        while len(found) < 5:
            async for change in watch:
                found += number_of(change)
                break
    assert found == list(range(5))


async def test_a_watch_that_the_broker_refuses_raises(meeting: Meeting) -> None:
    """At each step, instead of waiting for ever; with a broker that accepts it, it goes on."""
    await meeting.restart_broker(max_watches=0)
    node = await meeting.node("watcher")
    watch = node.watch_graph()
    async with asyncio.timeout(DEADLINE_SEC):
        for items in (watch.batches(), watch.batches(), aiter(watch)):
            with pytest.raises(actors.BrokerUnreachable, match=r"does not report changes: .*--max-watches"):
                await anext(items)
    await meeting.restart_broker()
    async with asyncio.timeout(DEADLINE_SEC):
        while True:
            try:
                assert await anext(aiter(watch))
                break
            except actors.BrokerUnreachable:
                await turns()

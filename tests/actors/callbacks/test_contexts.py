"""Tests of contexts: what a callback sets in its context variables, no other callback sees."""

from __future__ import annotations

import asyncio
import gc
from contextvars import ContextVar
from functools import partial
from typing import TYPE_CHECKING, Any

import pytest

from actors.callbacks.callback_task import CallbackTask
from actors.callbacks.mailbox import Mailbox
from actors.interfaces.std_msgs.msg import Int64
from actors.interfaces.std_srvs.srv import Empty
from tests.actors.callbacks.test_mailbox import Recorder, opened
from tests.actors.meeting import KEEP_ALL, matched, until

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine

    from tests.actors.meeting import Meeting

    Seen = list[object]

mine: ContextVar[object] = ContextVar("mine")
MESSAGES = 20


class Array:
    """A value that does not compare, as those of numpy."""

    def __eq__(self, other: object) -> bool:
        raise ValueError("the truth value is ambiguous")

    __hash__ = None  # type: ignore[assignment]


def _plain(seen: Seen) -> Callable[..., object]:
    def callback(*_: object) -> object:
        seen.append(mine.get())
        mine.set(len(seen))
        return Empty.Response() if _ and isinstance(_[0], Empty.Request) else None

    return callback


def _async(seen: Seen) -> Callable[..., Coroutine[Any, Any, object]]:
    async def callback(*_: object) -> object:
        seen.append(mine.get())
        mine.set(number := len(seen))
        await asyncio.sleep(0)
        assert mine.get() == number
        return Empty.Response()

    return callback


def _both(seen: Seen) -> Callable[..., object]:
    """Return a plain callback that sets a variable for the coroutine that it returns."""

    async def rest(number: int) -> object:
        await asyncio.sleep(0)
        assert mine.get() == number
        return Empty.Response()

    def callback(*_: object) -> object:
        seen.append(mine.get())
        mine.set(number := len(seen))
        return rest(number)

    return callback


def _array(seen: Seen) -> Callable[..., object]:
    def callback(*_: object) -> object:
        seen.append(mine.get())
        mine.set(Array())
        return Empty.Response() if _ and isinstance(_[0], Empty.Request) else None

    return callback


@pytest.mark.parametrize("concurrent", [False, True])
@pytest.mark.parametrize("kind", [_plain, _async, _both, _array])
async def test_callbacks_see_what_was_set_around_the_node_and_nothing_of_each_other(
    meeting: Meeting, kind: Callable[[Seen], Any], *, concurrent: bool
) -> None:
    """Messages, requests and ticks, plain and not: each sees what was set when the node was entered."""
    messages, requests, ticks = list[object](), list[object](), list[object]()
    talker = await meeting.node("talker")
    mine.set("around")
    node = meeting.absent("listener")
    async with node:
        mine.set("inside")
        subscription = node.create_subscription(
            Int64, "numbers", kind(messages), KEEP_ALL, concurrent=concurrent
        )
        node.create_service(Empty, "serve", kind(requests), concurrent=concurrent)
        node.create_timer(0, kind(ticks))
        publisher = talker.create_publisher(Int64, "numbers", KEEP_ALL)
        client = talker.create_client(Empty, "serve")
        await matched(publisher)
        assert await client.wait_for_service(10)
        for number in range(MESSAGES):
            publisher.publish(Int64(data=number))
        await asyncio.gather(*(client.call(Empty.Request()) for _ in range(MESSAGES)))
        await until(lambda: len(messages) == MESSAGES and len(ticks) > MESSAGES)
        assert node.diagnostics().callback_errors == 0
        assert subscription.received == MESSAGES
    assert set(map(str, messages + requests + ticks)) == {"around"}


async def test_coroutine_callbacks_leave_nothing_to_the_garbage_collector() -> None:
    """A callback task and its context refer to each other only until the callback ends."""
    mailbox = Mailbox()
    gc.collect()
    gc.disable()
    try:
        async with opened(mailbox):
            source = Recorder(mailbox)
            source.queue.extend([partial(asyncio.sleep, 0)] * MESSAGES)
            mailbox.post(source)
            await until(lambda: len(source.results) == MESSAGES)
        tasks = [
            found for found in gc.get_objects() if isinstance(found, CallbackTask) and found.name == "sleep"
        ]
        assert len(tasks) <= 1  # the recorder keeps the last
    finally:
        gc.enable()


async def test_coroutine_handlers_leave_nothing_to_the_garbage_collector(meeting: Meeting) -> None:
    """A service and its callback tasks refer to each other only until the handlers end."""
    server, caller = await meeting.node("server"), await meeting.node("caller")

    async def answer_and_forget(_: Empty.Request) -> Empty.Response:
        await asyncio.sleep(0)
        return Empty.Response()

    server.create_service(Empty, "serve", answer_and_forget)
    client = caller.create_client(Empty, "serve")
    assert await client.wait_for_service(10)
    gc.collect()
    gc.disable()
    try:
        await asyncio.gather(*(client.call(Empty.Request()) for _ in range(MESSAGES)))
        tasks = [each for each in gc.get_objects() if isinstance(each, CallbackTask)]
        handlers = [each for each in tasks if each.name.endswith(answer_and_forget.__name__)]
        assert len(handlers) <= 1  # the worker keeps the last
    finally:
        gc.enable()

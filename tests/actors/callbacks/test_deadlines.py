"""Tests of the one timer behind many deadlines."""

from __future__ import annotations

import asyncio

from actors.callbacks.deadlines import Deadlines
from tests.seams.nodes import has_timer, kept_entries


async def test_they_expire_in_order_of_time() -> None:
    """Ids expire earliest first, whatever the order in which they came; removed ones do not."""
    loop = asyncio.get_running_loop()
    expired: list[int] = []
    done = asyncio.Event()

    def on_expired(key: int) -> None:
        expired.append(key)
        if key == 3:
            done.set()

    deadlines = Deadlines(on_expired)
    now = loop.time()
    deadlines.add(3, now + 0.03)
    deadlines.add(1, now + 0.01)
    deadlines.add(2, now + 0.02)
    deadlines.add(4, now + 0.015)
    deadlines.remove(4)
    async with asyncio.timeout(10):
        await done.wait()
    assert expired == [1, 2, 3]


async def test_the_heap_forgets_what_is_done() -> None:
    """A hundred thousand calls that ended in time leave no hundred thousand entries."""
    deadlines = Deadlines(lambda key: None)
    later = asyncio.get_running_loop().time() + 60
    for key in range(100_000):
        deadlines.add(key, later)
        deadlines.remove(key)
    assert kept_entries(deadlines) <= 1100
    deadlines.clear()


async def test_clear_leaves_no_timer() -> None:
    """After `clear` nothing expires and the loop holds no timer of it."""
    expired: list[int] = []
    deadlines = Deadlines(expired.append)
    deadlines.add(1, asyncio.get_running_loop().time())
    deadlines.clear()
    assert not has_timer(deadlines)
    await asyncio.sleep(0)
    assert not expired


async def test_an_expiry_may_add_another() -> None:
    """Adding from within `expired` works."""
    loop = asyncio.get_running_loop()
    done = asyncio.Event()

    def on_expired(key: int) -> None:
        if key == 1:
            deadlines.add(2, loop.time())
        else:
            done.set()

    deadlines = Deadlines(on_expired)
    deadlines.add(1, loop.time())
    async with asyncio.timeout(10):
        await done.wait()


async def test_an_expiry_that_raises_holds_up_no_other() -> None:
    """After an exception in `expired`, which the loop reports, the other ids expire, too."""
    loop = asyncio.get_running_loop()
    reported: list[object] = []
    loop.set_exception_handler(lambda _, context: reported.append(context.get("exception")))
    done = asyncio.Event()
    error = ValueError("expired")

    def on_expired(key: int) -> None:
        if key == 1:
            raise error
        done.set()

    deadlines = Deadlines(on_expired)
    now = loop.time()
    deadlines.add(1, now)
    deadlines.add(2, now)
    async with asyncio.timeout(10):
        await done.wait()
    assert reported == [error]

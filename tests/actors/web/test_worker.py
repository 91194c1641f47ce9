"""The thread for long work: whose turn it is, and what waits."""

from __future__ import annotations

import asyncio
import threading

import pytest

from actors.web import worker
from actors.web.worker import TooMuchWorkError, Worker
from tests.actors.meeting import until


async def test_one_users_work_does_not_queue_up_before_others() -> None:
    """Case 77: of a hundred pieces that one user has asked for, another user waits for one at most."""
    shared, release, done = Worker(), threading.Event(), list[str]()
    busy, other = shared.share(), shared.share()
    first = asyncio.create_task(busy.run(release.wait))
    rest = [asyncio.create_task(busy.run(done.append, "busy")) for _ in range(100)]
    await asyncio.sleep(0)
    wanted = asyncio.create_task(other.run(done.append, "other"))
    await asyncio.sleep(0)
    release.set()
    await asyncio.gather(first, wanted, *rest)
    assert done.index("other") <= 1
    shared.close()


async def test_the_loop_goes_on_meanwhile() -> None:
    """Case 77: the thread works, and the event loop lets it end."""
    shared, release = Worker(), threading.Event()
    work = asyncio.create_task(shared.share().run(release.wait))
    await asyncio.sleep(0)
    release.set()
    assert await work is True
    shared.close()


async def test_what_waits_has_a_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 77: further pieces of that user are refused, and those of others are not."""
    monkeypatch.setattr(worker, "MAX_WAITING", 2)
    shared, release = Worker(), threading.Event()
    share = shared.share()
    waiting = [asyncio.create_task(share.run(release.wait)) for _ in range(2)]
    await asyncio.sleep(0)
    with pytest.raises(TooMuchWorkError):
        await share.run(release.wait)
    other = asyncio.create_task(shared.share().run(int))
    release.set()
    assert await other == 0
    await asyncio.gather(*waiting)
    assert await share.run(int) == 0
    shared.close()


async def test_work_that_nobody_waits_for_any_more_is_not_done() -> None:
    """Case 77: a client that disconnects takes back what it has asked for."""
    shared, release, done = Worker(), threading.Event(), list[int]()
    running = asyncio.create_task(shared.share().run(release.wait))
    await asyncio.sleep(0)
    dropped = asyncio.create_task(shared.share().run(done.append, 1))
    await asyncio.sleep(0)
    dropped.cancel()
    await until(dropped.done)
    release.set()
    await running
    await shared.share().run(int)
    assert not done
    shared.close()

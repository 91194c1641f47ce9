"""What arrives in Zenoh's threads and is handled in the event loop."""

from __future__ import annotations

import asyncio
import threading
from typing import TYPE_CHECKING, Any

import pytest

from broker.mesh.engine import received_queue
from broker.mesh.engine.received_queue import ReceivedQueue
from proto.aio.read_budget import ReadBudget

if TYPE_CHECKING:
    from broker.mesh.mesh import Mesh


class RecordingHost:
    """A host that records what a queue tells it (`engine.Host`)."""

    def __init__(self) -> None:
        self.flushed = asyncio.Event()
        self.warnings: list[str] = []

    def mesh(self, domain: int) -> Mesh:
        """Host."""
        raise NotImplementedError(domain)

    def flush(self) -> None:
        """Host."""
        self.flushed.set()

    def warn(self, reason: str, text: str, *values: object) -> None:
        """Host."""
        self.warnings.append(f"{reason}: {text % values}")


@pytest.fixture
def host() -> RecordingHost:
    """Return a host."""
    return RecordingHost()


def queue_for(host: RecordingHost) -> ReceivedQueue:
    """Return a queue for the running loop."""
    loop = asyncio.get_running_loop()
    return ReceivedQueue(loop, ReadBudget(loop), host)


async def test_items_of_threads_are_handled_in_order(host: RecordingHost) -> None:
    """In the loop's thread, within its budget, and flushed afterwards."""
    queue, got, done = queue_for(host), list[int](), asyncio.Event()

    def handle(_domain: int, number: int) -> None:
        got.append(number)
        if number == 1999:
            done.set()

    def put() -> None:
        for number in range(2000):
            queue.put(handle, 0, number)

    await asyncio.to_thread(put)
    await asyncio.wait_for(done.wait(), 10)
    await asyncio.wait_for(host.flushed.wait(), 10)
    assert got == list(range(2000))


async def test_malformed_items_are_counted_and_harm_no_others(host: RecordingHost) -> None:
    """The host decides how many of the lines are logged."""
    queue, done = queue_for(host), asyncio.Event()

    def handle(_domain: int, item: Any) -> None:
        if item is None:
            raise ValueError("no number")
        done.set()

    queue.put(handle, 0, None)
    queue.put(handle, 0, 1)
    await asyncio.wait_for(done.wait(), 10)
    assert queue.malformed == 1
    assert host.warnings == ["malformed messages: Mesh: received something malformed: no number"]


async def test_a_full_queue_drops_what_may_be_dropped(
    host: RecordingHost, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After a while in which the thread waits for space: what has the least limit first."""
    monkeypatch.setattr(received_queue, "MAX_BLOCK_SEC", 0.001)
    queue, got, done = queue_for(host), list[str](), asyncio.Event()

    def handle(_domain: int, item: str) -> None:
        got.append(item)
        if item == "last":
            done.set()

    def put() -> None:
        limits = {"first": 0, "dropped": 0, "second": 200, "dropped, too": 200, "last": None}
        for item, max_bytes in limits.items():
            queue.put(handle, 0, item, max_bytes)

    thread = threading.Thread(target=put)
    thread.start()
    thread.join()  # the loop cannot handle anything meanwhile
    await asyncio.wait_for(done.wait(), 10)
    assert got == ["first", "second", "last"]
    assert queue.dropped == 2


async def test_an_item_too_large_for_the_rest_of_the_space_is_not_put(
    host: RecordingHost, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Case 68: snapshots of many brokers at once; it is counted."""
    monkeypatch.setattr(received_queue, "MAX_NUMBERED_BYTES", 10_000)
    queue, done = queue_for(host), asyncio.Event()
    queue.put(lambda *_: done.set(), 0, 1, size=9000)
    assert queue.waiting_bytes >= 9000
    assert not queue.has_space(2000)
    assert queue.dropped == 1
    await asyncio.wait_for(done.wait(), 10)
    await asyncio.sleep(0)
    assert queue.waiting_bytes == 0
    assert queue.has_space(10_000)


async def test_a_bug_in_a_handler_harms_no_other_items(host: RecordingHost) -> None:
    """What waits is handled all the same, and its bytes are free again."""
    queue, done = queue_for(host), asyncio.Event()
    raised = list[dict[str, Any]]()
    asyncio.get_running_loop().set_exception_handler(lambda _, context: raised.append(context))

    def handle(_domain: int, item: Any) -> None:
        if item is None:
            raise KeyError("a bug")
        done.set()

    queue.put(handle, 0, None)
    queue.put(handle, 0, 1)
    await asyncio.wait_for(done.wait(), 10)
    await asyncio.sleep(0)
    assert queue.waiting_bytes == 0
    assert len(raised) == 1

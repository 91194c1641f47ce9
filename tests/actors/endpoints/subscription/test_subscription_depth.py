"""A subscription's depth: whatever comes and however it is read, the newest that could not be taken wait."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import actors
from actors.interfaces.std_msgs.msg import Int64
from proto.wire.frames import Attached
from tests.actors.endpoints.subscription.test_subscription import batch_of
from tests.seams.nodes import link_of
from tests.simulation.loop import SimulatedLoop, simulate

if TYPE_CHECKING:
    from collections.abc import Callable

    Step = tuple[str, Any]


class Model:
    """What should be heard, and what should wait.

    A reader takes a message and then waits for leave to go on. Leave may be given in advance.
    """

    def __init__(self, kind: str, depth: int) -> None:
        self.kind = kind
        self.depth = depth
        self.received: list[int] = []
        self.queue: list[int] = []
        self.dropped = 0
        self.busy = False
        self.leave = 0

    def come(self, batches: list[range]) -> None:
        """These runs come in one turn of the loop."""
        woken = False
        for batch in batches:
            idle = woken or not (self.busy or self.queue)
            self.queue += batch
            if idle and self.kind == "iterator":
                woken = True  # it reads, whatever has come until then, when the loop comes to it
                continue
            if idle:
                self._take()
            self._trim()
        if woken:
            self._take()
            self._go_on()
            self._trim()
        self._go_on()

    def go_on(self, count: int) -> None:
        """The reader may go on after so many messages."""
        self.leave += count
        self._go_on()

    def _take(self) -> None:
        self.received.append(self.queue.pop(0))
        self.busy = True

    def _trim(self) -> None:
        excess = max(0, len(self.queue) - self.depth)
        self.dropped += excess
        del self.queue[:excess]

    def _go_on(self) -> None:
        while self.busy and self.leave:
            self.leave -= 1
            self.busy = False
            if self.queue:
                self._take()


class Reader:
    """A subscription that reads as a model does."""

    def __init__(self, node: actors.Node, kind: str, depth: int) -> None:
        self.received: list[int] = []
        self.leave = asyncio.Semaphore(0)
        self.lost: list[actors.MessageLostInfo] = []
        callback: Callable[[Int64], Any] | None = None if kind == "iterator" else self._hear
        self.subscription = node.create_subscription(
            Int64,
            "numbers",
            callback,
            depth,
            event_callbacks=actors.SubscriptionEventCallbacks(message_lost=self.lost.append),
        )
        self.task = asyncio.create_task(self._read()) if callback is None else None

    async def _hear(self, message: Int64) -> None:
        self.received.append(message.data)
        await self.leave.acquire()

    async def _read(self) -> None:
        async for message in self.subscription:
            await self._hear(message)

    async def stop(self) -> None:
        """End an iterator."""
        self.subscription.destroy()
        self.leave.release()
        if self.task is not None:
            await self.task


STEPS = st.one_of(
    st.tuples(st.just("come"), st.lists(st.integers(1, 30), min_size=1, max_size=4)),
    st.tuples(st.just("go on"), st.integers(1, 20)),
)


@pytest.mark.parametrize("kind", ["callback", "iterator"])
@given(depth=st.integers(1, 12), steps=st.lists(STEPS, max_size=25))
def test_exactly_the_newest_that_could_not_be_taken_wait(kind: str, depth: int, steps: list[Step]) -> None:
    """What is handed over, waits and is dropped is what the model says, in order, after every step."""

    async def scene(loop: SimulatedLoop) -> None:
        del loop
        async with actors.Node("hearer", use_global_arguments=False) as node:
            await asyncio.sleep(0.01)  # the first attempt to connect has failed: it would take feeds away
            reader, model = Reader(node, kind, depth), Model(kind, depth)
            subscription, attachments = reader.subscription, link_of(node).attachments
            await settled()
            attachments.attached(Attached(1, (subscription.id,), bytes(16), 0, "/talker", {}))
            came = 0
            for step, what in steps:
                if step == "come":
                    batches = []
                    for length in what:
                        batches.append(range(came, came + length))
                        came += length
                        attachments.batch_received(batch_of(1, batches[-1]))
                    model.come(batches)
                else:
                    for _ in range(what):
                        reader.leave.release()
                    model.go_on(what)
                await settled()
                assert reader.received == model.received
                assert (subscription.queued, subscription.dropped) == (len(model.queue), model.dropped)
                assert subscription.received + subscription.dropped + subscription.queued == came
            await flushed(reader)
            assert sum(info.total_count_change for info in reader.lost) == model.dropped
            await reader.stop()

    simulate(scene)


async def settled() -> None:
    """Return when nothing is left to be done at this time."""
    await asyncio.sleep(1e-6)


async def flushed(reader: Reader) -> None:
    """Let the reader take what waits, so that the events that wait behind its callbacks are reported."""
    for _ in range(reader.subscription.queued + 1):
        reader.leave.release()
    await settled()
    assert reader.subscription.queued == 0


@given(
    depth=st.integers(1, 12),
    steps=st.lists(st.one_of(st.integers(1, 30), st.just(0)), max_size=25),
)
def test_a_plain_callback_takes_all_it_can_and_then_the_newest(depth: int, steps: list[int]) -> None:
    """While another callback holds the node (a 0 switches) the newest wait; else each run is taken whole."""

    async def scene(loop: SimulatedLoop) -> None:
        del loop
        async with actors.Node("hearer", use_global_arguments=False) as node:
            await asyncio.sleep(0.01)  # the first attempt to connect has failed: it would take feeds away
            received: list[int] = []
            leave = asyncio.Event()

            async def hold(message: Int64) -> None:
                del message
                await leave.wait()

            plain = node.create_subscription(
                Int64, "numbers", lambda message: received.append(message.data), depth
            )
            other = node.create_subscription(Int64, "others", hold)
            attachments = link_of(node).attachments
            attachments.attached(Attached(1, (plain.id,), bytes(16), 0, "/talker", {}))
            attachments.attached(Attached(2, (other.id,), bytes(15) + b"2", 0, "/talker", {}))
            taken: list[int] = []
            waiting: list[int] = []
            came = holds = 0
            held = False
            for length in steps:
                if length:
                    waiting += range(came, came + length)
                    attachments.batch_received(batch_of(1, range(came, came + length)))
                    came += length
                elif held:
                    held = False
                    leave.set()
                else:
                    held = True
                    leave.clear()
                    attachments.batch_received(batch_of(2, range(holds, holds + 1)))
                    holds += 1
                await settled()
                if held:
                    del waiting[:-depth]
                else:
                    taken += waiting
                    waiting.clear()
                assert received == taken
                assert plain.queued == len(waiting)
                assert plain.received + plain.dropped + plain.queued == came
            leave.set()

    simulate(scene)

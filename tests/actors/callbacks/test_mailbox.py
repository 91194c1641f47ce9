"""Tests of the mailbox: one callback at a time, and the one point of interleaving."""

from __future__ import annotations

import asyncio
from collections import deque
from contextlib import asynccontextmanager
from functools import partial
from typing import TYPE_CHECKING, Any

import pytest

from actors.callbacks.budget import BUDGET_SEC, CallbackBudget
from actors.callbacks.callback_task import CallbackTask
from actors.callbacks.mailbox import IDLE_WORKERS, Mailbox
from actors.callbacks.timing import Stopwatch
from actors.endpoints.context import in_flight
from tests.waiting import until

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable

    from actors.callbacks.source import Share
    from actors.callbacks.timing import CallbackTiming


def timing() -> CallbackTiming:
    """Return a timing whose measurements are not used."""
    return Stopwatch(lambda text: None).of(print, "a test")


class Recorder:
    """A source whose callbacks are given one by one, as a service's requests are."""

    def __init__(self, mailbox: Mailbox, *, reentrant: bool = True, concurrent: bool = False) -> None:
        self.mailbox = mailbox
        self.concurrent = concurrent
        self.posted = False
        self.queue: deque[Callable[[], Any]] = deque()
        self.results: list[Any] = []
        self.errors: list[BaseException] = []
        self.reentrant = reentrant
        self.running = 0
        self.calls = 0
        self.timing = timing()

    def add(self, callback: Callable[[], Any]) -> None:
        self.queue.append(callback)
        self.mailbox.post(self)

    def has_work(self) -> bool:
        return bool(self.queue) and (self.reentrant or not self.running)

    def dispatch(self, share: Share) -> CallbackTask | None:
        while self.has_work():
            self.calls += 1
            result = self.queue.popleft()()
            if asyncio.iscoroutine(result):
                self.running += 1
                self.callback_task = CallbackTask(self.mailbox, result, self.ended, self.timing)
                if not self.concurrent:
                    return self.callback_task
                self.mailbox.run_concurrently(self.callback_task)
                continue
            self.results.append(result)
            if share.used:
                break
        return None

    def ended(self, result: Any, error: BaseException | None) -> None:
        self.running -= 1
        if error is None:
            self.results.append(result)
        else:
            self.errors.append(error)
        if self.has_work():
            self.mailbox.post(self)


@asynccontextmanager
async def opened(
    mailbox: Mailbox, budget: CallbackBudget | None = None
) -> AsyncIterator[set[asyncio.Task[None]]]:
    """Open a mailbox whose workers end with the block; gives the set of its workers.

    By default no time passes for its budget, so that a busy machine does not put callbacks off.
    """
    tasks: set[asyncio.Task[None]] = set()
    async with asyncio.TaskGroup() as group:

        def spawn(coroutine: Any) -> None:
            tasks.add(group.create_task(coroutine))

        mailbox.open(spawn, budget or CallbackBudget(lambda: 0.0))
        try:
            async with asyncio.timeout(10):
                yield tasks
        finally:
            mailbox.close()
            for task in tasks:
                task.cancel()


async def test_plain_functions_run_at_once_without_a_task() -> None:
    """A `def` callback has run when `post` returns, and no worker was started for it."""
    mailbox = Mailbox()
    async with opened(mailbox) as tasks:
        source = Recorder(mailbox)
        source.add(lambda: 1)
        assert source.results == [1]
        assert not tasks


async def test_nothing_runs_before_open() -> None:
    """What is posted early waits for `open`."""
    mailbox = Mailbox()
    source = Recorder(mailbox)
    source.add(lambda: 1)
    assert not source.results
    async with opened(mailbox):
        assert source.results == [1]


async def test_callbacks_run_one_at_a_time_in_order() -> None:
    """While a coroutine callback is suspended, nothing else of the node runs."""
    mailbox = Mailbox()
    async with opened(mailbox):
        gate = asyncio.Event()
        source, other = Recorder(mailbox), Recorder(mailbox)

        async def slow() -> str:
            await gate.wait()
            return "slow"

        source.add(slow)
        other.add(lambda: "other")
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        assert other.results == []
        gate.set()
        await until(lambda: other.results == ["other"])
        assert source.results == ["slow"]


async def test_a_burst_of_coroutines_needs_one_worker() -> None:
    """A thousand coroutine callbacks run in one task."""
    mailbox = Mailbox()
    async with opened(mailbox) as tasks:
        source = Recorder(mailbox)

        async def callback() -> int:
            await asyncio.sleep(0)
            return 1

        for _ in range(1000):
            source.add(callback)
        await until(lambda: len(source.results) == 1000)
        assert len(tasks) == 1


async def test_a_call_in_flight_lets_others_run() -> None:
    """A callback that waits with a call in flight releases the mailbox, and takes it again afterwards."""
    mailbox = Mailbox()
    async with opened(mailbox):
        reply: asyncio.Future[int] = asyncio.get_running_loop().create_future()
        gate = asyncio.Event()
        caller, other = Recorder(mailbox), Recorder(mailbox)
        order: list[str] = []

        async def call() -> None:
            with in_flight():
                await reply
            order.append("caller goes on")

        async def serve() -> None:
            order.append("other starts")
            reply.set_result(8)
            await gate.wait()
            order.append("other ends")

        caller.add(call)
        await asyncio.sleep(0)
        other.add(serve)
        await until(lambda: bool(order))
        gate.set()
        await until(lambda: len(order) == 3)
        assert order == ["other starts", "other ends", "caller goes on"]


async def test_calls_through_gather_and_child_tasks_free_the_mailbox() -> None:
    """A callback that gathers calls made in child tasks cannot block the handlers of those calls."""
    mailbox = Mailbox()
    async with opened(mailbox):
        loop = asyncio.get_running_loop()
        replies = [loop.create_future() for _ in range(3)]
        caller, server = Recorder(mailbox), Recorder(mailbox)

        async def one(reply: asyncio.Future[int]) -> int:
            await asyncio.sleep(0)
            with in_flight():
                return await reply

        async def gather() -> int:
            return sum(await asyncio.gather(*map(one, replies)))

        caller.add(gather)
        await asyncio.sleep(0)
        for number, reply in enumerate(replies):
            server.add(partial(reply.set_result, number))
        await until(lambda: caller.results == [3])


async def test_a_raising_callback_frees_the_mailbox() -> None:
    """An error goes to the source, and the next callback runs."""
    mailbox = Mailbox()
    async with opened(mailbox):
        source = Recorder(mailbox)

        async def fail() -> None:
            raise ValueError("boom")

        source.add(fail)
        source.add(lambda: 2)
        await until(lambda: source.results == [2])
        assert [str(error) for error in source.errors] == ["boom"]


async def test_a_callback_whose_future_is_cancelled_frees_the_mailbox() -> None:
    """A CancelledError that nobody sent to the task is the callback's error, and others run on."""
    mailbox = Mailbox()
    async with opened(mailbox):
        source = Recorder(mailbox)
        future: asyncio.Future[None] = asyncio.get_running_loop().create_future()

        async def waits() -> None:
            await future

        source.add(waits)
        source.add(lambda: "next")
        await asyncio.sleep(0)
        future.cancel()
        await until(lambda: bool(source.results))
        assert source.results == ["next"]
        assert [type(error) for error in source.errors] == [asyncio.CancelledError]


async def test_cancelling_a_turn_spares_the_worker() -> None:
    """A cancelled callback sees CancelledError; the worker goes on with the next one."""
    mailbox = Mailbox()
    async with opened(mailbox) as tasks:
        source = Recorder(mailbox)
        cleaned: list[str] = []

        async def stuck() -> None:
            try:
                await asyncio.Event().wait()
            finally:
                cleaned.append("up")

        async def fine() -> str:
            await asyncio.sleep(0)
            return "fine"

        source.add(stuck)
        source.add(fine)
        await asyncio.sleep(0)
        source.callback_task.cancel()
        await until(lambda: source.results == ["fine"])
        assert cleaned == ["up"]
        assert isinstance(source.errors[0], asyncio.CancelledError)
        assert len(tasks) == 1
        assert all(task.cancelling() == 0 for task in tasks)


async def test_cancelling_a_turn_before_it_starts() -> None:
    """A callback task cancelled before its first step never runs its callback."""
    mailbox = Mailbox()
    async with opened(mailbox):
        source = Recorder(mailbox)
        ran: list[int] = []

        async def callback() -> None:
            ran.append(1)

        source.add(callback)
        source.callback_task.cancel()
        await until(lambda: bool(source.errors))
        assert not ran


async def test_cancelling_a_turn_that_waits_for_the_mailbox() -> None:
    """A cancelled callback waits for the mailbox, ends after the one that runs, and releases it."""
    mailbox = Mailbox()
    async with opened(mailbox):
        reply: asyncio.Future[int] = asyncio.get_running_loop().create_future()
        gate = asyncio.Event()
        caller, other = Recorder(mailbox), Recorder(mailbox)

        async def call() -> None:
            with in_flight():
                await reply

        async def hold() -> None:
            reply.set_result(1)
            await gate.wait()

        caller.add(call)
        await asyncio.sleep(0)
        other.add(hold)
        await until(reply.done)
        await asyncio.sleep(0)
        caller.callback_task.cancel()
        for _ in range(5):
            await asyncio.sleep(0)
        assert not caller.errors
        gate.set()
        await until(lambda: bool(caller.errors))
        other.add(lambda: "after")
        await until(lambda: other.results == [None, "after"])


async def test_a_cancellation_outranks_the_error_of_the_call() -> None:
    """A callback task that is cancelled after its call has failed, before it continues, is cancelled."""
    mailbox = Mailbox()
    async with opened(mailbox):
        reply: asyncio.Future[int] = asyncio.get_running_loop().create_future()
        gate = asyncio.Event()
        caller, other = Recorder(mailbox), Recorder(mailbox)

        async def call() -> str:
            try:
                with in_flight():
                    await reply
            except ValueError:
                return "went on"
            return "never"

        async def hold() -> None:
            reply.set_exception(ValueError("the call failed"))
            await gate.wait()

        caller.add(call)
        await asyncio.sleep(0)
        other.add(hold)
        await until(reply.done)
        await asyncio.sleep(0)
        caller.callback_task.cancel()
        gate.set()
        await until(lambda: bool(caller.results or caller.errors))
        assert not caller.results
        assert isinstance(caller.errors[0], asyncio.CancelledError)


async def test_a_closed_mailbox_holds_nobody_up() -> None:
    """A callback task that waits for the mailbox when it closes ends with its asyncio task."""
    mailbox = Mailbox()
    ended: list[str] = []
    async with opened(mailbox):
        reply: asyncio.Future[int] = asyncio.get_running_loop().create_future()
        caller, other = Recorder(mailbox), Recorder(mailbox)

        async def call() -> None:
            try:
                with in_flight():
                    await reply
            finally:
                ended.append("call")

        async def hold() -> None:
            reply.set_result(1)
            await asyncio.Event().wait()

        caller.add(call)
        await asyncio.sleep(0)
        other.add(hold)
        await until(reply.done)
        await asyncio.sleep(0)
    assert ended == ["call"]


async def test_concurrent_callback_runs_while_the_mailbox_is_taken() -> None:
    """A concurrent callback does not wait for the mailbox, and does not take it."""
    mailbox = Mailbox()
    async with opened(mailbox):
        source = Recorder(mailbox)
        gate = asyncio.Event()
        done: list[object] = []

        async def hold() -> None:
            await gate.wait()

        async def concurrent() -> str:
            with in_flight():
                await asyncio.sleep(0)
            return "concurrent"

        source.add(hold)
        await asyncio.sleep(0)
        callback_task = CallbackTask(mailbox, concurrent(), lambda result, _: done.append(result), timing())
        mailbox.run_concurrently(callback_task)
        await until(lambda: done == ["concurrent"])
        assert not source.results
        gate.set()
        await until(lambda: source.results == [None])


async def test_concurrent_sources_do_not_wait_for_a_suspended_callback() -> None:
    """Functions and coroutines of a concurrent source run while a coroutine of another holds the mailbox."""
    mailbox = Mailbox()
    async with opened(mailbox):
        source, other = Recorder(mailbox), Recorder(mailbox)
        beside = Recorder(mailbox, concurrent=True)
        gate = asyncio.Event()

        async def say(text: str) -> str:
            return text

        source.add(gate.wait)
        other.add(lambda: "other")
        beside.add(lambda: "at once")
        assert beside.results == ["at once"]
        beside.add(lambda: say("soon"))
        await until(lambda: beside.results == ["at once", "soon"])
        assert not source.results
        assert not other.results
        gate.set()
        await until(lambda: source.results == [True] and other.results == ["other"])


async def test_concurrent_sources_that_wait_run_when_a_callback_takes_the_mailbox() -> None:
    """They are not left behind a coroutine that was posted before them, and keep their order otherwise."""
    mailbox = Mailbox()
    order: list[str] = []
    gate = asyncio.Event()

    async def hold() -> None:
        order.append("hold")
        await gate.wait()

    sources = [Recorder(mailbox), Recorder(mailbox), Recorder(mailbox, concurrent=True)]
    sources[0].add(hold)
    sources[1].add(lambda: order.append("after"))
    sources[2].add(lambda: order.append("beside"))
    async with opened(mailbox):
        await until(lambda: len(order) == 2)
        assert set(order) == {"hold", "beside"}
        gate.set()
        await until(lambda: order[2:] == ["after"])


async def test_concurrent_sources_keep_to_the_budget() -> None:
    """While another callback holds the mailbox, too, they leave time for the rest of the loop."""
    mailbox, now = Mailbox(), 0.0
    budget = CallbackBudget(lambda: now)
    async with opened(mailbox, budget):
        source, beside = Recorder(mailbox), Recorder(mailbox, concurrent=True)
        gate = asyncio.Event()
        source.add(gate.wait)
        await asyncio.sleep(0)

        def slow() -> None:
            nonlocal now
            now += BUDGET_SEC

        beside.queue.extend([slow] * 3)
        beside.add(slow)
        assert len(beside.results) == 1
        await until(lambda: len(beside.results) == 4)
        gate.set()
        await until(lambda: source.results == [True])


async def test_timeout_inside_a_callback_works() -> None:
    """asyncio.timeout inside a callback raises TimeoutError there, not elsewhere."""
    mailbox = Mailbox()
    async with opened(mailbox):
        source = Recorder(mailbox)

        async def callback() -> str:
            with pytest.raises(TimeoutError):
                async with asyncio.timeout(0):
                    await asyncio.Event().wait()
            return "timed out"

        source.add(callback)
        await until(lambda: source.results == ["timed out"])


async def test_one_source_does_not_starve_another() -> None:
    """A source with much to do lets another one run in between."""
    mailbox = Mailbox()
    async with opened(mailbox):
        order: list[str] = []
        first, second = Recorder(mailbox), Recorder(mailbox)

        def make(name: str) -> Callable[[], Any]:
            async def callback() -> None:
                await asyncio.sleep(0)
                order.append(name)

            return callback

        for _ in range(3):
            first.add(make("a"))
        for _ in range(3):
            second.add(make("b"))
        await until(lambda: len(order) == 6)
        assert "b" in order[:3]
        assert "a" in order[3:]


async def test_a_callback_that_cancels_its_own_task_ends_alone() -> None:
    """The task belongs to the mailbox: such a cancellation ends the callback, and others go on."""
    mailbox = Mailbox()
    async with opened(mailbox) as tasks:
        source = Recorder(mailbox)

        async def reckless() -> None:
            task = asyncio.current_task()
            assert task is not None
            task.cancel()
            await asyncio.sleep(0)

        async def fine() -> str:
            await asyncio.sleep(0)
            return "fine"

        source.add(reckless)
        source.add(fine)
        await until(lambda: source.results == ["fine"])
        assert isinstance(source.errors[0], asyncio.CancelledError)
        assert len(tasks) == 1


async def test_a_burst_leaves_few_idle_workers_behind() -> None:
    """A hundred suspended callback tasks need a hundred workers; afterwards most of these end."""
    mailbox = Mailbox()
    async with opened(mailbox) as tasks:
        source = Recorder(mailbox)
        gate = asyncio.Event()

        async def calling() -> None:
            with in_flight():
                await gate.wait()

        for _ in range(100):
            source.add(calling)
        await until(lambda: mailbox.suspended == 100)
        assert mailbox.workers == 100
        assert not mailbox.busy
        gate.set()
        await until(lambda: len(source.results) == 100)
        await until(lambda: mailbox.idle_workers == mailbox.workers)
        assert mailbox.workers <= IDLE_WORKERS
        assert sum(not task.done() for task in tasks) <= IDLE_WORKERS
        assert mailbox.suspended == 0


async def test_the_mailbox_says_what_it_does() -> None:
    """Its properties distinguish a callback task that holds it from sources that wait."""
    mailbox = Mailbox()
    async with opened(mailbox):
        source, other = Recorder(mailbox), Recorder(mailbox)
        gate = asyncio.Event()
        source.add(gate.wait)
        other.add(lambda: None)
        assert mailbox.busy
        assert (mailbox.waiting, mailbox.suspended, mailbox.workers) == (1, 0, 1)
        gate.set()
        await until(lambda: not mailbox.busy)
        assert (mailbox.waiting, mailbox.suspended) == (0, 0)

"""Tests of what is known about a callback's durations, and of the warning about slow ones."""

from __future__ import annotations

import asyncio
import math
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors.callbacks.budget import CallbackBudget
from actors.callbacks.mailbox import Mailbox
from actors.callbacks.timing import QUIET_SEC, CallbackTiming, Stopwatch
from actors.endpoints.context import in_flight
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import Empty
from tests.actors.callbacks.test_mailbox import Recorder, opened
from tests.actors.meeting import KEEP_ALL, matched, until
from tests.seams.nodes import context_of

if TYPE_CHECKING:
    from tests.actors.meeting import Meeting


class Hands:
    """A clock that moves when it is told to."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now

    def take(self, seconds: float) -> None:
        """Let something take its time."""
        self.now += seconds


class Bench:
    """A stopwatch over such a clock, and what it has warned of."""

    def __init__(self, *, slow_sec: float | None = 0.1) -> None:
        self.hands = Hands()
        self.warnings: list[str] = []
        self.watch = Stopwatch(self.warnings.append, slow_sec=slow_sec, clock=self.hands)
        self.timing = CallbackTiming(self.watch, "f", "the subscription to '/t'", only_steps=False)

    def source(self, mailbox: Mailbox) -> Recorder:
        """Return a source whose durations are measured here."""
        source = Recorder(mailbox)
        source.timing = self.timing
        return source


def test_steps_add_up() -> None:
    """Their sum, and the longest of each."""
    bench = Bench()
    bench.timing.dispatched(0.01, 3)
    bench.timing.dispatched(0.03, 4)
    bench.timing.stepped(0.02, 5.0)
    assert bench.timing.slow == 0
    assert bench.timing.busy_sec == pytest.approx(0.06)
    assert (bench.timing.longest_sec, bench.timing.longest_elapsed_sec) == (0.03, 5.0)
    assert not bench.warnings


def test_a_slow_dispatch_is_named_with_its_batch() -> None:
    """The warning says who, how long, and for how many messages."""
    bench = Bench()
    bench.timing.dispatched(0.01, 5)
    bench.timing.dispatched(0.25, 17)
    (warning,) = bench.warnings
    assert "Callback f of the subscription to '/t' held the event loop for 0.250 s" in warning
    assert "12 calls in a row" in warning


def test_a_slow_callback_is_reported_from_time_to_time() -> None:
    """One warning in a while and callback; every slow step is counted."""
    bench = Bench()
    other = bench.watch.of(print, "a timer")
    for _ in range(3):
        bench.timing.stepped(0.2, 0.2)
    other.dispatched(0.2, 1)
    assert len(bench.warnings) == 2
    assert bench.timing.slow == 3
    bench.hands.take(QUIET_SEC)
    bench.timing.stepped(0.2, 0.2)
    assert len(bench.warnings) == 3


def test_none_reports_nothing() -> None:
    """With `slow_callback_sec=None` nothing is slow."""
    bench = Bench(slow_sec=None)
    bench.timing.dispatched(1000.0, 1)
    assert not bench.warnings
    assert bench.timing.longest_sec == 1000.0


@pytest.mark.parametrize("wrong", [-1.0, math.nan])
def test_a_limit_is_a_time(wrong: float) -> None:
    """Negative seconds and NaN are refused, through the node, too."""
    with pytest.raises(ValueError, match="slow_callback_sec"):
        Bench(slow_sec=wrong)
    with pytest.raises(ValueError, match="slow_callback_sec"):
        actors.Node("n", slow_callback_sec=wrong, use_global_arguments=False)


async def test_only_what_holds_the_loop_counts() -> None:
    """A coroutine's awaits are no load; they show in its elapsed time only."""
    bench, mailbox = Bench(), Mailbox()
    async with opened(mailbox, CallbackBudget(bench.hands)):
        source, began = bench.source(mailbox), asyncio.Event()

        async def callback() -> None:
            bench.hands.take(0.02)
            began.set()
            await asyncio.sleep(0)
            bench.hands.take(0.03)

        source.add(callback)
        await until(began.is_set)
        bench.hands.take(5.0)  # while it is suspended
        await until(lambda: len(source.results) == 1)
    assert bench.timing.busy_sec == pytest.approx(0.05)
    assert bench.timing.longest_sec == pytest.approx(0.03)
    assert bench.timing.longest_elapsed_sec == pytest.approx(5.05)
    assert not bench.warnings


async def test_waiting_for_the_mailbox_is_no_load() -> None:
    """Callbacks that run while a callback task has released the mailbox do not count for it."""
    bench, mailbox = Bench(), Mailbox()
    async with opened(mailbox, CallbackBudget(bench.hands)):
        source, gate = bench.source(mailbox), asyncio.Event()

        async def calling() -> None:
            with in_flight():
                await gate.wait()
            bench.hands.take(0.01)

        other = Recorder(mailbox)
        source.add(calling)
        await until(lambda: mailbox.suspended == 1)
        other.add(lambda: bench.hands.take(7.0))
        gate.set()
        await until(lambda: len(source.results) == 1)
    assert bench.timing.busy_sec == pytest.approx(0.01)
    assert other.results == [None]


@pytest.mark.parametrize("kind", ["returns", "raises"])
async def test_a_step_counts_however_it_ends(kind: str) -> None:
    """A callback that raises has held the loop, too."""
    bench, mailbox = Bench(), Mailbox()
    async with opened(mailbox, CallbackBudget(bench.hands)):
        source = bench.source(mailbox)

        async def callback() -> None:
            bench.hands.take(0.5)
            if kind == "raises":
                raise ValueError

        source.add(callback)
        await until(lambda: bool(source.results or source.errors))
    assert bench.timing.slow == 1
    assert "0.500 s;" in bench.warnings[0]


class Slow(actors.Node):
    """A node with a callback of each kind, each of which holds the loop for half a second of its clock."""

    def __init__(self, hands: Hands, warnings: list[str], **options: Any) -> None:
        super().__init__("slow", **options)
        self.hands = hands
        context_of(self).watch.clock = hands
        context_of(self).watch.warn = warnings.append
        self.create_subscription(String, "plain", self.on_plain, KEEP_ALL)
        self.create_subscription(String, "async", self.on_async, KEEP_ALL)
        self.create_subscription(String, "concurrent", self.on_concurrent, KEEP_ALL, concurrent=True)
        self.create_service(Empty, "serve", self.on_request)
        self.ticker = self.create_timer(0.001, self.on_tick)

    def on_plain(self, msg: String) -> None:
        self.hands.take(0.5)

    async def on_async(self, msg: String) -> None:
        await asyncio.sleep(0)
        self.hands.take(0.5)

    async def on_concurrent(self, msg: String) -> None:
        self.hands.take(0.5)

    def on_request(self, request: Empty.Request, response: Empty.Response) -> Empty.Response:
        self.hands.take(0.5)
        return response

    def on_tick(self) -> None:
        self.hands.take(0.5)
        self.ticker.cancel()


async def test_every_kind_of_callback_is_named(meeting: Meeting) -> None:
    """Subscriptions, services and timers, plain and not: one warning each, with the callback's name."""
    hands, warnings = Hands(), list[str]()
    CallbackBudget.of(asyncio.get_running_loop()).clock = hands
    node = Slow(hands, warnings, url=meeting.url, use_global_arguments=False)
    async with node:
        other = await meeting.node("other")
        for topic in ("plain", "async", "concurrent"):
            publisher = other.create_publisher(String, topic, KEEP_ALL)
            await matched(publisher)
            publisher.publish(String(data="x"))
        client = other.create_client(Empty, "serve")
        assert await client.wait_for_service(10)
        await client.call(Empty.Request())
        await until(lambda: len(warnings) == 5)
    named = {warning.partition(" held")[0] for warning in warnings}
    assert named == {
        "Callback Slow.on_plain of the subscription to '/plain'",
        "Callback Slow.on_async of the subscription to '/async'",
        "Callback Slow.on_concurrent of the subscription to '/concurrent'",
        "Callback Slow.on_request of the service '/serve'",
        "Callback Slow.on_tick of a timer",
    }

"""Tests of the callback budget: callbacks cannot starve the loop, each other, or another node."""

from __future__ import annotations

import asyncio
from functools import partial
from typing import TYPE_CHECKING, Any

import pytest

from actors.callbacks.budget import BUDGET_SEC, SHARE_SEC, CallbackBudget
from actors.callbacks.mailbox import CONCURRENT_STARTS, Mailbox
from actors.endpoints.endpoint import endpoint_of
from actors.endpoints.subscription.consumer import CHECK_EVERY
from actors.interfaces.std_msgs.msg import Int64
from actors.interfaces.std_srvs.srv import Empty
from tests.actors.callbacks.test_mailbox import Recorder, opened
from tests.actors.meeting import KEEP_ALL, matched, until

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.actors.meeting import Meeting

CROWD = 1500
SLOW_SEC = 0.005


class Hands:
    """A clock that callbacks move, and the most that it has moved between two turns of the loop."""

    def __init__(self) -> None:
        self.now = 0.0
        self.most = 0.0
        self.turns = 0
        self._turn_began = 0.0

    def __call__(self) -> float:
        return self.now

    def take(self, seconds: float = SLOW_SEC, *_: object) -> None:
        """Let a callback take its time."""
        self.now += seconds

    async def watch(self) -> None:
        """Look at each loop turn: what a task of the program does."""
        while True:
            self.turns += 1
            self.most = max(self.most, self.now - self._turn_began)
            self._turn_began = self.now
            await asyncio.sleep(0)


@pytest.fixture
async def hands() -> Any:
    """The clock of the running loop's callback budget, watched by a task."""
    clock = Hands()
    CallbackBudget.of(asyncio.get_running_loop()).clock = clock
    watching = asyncio.create_task(clock.watch())
    yield clock
    watching.cancel()


async def test_one_slow_callback_runs_between_two_loop_turns(hands: Hands) -> None:
    """1,500 callbacks of 5 ms run one to a loop turn; the first at once."""
    mailbox = Mailbox()
    async with opened(mailbox, CallbackBudget(hands)):
        source = Recorder(mailbox)
        source.queue.extend([hands.take] * (CROWD - 1))
        source.add(hands.take)
        assert len(source.results) == 1
        await until(lambda: len(source.results) == CROWD)
    assert hands.most == pytest.approx(SLOW_SEC)


async def test_a_source_waits_for_one_share_of_each_other(hands: Hands) -> None:
    """A source with much to do yields to one with little after its share, within a loop turn, too."""
    mailbox = Mailbox()
    async with opened(mailbox, CallbackBudget(hands)):
        crowd, timer = Recorder(mailbox), Recorder(mailbox)
        crowd.queue.extend([partial(hands.take, SHARE_SEC / 4)] * CROWD)
        waited: list[float] = []
        crowd.queue.appendleft(lambda: timer.add(lambda: waited.append(hands.now)))
        mailbox.post(crowd)
        await until(lambda: len(crowd.results) > CROWD)
    assert waited == [pytest.approx(SHARE_SEC)]
    assert hands.most <= BUDGET_SEC + SHARE_SEC + SHARE_SEC / 4


async def test_nodes_of_a_loop_share_the_budget_in_turn(hands: Hands) -> None:
    """Two mailboxes with much to do take together no more than one, and neither is served twice in a row."""
    budget, order = CallbackBudget(hands), list[str]()
    first, second = Mailbox(), Mailbox()
    async with opened(first, budget), opened(second, budget):
        for name, mailbox in (("a", first), ("b", second)):

            def callback(name: str = name) -> None:
                order.append(name)
                hands.take()

            source = Recorder(mailbox)
            source.queue.extend([callback] * CROWD)
            mailbox.post(source)
        await until(lambda: len(order) == 2 * CROWD)
    assert "".join(order[1:11]) == "ab" * 5  # the first ran where it was posted
    assert hands.most == pytest.approx(SLOW_SEC)


async def test_coroutines_that_never_suspend_yield_to_the_loop(hands: Hands) -> None:
    """A worker that runs one `async def` callback after another is held to the budget, too."""
    mailbox = Mailbox()
    async with opened(mailbox, CallbackBudget(hands)) as tasks:
        source = Recorder(mailbox)

        async def callback() -> None:
            hands.take()

        source.queue.extend([callback] * CROWD)
        mailbox.post(source)
        await until(lambda: len(source.results) == CROWD)
        assert len(tasks) == 1
    assert hands.most == pytest.approx(SLOW_SEC)


async def test_a_budget_is_renewed_for_callbacks_that_come_one_by_one(hands: Hands) -> None:
    """Callbacks that each fit a loop turn of their own are never deferred."""
    mailbox = Mailbox()
    async with opened(mailbox, CallbackBudget(hands)):
        source = Recorder(mailbox)
        for number in range(1, 101):
            source.add(partial(hands.take, BUDGET_SEC - SHARE_SEC))
            assert len(source.results) == number
            await asyncio.sleep(0)
            await asyncio.sleep(0)


async def slowed(
    meeting: Meeting, hands: Hands, callback: Callable[[Any], Any], *, concurrent: bool = False
) -> list[int]:
    """Publish 1,500 messages to such a callback; return how many had been heard at each tick of a timer."""
    talker, listener = await meeting.node("talker"), await meeting.node("listener")
    subscription = listener.create_subscription(Int64, "numbers", callback, KEEP_ALL, concurrent=concurrent)
    publisher = talker.create_publisher(Int64, "numbers", KEEP_ALL)
    await matched(publisher)
    ticks: list[int] = []
    timer = listener.create_timer(0, lambda: ticks.append(subscription.received))
    for number in range(CROWD):
        publisher.publish(Int64(data=number))
    await until(
        lambda: subscription.received == CROWD and not endpoint_of(subscription).diagnostics().running
    )
    timer.cancel()
    assert subscription.dropped == 0
    return ticks


async def test_a_crowd_of_messages_leaves_time_for_timers_and_tasks(meeting: Meeting, hands: Hands) -> None:
    """Plain callbacks of 5 ms with 1,500 messages queued: one in a loop turn, and a timer ticks all along."""
    ticks = await slowed(meeting, hands, lambda _: hands.take())
    assert hands.most == pytest.approx(SLOW_SEC)
    assert len({tick for tick in ticks if 0 < tick < CROWD}) > CROWD / 4


async def test_callbacks_that_become_slow_are_noticed(meeting: Meeting, hands: Hands) -> None:
    """After cheap callbacks the first few slow ones may run together, later ones do not."""
    together: list[int] = []

    def callback(message: Int64) -> None:
        if message.data >= CROWD / 2:
            hands.take()
            together.append(hands.turns)

    await slowed(meeting, hands, callback)
    assert hands.most <= CHECK_EVERY * SLOW_SEC + 1e-9
    assert len(set(together)) >= len(together) - CHECK_EVERY


async def test_concurrent_callbacks_leave_time_for_timers_and_tasks(meeting: Meeting, hands: Hands) -> None:
    """Callbacks that run side by side start in order, and one in a loop turn when they are slow."""
    received: list[int] = []
    steps: dict[int, int] = {}

    def step() -> None:
        hands.take()
        steps[hands.turns] = steps.get(hands.turns, 0) + 1

    async def callback(message: Int64) -> None:
        received.append(message.data)
        step()
        await asyncio.sleep(0)
        step()

    await slowed(meeting, hands, callback, concurrent=True)
    assert received == list(range(CROWD))
    assert hands.most <= CONCURRENT_STARTS * SLOW_SEC + 1e-9  # the first, before anything is known of them
    assert sum(count > 2 for count in steps.values()) <= 2


async def test_a_crowd_of_requests_leaves_time_for_timers_and_tasks(meeting: Meeting, hands: Hands) -> None:
    """Plain handlers of 5 ms with 1,500 requests: one in a loop turn, a timer ticks, all are answered."""
    server, caller = await meeting.node("server"), await meeting.node("caller")

    def handle(request: Empty.Request, response: Empty.Response) -> Empty.Response:
        hands.take()
        return response

    service = server.create_service(Empty, "serve", handle)
    ticks: list[int] = []
    timer = server.create_timer(0, lambda: ticks.append(service.calls))
    client = caller.create_client(Empty, "serve")
    assert await client.wait_for_service(10)
    await asyncio.gather(*(client.call(Empty.Request()) for _ in range(CROWD)))
    timer.cancel()
    assert hands.most == pytest.approx(SLOW_SEC)
    assert len(set(ticks)) > CROWD / 4


async def test_what_an_exhausted_budget_leaves_is_held_to_the_depth(meeting: Meeting, hands: Hands) -> None:
    """A KEEP_LAST reader whose callback is slow takes the newest `depth` messages; the others are counted."""
    talker, listener = await meeting.node("talker"), await meeting.node("listener")
    received: list[int] = []

    def callback(message: Int64) -> None:
        received.append(message.data)
        hands.take()

    subscription = listener.create_subscription(Int64, "numbers", callback, 10)
    publisher = talker.create_publisher(Int64, "numbers", 100)
    await matched(publisher)
    for number in range(100):
        publisher.publish(Int64(data=number))
    await until(lambda: received and received[-1] == 99)
    assert received == [0, *range(90, 100)]
    assert (subscription.received, subscription.dropped) == (11, 89)


async def test_a_node_stops_with_work_left_over(
    meeting: Meeting, hands: Hands, caplog: pytest.LogCaptureFixture
) -> None:
    """Messages that wait for the budget when their node ends are counted as unread; none runs later."""
    talker = await meeting.node("talker")
    received: list[int] = []
    caplog.set_level("INFO")
    async with meeting.absent("listener") as listener:

        def callback(message: Int64) -> None:
            received.append(message.data)
            hands.take()

        subscription = listener.create_subscription(Int64, "numbers", callback, KEEP_ALL)
        publisher = talker.create_publisher(Int64, "numbers", KEEP_ALL)
        await matched(publisher)
        for number in range(CROWD):
            publisher.publish(Int64(data=number))
        await until(lambda: subscription.received + subscription.queued == CROWD)
    count = len(received)
    assert count < CROWD
    assert f"Stopping with {CROWD - count} received messages unread" in caplog.text
    await meeting.settled(talker)
    assert len(received) == count

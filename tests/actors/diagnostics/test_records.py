"""Tests of what a node says about itself: the numbers add up, and two looks give rates."""

from __future__ import annotations

import asyncio
import itertools
import json
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors.diagnostics.records import NodeDiagnostics, PublisherDiagnostics
from actors.endpoints.endpoint import endpoint_of
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String
from tests.actors.meeting import KEEP_ALL, matched, set_budget_clock, until
from tests.simulation.stage import Stage, play

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.actors.meeting import Meeting


def add(request: AddTwoInts.Request) -> AddTwoInts.Response:
    """Serve, but for one number."""
    if request.a == 13:
        raise ValueError("not 13, please")
    return AddTwoInts.Response(sum=request.a + request.b)


def sizes(node: actors.Node) -> dict[str, int]:
    """Return how full the node's maps are."""
    return {size.name: size.size for size in node.diagnostics().sizes}


async def test_a_node_that_has_never_run_says_so(meeting: Meeting) -> None:
    """Diagnostics need no loop, no broker and no entities."""
    node = meeting.absent("lonely", url="callboard://127.0.0.1:1")
    look = node.diagnostics()
    assert (look.node, look.connected, look.connections) == ("/lonely", False, 0)
    assert look.broker == "callboard://127.0.0.1:1"
    assert not look.publishers + look.subscriptions + look.services + look.clients + look.timers
    assert look.mailbox.workers == 0
    assert not look.mailbox.busy


async def test_published_is_received_or_dropped(meeting: Meeting) -> None:
    """Both ends count every message, and what each callback took."""
    set_budget_clock(itertools.count(0.0, 1e-9).__next__)
    talker, listener = await meeting.node("talker"), await meeting.node("listener")
    received: list[str] = []
    subscription = listener.create_subscription(String, "t", lambda msg: received.append(msg.data), KEEP_ALL)
    publisher = talker.create_publisher(String, "t", KEEP_ALL)
    await matched(publisher)
    for number in range(100):
        publisher.publish(String(data=str(number)))
    before = talker.diagnostics().publishers[0]
    assert (before.published, before.queued, before.matched) == (100, 100, 1)
    await until(lambda: len(received) == 100)
    (sent,), (came,) = talker.diagnostics().publishers, listener.diagnostics().subscriptions
    assert (sent.topic, sent.published, sent.dropped, sent.queued, sent.queued_bytes) == ("/t", 100, 0, 0, 0)
    assert sent.credit is not None
    assert sent.credit > 0
    assert came.id == subscription.id
    assert (came.topic, came.matched, came.received, came.queued, came.dropped) == ("/t", 1, 100, 0, 0)
    assert came.callback is not None
    assert "<lambda>" in came.callback.name
    assert came.callback.calls == 100
    assert 0 < came.callback.longest_sec <= came.callback.busy_sec


async def test_callbacks_of_events_are_timed_like_others(meeting: Meeting) -> None:
    """Plain and async ones, at both ends; those that are not given are not there."""
    set_budget_clock(itertools.count(0.0, 1e-9).__next__)
    both = await meeting.node("both")
    told: list[str] = []

    def plain(info: actors.MatchedInfo) -> None:
        told.append(f"publisher {info.current_count}")

    async def asynchronous(info: actors.MatchedInfo) -> None:
        await asyncio.sleep(0)
        told.append(f"subscription {info.current_count}")

    publisher = both.create_publisher(
        String, "t", 10, event_callbacks=actors.PublisherEventCallbacks(matched=plain)
    )
    both.create_subscription(
        String, "t", qos_profile=10, event_callbacks=actors.SubscriptionEventCallbacks(matched=asynchronous)
    )
    await matched(publisher)
    await until(lambda: sorted(told) == ["publisher 1", "subscription 1"])
    look = both.diagnostics()
    (of_publisher,), (of_subscription,) = look.publishers[0].events, look.subscriptions[0].events
    for known, name in ((of_publisher, "plain"), (of_subscription, "asynchronous")):
        assert name in known.name
        assert known.calls == 1
        assert 0 < known.longest_sec <= known.busy_sec
        assert known in look.callbacks
    assert of_subscription.longest_elapsed_sec >= of_subscription.longest_sec


async def test_drops_are_shown_where_they_happen(meeting: Meeting) -> None:
    """A publisher without a broker, and a reader that does not read, each keep to their depth and count."""
    absent = meeting.absent("absent")
    unsent = absent.create_publisher(String, "t", 3)
    for _ in range(10):
        unsent.publish(String(data="x"))
        endpoint_of(unsent).flush_turn()
    (sent,) = absent.diagnostics().publishers
    assert (sent.published, sent.queued, sent.dropped, sent.queue_limit) == (10, 3, 7, 3)
    assert sent.queued_bytes > 0
    node = await meeting.node("node")
    node.create_subscription(String, "t", qos_profile=2)
    publisher = node.create_publisher(String, "t", KEEP_ALL)
    await matched(publisher)
    for _ in range(10):
        publisher.publish(String(data="x"))
    await meeting.settled(node)
    (came,) = node.diagnostics().subscriptions
    assert came.callback is None
    assert (came.queued, came.queue_limit) == (2, 2)
    assert came.received + came.queued + came.dropped + came.lost == 10


async def test_calls_add_up_at_both_ends(meeting: Meeting) -> None:
    """Calls made are served, failed, timed out or pending; errors are counted at the server."""
    server, asker = await meeting.node("server"), await meeting.node("asker")
    gate = asyncio.Event()

    async def slow(request: AddTwoInts.Request) -> AddTwoInts.Response:
        await gate.wait()
        return AddTwoInts.Response()

    server.create_service(AddTwoInts, "add", add)
    server.create_service(AddTwoInts, "slow", slow, concurrent=True)
    client, waiting = asker.create_client(AddTwoInts, "add"), asker.create_client(AddTwoInts, "slow")
    await client.wait_for_service()
    await waiting.wait_for_service()
    for a in (1, 2, 13):
        try:
            await client.call(AddTwoInts.Request(a=a, b=1))
        except actors.RemoteError:
            assert a == 13
    with pytest.raises(actors.ServiceTimeout):
        await waiting.call(AddTwoInts.Request(), 0.0)
    pending = waiting.call_async(AddTwoInts.Request())
    await until(lambda: server.diagnostics().services[1].running == 1)
    first, second = asker.diagnostics().clients
    assert (first.service, first.matched, first.calls, first.failed, first.timeouts) == ("/add", 1, 3, 1, 0)
    assert (second.calls, second.pending, second.failed, second.timeouts) == (2, 1, 1, 1)
    quick, _ = server.diagnostics().services
    assert (quick.service, quick.served, quick.errors, quick.waiting) == ("/add", 3, 1, 0)
    assert quick.callback.calls == 3
    assert server.diagnostics().callback_errors == 1
    gate.set()
    await pending


async def test_the_mailbox_and_timers_are_shown(meeting: Meeting) -> None:
    """A callback that is under way keeps the mailbox busy; ticks that pass meanwhile are skipped."""
    node = await meeting.node("node")
    gate = asyncio.Event()

    async def tick() -> None:
        await gate.wait()

    timer = node.create_timer(0.001, tick)
    await until(lambda: timer.skipped > 2)
    look = node.diagnostics()
    assert look.mailbox.busy
    assert (look.mailbox.workers, look.mailbox.suspended) == (1, 0)
    (shown,) = look.timers
    assert (shown.period_sec, shown.ticks) == (0.001, 1)
    assert shown.skipped > 2
    assert shown.name.endswith("tick")
    assert sizes(node)["timers"] == 1
    gate.set()


def test_lag_of_a_loop_that_is_held_up() -> None:
    """The keepalive's tick tells how late the loop was; without trouble it is in time."""

    async def scene(stage: Stage) -> None:
        node = await stage.enter("node")
        await asyncio.sleep(5)
        assert node.diagnostics().loop_lag.longest_sec < 0.01
        stage.loop.stall(0.7)
        await asyncio.sleep(1)
        lag = node.diagnostics().loop_lag
        assert lag.longest_sec == pytest.approx(0.5, abs=0.3)
        assert lag.last_sec < 0.01
        await asyncio.sleep(100)
        assert node.diagnostics().loop_lag.longest_sec < 0.01

    play(scene)


async def test_as_dict_is_json(meeting: Meeting) -> None:
    """Everything in it, and in rates, goes through `json`, and back to the same numbers."""
    node = await meeting.node("node")
    node.create_subscription(String, "t", print)
    node.create_publisher(String, "t")
    node.create_service(AddTwoInts, "add", add)
    node.create_client(AddTwoInts, "add")
    node.create_timer(60, lambda: None)
    earlier, later = node.diagnostics(), node.diagnostics()
    look = json.loads(json.dumps(later.as_dict()))
    assert look["node"] == "/node"
    assert look["broker"] == meeting.url
    assert look["connected"] is True
    assert look["subscriptions"][0]["callback"]["name"] == "print"
    assert {"name": "entities", "size": 4, "limit": None} in look["sizes"]
    rates = json.loads(json.dumps(later.rates_since(earlier).as_dict()))
    assert rates["publishers"] == {"/t": {"published": 0.0, "dropped": 0.0}}
    assert rates["clients"] == {"/add": {"calls": 0.0, "failed": 0.0, "timeouts": 0.0}}


def looks(
    change: Callable[[NodeDiagnostics], NodeDiagnostics],
) -> tuple[NodeDiagnostics, NodeDiagnostics]:
    """Return two looks at a node, two seconds apart."""
    node = actors.Node("node", url="callboard://127.0.0.1:1", use_global_arguments=False)
    earlier = replace(node.diagnostics(), uptime_sec=10.0)
    return earlier, change(replace(earlier, uptime_sec=12.0))


def publisher(number: int, topic: str, published: int) -> PublisherDiagnostics:
    """Return a look at a publisher."""
    return PublisherDiagnostics(
        id=number,
        topic=topic,
        matched=0,
        published=published,
        dropped=0,
        queued=0,
        queued_bytes=0,
        queue_limit=10,
        credit=None,
        events=(),
    )


def test_rates_are_differences_per_second() -> None:
    """Publishers of one topic are added up; a new one begins at zero; one that has gone does not count."""
    earlier, later = looks(lambda look: replace(look, callback_errors=4))
    earlier = replace(earlier, publishers=(publisher(1, "/a", 100), publisher(2, "/b", 50)))
    later = replace(later, publishers=(publisher(1, "/a", 110), publisher(3, "/a", 4), publisher(4, "/c", 2)))
    rates = later.rates_since(earlier)
    assert rates.interval_sec == 2.0
    assert rates.callback_errors == 2.0
    assert {topic: of["published"] for topic, of in rates.publishers.items()} == {"/a": 7.0, "/c": 1.0}


def test_a_node_that_came_again_counts_from_zero() -> None:
    """Another node of the name, with the same ids and smaller counts: no rate is negative."""
    earlier, later = looks(lambda look: replace(look, callback_errors=2))
    earlier = replace(earlier, callback_errors=6, publishers=(publisher(1, "/a", 100), publisher(2, "/b", 5)))
    later = replace(later, publishers=(publisher(1, "/a", 10), publisher(2, "/b", 9)))
    rates = later.rates_since(earlier)
    assert rates.callback_errors == 1.0
    assert {topic: of["published"] for topic, of in rates.publishers.items()} == {"/a": 5.0, "/b": 2.0}


@pytest.mark.parametrize("changes", [{"uptime_sec": 10.0}, {"uptime_sec": 9.0}, {"node": "/other"}])
def test_rates_need_an_earlier_snapshot_at_the_same_node(changes: dict[str, Any]) -> None:
    """Two looks in the wrong order, at one moment, or at two nodes give no rates."""
    earlier, later = looks(lambda look: replace(look, **changes))
    with pytest.raises(ValueError, match="earlier snapshot"):
        later.rates_since(earlier)


async def test_the_busiest_callback_comes_first(meeting: Meeting) -> None:
    """`callbacks` is sorted by the time that each has held the loop; `busy` is their part of it."""
    now = 0.0
    set_budget_clock(lambda: now)
    node = await meeting.node("node")

    def idle() -> None:
        nonlocal now
        now += 1e-7

    def work() -> None:
        nonlocal now
        now += 1e-6

    quiet, loud = node.create_timer(0.001, idle), node.create_timer(0.001, work)
    earlier = node.diagnostics()
    await until(lambda: quiet.ticks > 20 and loud.ticks > 20)
    later = node.diagnostics()
    assert [callback.name.rpartition(".")[2] for callback in later.callbacks] == ["work", "idle"]
    assert 0 < later.rates_since(earlier).busy < 1

"""Events: their callbacks are callbacks like any other, and what nobody wants to know is logged, or not."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors.endpoints.endpoint import endpoint_of
from actors.endpoints.events import EndpointEvents
from actors.interfaces.std_msgs.msg import Int64, String
from proto.wire.codes import NoticeKind
from proto.wire.frames import Notice
from tests.actors.meeting import matched, turns, until
from tests.seams.brokers import without_capabilities
from tests.seams.simulation import subscription_events

if TYPE_CHECKING:
    from tests.actors.meeting import Meeting

BEST_EFFORT = actors.QoSProfile(depth=10, reliability=actors.ReliabilityPolicy.BEST_EFFORT)


def heeding(**callbacks: Any) -> actors.SubscriptionEventCallbacks:
    """Return what makes a subscription tell its events to these."""
    return actors.SubscriptionEventCallbacks(**callbacks)


def ignore(message: Any) -> None:
    """Hear a message."""
    del message


def warnings_of(caplog: pytest.LogCaptureFixture, text: str) -> list[str]:
    """Return the names of the loggers that have warned of this, in alphabetical order."""
    return sorted(record.name for record in caplog.records if text in record.getMessage())


async def test_an_async_callback_takes_its_turn(meeting: Meeting) -> None:
    """It runs in the mailbox, alone; events that occur meanwhile are reported together when it has ended."""
    talker, listener = await meeting.node("talker"), await meeting.node("listener")
    told: list[tuple[int, ...]] = []
    received: list[int] = []
    leave = asyncio.Event()

    async def tell(info: actors.MatchedInfo) -> None:
        told.append(tuple(info))
        await leave.wait()

    subscription = listener.create_subscription(
        Int64, "numbers", lambda message: received.append(message.data), event_callbacks=heeding(matched=tell)
    )
    publisher = talker.create_publisher(Int64, "numbers")
    await matched(publisher)
    await until(lambda: told)
    publisher.publish(Int64(data=1))
    await until(lambda: subscription.queued)
    await come_and_go_beside(talker, subscription)
    assert told == [(1, 1, 1, 1)]
    assert received == []
    leave.set()
    await until(lambda: len(told) == 2)
    assert told[1] == (2, 1, 1, 0)
    assert received == [1]


async def come_and_go_beside(node: actors.Node, subscription: actors.Subscription[Any]) -> None:
    """Let a second publisher come and go."""
    publisher = node.create_publisher(Int64, "numbers")
    await matched(subscription, 2)
    node.destroy_publisher(publisher)
    await matched(subscription, 1)


@pytest.mark.parametrize("kind", ["def", "async def"])
async def test_a_callback_that_raises_harms_nobody(
    meeting: Meeting, caplog: pytest.LogCaptureFixture, kind: str
) -> None:
    """The error is logged with its endpoint, and counted; the next event is reported all the same."""
    both = await meeting.node("both")
    told: list[int] = []

    def plain(info: actors.MatchedInfo) -> None:
        told.append(info.current_count)
        raise ValueError("too much")

    async def slow(info: actors.MatchedInfo) -> None:
        await asyncio.sleep(0)
        plain(info)

    callback = plain if kind == "def" else slow
    subscription = both.create_subscription(
        Int64, "numbers", ignore, event_callbacks=heeding(matched=callback)
    )
    publisher = both.create_publisher(Int64, "numbers")
    await until(lambda: both.callback_errors == 1)
    both.destroy_publisher(publisher)
    await until(lambda: both.callback_errors == 2)
    assert told == [1, 0]
    assert both.connected
    assert subscription.peers == 0
    raised = [record for record in caplog.records if record.exc_info]
    what = "the events of the subscription to '/numbers' raised ValueError: too much"
    assert [record.getMessage().endswith(what) for record in raised] == [True, True]


@pytest.mark.parametrize("kind", ["def", "async def"])
async def test_a_callback_that_raises_can_stop_the_node(meeting: Meeting, kind: str) -> None:
    """on_error='stop' holds for the callbacks of events, too."""
    node = meeting.absent("both", on_error="stop")

    def plain(info: actors.MatchedInfo) -> None:
        raise ValueError(info.current_count)

    async def slow(info: actors.MatchedInfo) -> None:
        await asyncio.sleep(0)
        plain(info)

    callbacks = actors.PublisherEventCallbacks(matched=plain if kind == "def" else slow)
    node.create_publisher(Int64, "numbers", event_callbacks=callbacks)
    node.create_subscription(Int64, "numbers", ignore)
    async with asyncio.timeout(20):
        with pytest.raises(ValueError, match="1"):
            await node.run()


@pytest.mark.parametrize("callbacks", ["default", "none", "own"])
async def test_a_misfit_is_logged_once_by_those_who_do_not_handle_it(
    meeting: Meeting, caplog: pytest.LogCaptureFixture, callbacks: str
) -> None:
    """Each side warns once of each kind; with a callback it tells that instead, without defaults nobody."""
    talker, listener = await meeting.node("talker"), await meeting.node("listener")
    told: list[Any] = []
    own = {"incompatible_qos": told.append, "incompatible_type": told.append} if callbacks == "own" else {}
    use: dict[str, Any] = {"use_default_callbacks": callbacks != "none", **own}
    events = heeding(**use)
    publisher_events = actors.PublisherEventCallbacks(**use)
    publisher = talker.create_publisher(Int64, "numbers", BEST_EFFORT, event_callbacks=publisher_events)
    listener.create_subscription(Int64, "numbers", ignore, event_callbacks=events)
    listener.create_subscription(String, "numbers", ignore, event_callbacks=events)
    await matched(publisher)
    await meeting.settled(talker, listener)
    await turns()
    names = ["callboard.listener", "callboard.talker"] if callbacks == "default" else []
    assert warnings_of(caplog, "incompatible QoS") == names
    assert warnings_of(caplog, "types differ") == names
    assert len(told) == (4 if callbacks == "own" else 0)


@pytest.mark.parametrize("kind", ["publisher", "subscription"])
async def test_nothing_is_reported_of_what_has_been_destroyed(meeting: Meeting, kind: str) -> None:
    """An event that waits for the mailbox when its entity is destroyed is not told any more."""
    both = await meeting.node("both")
    told: list[Any] = []
    leave, entered = asyncio.Event(), asyncio.Event()

    async def hold(message: Int64) -> None:
        del message
        entered.set()
        await leave.wait()

    both.create_subscription(Int64, "holds", hold)
    holder = both.create_publisher(Int64, "holds")
    await matched(holder)
    holder.publish(Int64())
    await entered.wait()
    publisher = both.create_publisher(
        Int64, "numbers", event_callbacks=actors.PublisherEventCallbacks(matched=told.append)
    )
    subscription = both.create_subscription(
        Int64, "numbers", ignore, event_callbacks=heeding(matched=told.append)
    )
    await matched(publisher)
    await matched(subscription)
    await turns()
    if kind == "publisher":
        both.destroy_publisher(publisher)
        await matched(subscription, 0)
    else:
        both.destroy_subscription(subscription)
        await matched(publisher, 0)
    leave.set()
    await until(lambda: told)
    await meeting.settled(both)
    # Only the one that is left: its counterpart has come and gone while it could not be told.
    assert told == [(1, 1, 0, 0)]


async def test_what_does_not_change_is_not_reported(meeting: Meeting) -> None:
    """No change, no call; of many changes in one turn of the loop one call with their sum."""
    both = await meeting.node("both")
    told: list[Any] = []
    subscription = both.create_subscription(
        Int64, "numbers", ignore, event_callbacks=heeding(message_lost=told.append)
    )
    lost = subscription_events(subscription).message_lost
    lost.add(0)
    await turns()
    assert told == []
    for count in (1, 2, 3):
        lost.add(count)
    await turns()
    assert told == [(6, 6)]
    lost.add(4)
    lost.add(-4)
    await turns()
    assert told == [(6, 6)]
    assert lost.calls == 1


@pytest.mark.parametrize("strict", ["publisher", "subscription", "talking node", "listening node"])
async def test_a_strict_pair_with_incompatible_qos_does_not_match(
    meeting: Meeting, caplog: pytest.LogCaptureFixture, strict: str
) -> None:
    """One strict side suffices: no count, no message, an event on both sides; others match as always."""
    talker = await meeting.node("talker", strict_qos=strict == "talking node")
    listener = await meeting.node("listener", strict_qos=strict == "listening node")
    told: list[actors.IncompatibleQoSInfo] = []
    received: list[int] = []
    offering = actors.PublisherEventCallbacks(incompatible_qos=told.append)
    publisher = talker.create_publisher(
        Int64,
        "numbers",
        BEST_EFFORT,
        event_callbacks=offering,
        strict_qos=True if strict == "publisher" else None,
    )
    subscription = listener.create_subscription(
        Int64,
        "numbers",
        lambda message: received.append(message.data),
        event_callbacks=heeding(incompatible_qos=told.append),
        strict_qos=True if strict == "subscription" else None,
    )
    beside = listener.create_subscription(Int64, "numbers", qos_profile=BEST_EFFORT)
    await matched(publisher)
    await until(lambda: len(told) == 2)
    assert told == [(1, 1, actors.QoSPolicyKind.RELIABILITY)] * 2
    publisher.publish(Int64(data=1))
    await until(lambda: beside.queued)
    await meeting.settled(talker, listener)
    assert (publisher.get_subscription_count(), subscription.get_publisher_count()) == (1, 0)
    assert received == []
    infos = await talker.get_publishers_info_by_topic("numbers")
    infos += await talker.get_subscriptions_info_by_topic("numbers")
    expected = [strict in {"publisher", "talking node"}, strict in {"subscription", "listening node"}]
    assert [each.strict_qos for each in infos] == [*expected, strict == "listening node"]
    assert [len(str(each).splitlines()) for each in infos] == [14 + each.strict_qos for each in infos]
    assert not warnings_of(caplog, "incompatible QoS")  # the callbacks have them


async def test_an_endpoint_of_a_strict_node_need_not_be_strict(meeting: Meeting) -> None:
    """The endpoint's own choice wins over the node's default."""
    strict, other = await meeting.node("strict", strict_qos=True), await meeting.node("other")
    publisher = strict.create_publisher(Int64, "numbers", BEST_EFFORT, strict_qos=False)
    subscription = other.create_subscription(Int64, "numbers")
    await matched(publisher)
    publisher.publish(Int64(data=1))
    await until(lambda: subscription.queued)


async def test_a_broker_without_strict_qos_causes_a_warning(
    meeting: Meeting, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Against an older broker a strict endpoint warns that incompatible messages are delivered."""
    without_capabilities(monkeypatch)
    node = await meeting.node("strict")
    node.create_publisher(Int64, "lax")
    node.create_publisher(Int64, "numbers", strict_qos=True)
    found = [record.getMessage() for record in caplog.records if "strict QoS" in record.getMessage()]
    assert len(found) == 1
    assert found[0].startswith("'/numbers': the broker at ")


async def test_a_policy_that_is_not_known_yet_is_reported_as_invalid(meeting: Meeting) -> None:
    """A later broker may know more policies than this node; the warning says what it says."""
    both = await meeting.node("both")
    told: list[actors.IncompatibleQoSInfo] = []
    subscription = both.create_subscription(
        Int64, "numbers", ignore, event_callbacks=heeding(incompatible_qos=told.append)
    )
    events = endpoint_of(subscription).events
    assert isinstance(events, EndpointEvents)
    events.notice(Notice(subscription.id, NoticeKind.INCOMPATIBLE_QOS, "new", 250, 2))
    await until(lambda: told)
    assert told == [(2, 2, actors.QoSPolicyKind.INVALID)]


async def test_a_callback_that_waits_for_a_call_is_not_begun_again(meeting: Meeting) -> None:
    """While one runs, although it has let the mailbox go, the next counts wait and come as one."""
    listener = await meeting.node("listener")
    told: list[tuple[int, ...]] = []

    async def tell(info: actors.MessageLostInfo) -> None:
        told.append(tuple(info))
        await listener.wait_for_node("/guest")

    subscription = listener.create_subscription(
        Int64, "numbers", ignore, event_callbacks=heeding(message_lost=tell)
    )
    for _ in range(50):
        subscription_events(subscription).message_lost.add(1)
        await turns(3)
    assert told == [(1, 1)]
    await meeting.node("guest")
    await until(lambda: len(told) == 2)
    assert told[1] == (50, 49)

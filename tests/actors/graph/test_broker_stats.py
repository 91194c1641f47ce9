"""What a node can ask about its broker's work; the answers are the broker's."""

from __future__ import annotations

import asyncio
import json
from dataclasses import replace
from typing import TYPE_CHECKING

import pytest

import actors
from actors.graph.broker_report import BrokerReport, ReportParts
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String
from proto.wire.stats import BrokerStats, LinkStats, TopicStats
from tests.actors.meeting import DEADLINE_SEC, KEEP_ALL, matched, until
from tests.seams.nodes import link_of, queries_of

if TYPE_CHECKING:
    from pathlib import Path

    from proto.wire import frames
    from tests.actors.meeting import Meeting


def stats_of(report: BrokerReport, node: str) -> LinkStats:
    """Return the link of one node."""
    (link,) = [link for link in report.links.values() if node in link.nodes]
    return link


async def test_the_broker_tells_what_it_has_done(meeting: Meeting) -> None:
    """Published, heard and counted are the same number; the answer is what the broker itself says."""
    talker, listener = await meeting.node("talker"), await meeting.node("listener", namespace="/ns")
    received: list[String] = []
    listener.create_subscription(String, "/t", received.append, KEEP_ALL)
    publisher = talker.create_publisher(String, "t", KEEP_ALL)
    await matched(publisher)
    for _ in range(100):
        publisher.publish(String(data="hello"))
    await until(lambda: len(received) == 100)
    await meeting.settled(talker, listener)
    report = await talker.get_broker_stats()
    topic = report.topics["/t"]
    assert (topic.publishers, topic.subscriptions, topic.messages, topic.delivered) == (1, 1, 100, 100)
    assert topic == {topic.name: topic for topic in meeting.broker.topic_stats()}["/t"]
    assert (report.totals.routed, report.totals.copies, report.totals.accounted) == (100, 100, 100)
    assert report.totals.broker == meeting.broker.instance.hex()
    mine, other = stats_of(report, "/talker"), stats_of(report, "/ns/listener")
    assert mine.bytes_received > topic.bytes
    assert other.bytes_sent > topic.bytes
    assert (other.queued, other.dropped, other.suspended) == (0, 0, False)
    assert mine.agent.startswith("callboard")
    assert len(report.links) == report.totals.connections == 2


async def test_a_server_that_hangs_can_be_found(meeting: Meeting) -> None:
    """The calls that nobody answers stand with the link that owes them."""
    asker, server = await meeting.node("asker"), await meeting.node("server")
    gate = asyncio.Event()

    async def hang(request: AddTwoInts.Request) -> AddTwoInts.Response:
        await gate.wait()
        return AddTwoInts.Response(sum=request.a)

    server.create_service(AddTwoInts, "add", hang)
    client = asker.create_client(AddTwoInts, "add")
    assert await client.wait_for_service(20)
    calls = [client.call_async(AddTwoInts.Request(a=number)) for number in range(3)]
    await until(lambda: meeting.broker.stats().pending_calls == 3)
    report = await asker.get_broker_stats()
    assert (stats_of(report, "/asker").pending_calls, stats_of(report, "/server").owed_calls) == (3, 3)
    gate.set()
    await asyncio.gather(*calls)
    report = await asker.get_broker_stats()
    assert (stats_of(report, "/asker").pending_calls, stats_of(report, "/server").owed_calls) == (0, 0)


async def test_another_domain_is_counted_and_not_reported(meeting: Meeting) -> None:
    """Topics and links are the own domain's; totals are the broker's."""
    here, there = await meeting.node("here"), await meeting.node("there", domain=7)
    here.create_publisher(String, "mine")
    there.create_publisher(String, "theirs")
    await meeting.settled(here, there)
    for node, domain, name in ((here, 0, "/mine"), (there, 7, "/theirs")):
        report = await node.get_broker_stats()
        assert name in report.topics
        assert {topic.domain for topic in report.topics.values()} == {domain}
        assert {link.domain for link in report.links.values()} == {domain}
        assert report.totals.connections == 2
        assert report.totals.topics == len(meeting.broker.topic_stats())


async def test_three_thousand_topics_come_in_slices(
    meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An answer that no frame can hold is put together again, and fits the frames on its way."""
    node = await meeting.node("many")
    names = [f"{'long' * 50}/n{number}" for number in range(3000)]
    for name in names:
        node.create_publisher(String, name)
    await until(lambda: meeting.broker.stats().endpoints > 3000)  # which takes longer than a query may
    pieces: list[frames.Stats] = []
    add = ReportParts.add

    def noting_add(parts: ReportParts, piece: frames.Stats) -> None:
        pieces.append(piece)
        add(parts, piece)

    monkeypatch.setattr(ReportParts, "add", noting_add)
    report = await node.get_broker_stats()
    assert {f"/{name}" for name in names} <= set(report.topics)
    assert len(pieces) > 3
    assert [piece.more for piece in pieces] == [True] * (len(pieces) - 1) + [False]
    assert [bool(piece.totals) for piece in pieces] == [True] + [False] * (len(pieces) - 1)


async def test_asked_two_hundred_times_at_once(meeting: Meeting) -> None:
    """Every question is answered; nothing is left of them, and messages went on meanwhile."""
    node = await meeting.node("curious")
    received: list[String] = []
    node.create_subscription(String, "t", received.append, KEEP_ALL)
    publisher = node.create_publisher(String, "t", KEEP_ALL)
    await matched(publisher)
    publisher.publish(String(data="x"))
    reports = await asyncio.gather(*(node.get_broker_stats() for _ in range(200)))
    stamps = [report.totals.stamp_sec for report in reports]
    assert stamps == sorted(stamps)
    await until(lambda: received)
    assert not link_of(node).answers


async def test_two_reports_give_rates(meeting: Meeting) -> None:
    """What happened in between, by topic and link; a topic that is new counts from zero."""
    node = await meeting.node("node")
    publisher = node.create_publisher(String, "old")
    await meeting.settled(node)
    publisher.publish(String(data="x"))
    await meeting.settled(node)
    before = await node.get_broker_stats()
    fresh = node.create_publisher(String, "new")
    await meeting.settled(node)
    for _ in range(10):
        publisher.publish(String(data="x"))
        fresh.publish(String(data="x"))
    await meeting.settled(node)
    after = await node.get_broker_stats()
    rates = after.rates_since(before)
    seconds = rates.totals.interval_sec
    assert rates.topics["/old"]["messages"] * seconds == pytest.approx(10)
    assert rates.topics["/new"]["messages"] * seconds == pytest.approx(10)
    assert rates.totals.unmatched * seconds == pytest.approx(20)
    (mine,) = rates.links.values()
    assert 0 < mine["bytes_received"] <= rates.totals.bytes_received
    for shown in (after.as_dict(), rates.as_dict()):
        assert json.loads(json.dumps(shown))


def test_a_topic_that_came_again_counts_from_zero() -> None:
    """Its counts began anew: no rate is negative."""
    topic = TopicStats(0, "/t", 1, 1, 90, 900, 90, 0, 0, 0, 0, 0, 0)
    totals = BrokerStats(broker="aa", stamp_sec=1.0)
    before = BrokerReport(totals=totals, topics={"/t": topic}, links={})
    later = topic._replace(messages=20, bytes=2000, delivered=20)
    after = BrokerReport(totals=replace(totals, stamp_sec=3.0), topics={"/t": later}, links={})
    rates = after.rates_since(before).topics["/t"]
    assert (rates["messages"], rates["bytes"], rates["delivered"], rates["dropped"]) == (10, 1000, 10, 0)
    with pytest.raises(ValueError, match="earlier snapshot"):
        before.rates_since(after)


async def test_without_a_broker_a_question_gives_up(tmp_path: Path) -> None:
    """BrokerUnreachable when nobody answers in time."""
    async with actors.Node("one", url=f"callboard+unix://{tmp_path}/none") as node:
        with pytest.raises(actors.BrokerUnreachable, match="none"):
            await queries_of(node).report(0.01)
        assert not link_of(node).answers


async def test_a_question_whose_link_breaks_or_that_is_cancelled_ends(meeting: Meeting) -> None:
    """The one raises soon; neither leaves anything behind."""
    node = await meeting.node("one")
    cancelled, broken = [asyncio.create_task(node.get_broker_stats()) for _ in range(2)]
    await asyncio.sleep(0)
    assert link_of(node).answers
    cancelled.cancel()
    channel = link_of(node).channel
    assert channel is not None
    channel.abort()
    async with asyncio.timeout(DEADLINE_SEC):
        with pytest.raises(asyncio.CancelledError):
            await cancelled
        with pytest.raises(actors.BrokerUnreachable):
            await broken
    assert not link_of(node).answers

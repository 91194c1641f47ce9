"""What operators read: metrics, and whether the server and its broker are well."""

from __future__ import annotations

import asyncio
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING

import pytest
from prometheus_client.parser import text_string_to_metric_families

from actors.interfaces.std_msgs.msg import String
from actors.web.metrics import MAX_TOPICS, NEW_LABEL_SEC, NEW_LABELS, OTHER, TopicCounts
from actors.web.options import WebOptions
from proto.wire.stats import TopicStats
from tests.actors.meeting import DEADLINE_SEC, matched
from tests.actors.web.site import Site

if TYPE_CHECKING:
    from tests.actors.meeting import Meeting

Values = dict[tuple[str, str], float]


async def scrape(site: Site) -> Values:
    """Return the values of the metrics by their names and their labels' values."""
    async with site.client.get("/metrics") as response:
        assert response.status == 200
        assert response.headers["Content-Type"].startswith("text/plain; version=")
        text = await response.text()
    return {
        (sample.name, ",".join(sample.labels.values())): sample.value
        for family in text_string_to_metric_families(text)
        for sample in family.samples
    }


async def scrape_until(site: Site, key: tuple[str, str], value: float) -> Values:
    """Scrape until a metric has a value."""
    async with asyncio.timeout(DEADLINE_SEC):
        while (values := await scrape(site)).get(key) != value:
            pass
        return values


async def test_the_metrics_count_what_the_broker_does(site: Site, meeting: Meeting) -> None:
    """Messages by topic, connections, nodes; and the time of a round trip from the first scrape on."""
    talker, listener = await meeting.node("talker"), await meeting.node("listener")
    publisher = talker.create_publisher(String, "chatter", 10)
    heard: list[String] = []
    listener.create_subscription(String, "chatter", heard.append, 10)
    await matched(publisher)
    for _ in range(3):
        publisher.publish(String(data="hello"))
    await scrape_until(site, ("callboard_nodes", ""), 2)
    values = await scrape_until(site, ("callboard_topic_copies_delivered_total", "/chatter"), 3)
    assert values["callboard_up", ""] == 1
    assert values["callboard_connections", ""] == 3
    assert values["callboard_topic_messages_total", "/chatter"] == 3
    assert values["callboard_topic_bytes_total", "/chatter"] > 0
    assert values["callboard_domain_endpoints", "publisher"] == 1
    assert values["callboard_lost_copies_total", "depth"] == 0
    assert values["callboard_topic_messages_total", OTHER] == 0
    await scrape_until(site, ("callboard_round_trip_seconds_count", ""), 1)


async def test_without_a_broker_the_server_lives_and_is_not_ready(site: Site, meeting: Meeting) -> None:
    """The metrics say that the broker is down, and nothing of it."""
    assert await site.json("/readyz") == {"status": "ok"}
    await meeting.stop_broker()
    assert "broker" in (await site.json("/readyz", 503))["error"]
    assert await site.json("/healthz") == {"status": "ok"}
    values = await scrape(site)
    assert values["callboard_up", ""] == 0
    assert ("callboard_connections", "") not in values


async def test_beyond_loopback_metrics_need_the_token_and_health_does_not(meeting: Meeting) -> None:
    """A load balancer has no token; names of topics are nobody's business without one."""
    async with AsyncExitStack() as stack:
        options = WebOptions(host="0.0.0.0", port=0, token="secret")
        site = await Site(stack, meeting, options).open()
        for path in ("/healthz", "/readyz"):
            assert await site.json(path) == {"status": "ok"}
        assert "token" in (await site.json("/metrics", 401))["error"]
        async with site.client.get("/metrics", headers={"Authorization": "Bearer secret"}) as response:
            assert response.status == 200


def topic(name: str, messages: int) -> TopicStats:
    """Return the numbers of a topic."""
    return TopicStats(0, name, 1, 1, messages, 10 * messages, messages, 0, 0, 0, 0, 0, 0)


def by_topic(counts: TopicCounts, metric: str = "callboard_topic_messages") -> dict[str, float]:
    """Return the values of one metric by topic."""
    (family,) = [each for each in counts.metrics() if each.name == metric]
    return {sample.labels["topic"]: sample.value for sample in family.samples}


def take(counts: TopicCounts, **messages: int) -> dict[str, float]:
    """Take these numbers of messages by topic, and return what is shown."""
    counts.update({name: topic(name, number) for name, number in messages.items()}, 0.0)
    return by_topic(counts)


def test_only_the_busiest_topics_have_labels() -> None:
    """The rest is one sum, which never falls: not when topics end, and not when one of them becomes busy."""
    counts = TopicCounts(limit=2)
    assert take(counts, a=100, b=50, c=5, d=3) == {"a": 100, "b": 50, OTHER: 8}
    assert take(counts, a=100, b=50, c=60, d=4) == {"a": 100, "c": 60, OTHER: 9}
    assert take(counts, a=100) == {"a": 100, OTHER: 9}
    assert take(counts, a=100, b=50, d=1) == {"a": 100, "b": 50, OTHER: 10}


def test_a_topic_that_begins_again_counts_from_zero() -> None:
    """Its counts start again with its first endpoint."""
    counts = TopicCounts(limit=1)
    assert take(counts, a=100, b=50)[OTHER] == 50
    assert take(counts, a=100, b=2)[OTHER] == 52


@pytest.mark.parametrize("metric", ["callboard_topic_bytes", "callboard_topic_queued_messages"])
def test_a_thousand_topics_are_a_bounded_number_of_series(metric: str) -> None:
    """Whoever declares topics cannot fill the memory of a Prometheus server."""
    counts = TopicCounts()
    counts.update({f"/t{number}": topic(f"/t{number}", number) for number in range(1000)}, 0.0)
    assert len(by_topic(counts, metric)) == MAX_TOPICS + 1


def test_topics_that_are_new_again_and_again_make_few_series() -> None:
    """Case 79: a hundred new busy topics before each scrape; those that are known keep their labels."""
    counts, labels = TopicCounts(), set[str]()
    ours = {f"/ours{number}": topic(f"/ours{number}", 10) for number in range(20)}
    counts.update(ours, 0.0)
    for scrape in range(50):
        others = [f"/new{scrape}_{number}" for number in range(MAX_TOPICS)]
        counts.update(ours | {name: topic(name, 1000) for name in others}, 15.0 * scrape)
        labels |= by_topic(counts).keys()
        assert scrape < 5 or ours.keys() <= by_topic(counts).keys()
    minutes = 50 * 15 / NEW_LABEL_SEC
    assert len(labels) <= NEW_LABELS + minutes + len(ours) + 1
    assert by_topic(counts)[OTHER] > 40 * MAX_TOPICS * 1000


async def test_probes_may_use_any_name(site: Site) -> None:
    """Orchestrators ask under the address of the day; nothing else answers under it."""
    for path, status in (("/healthz", 200), ("/readyz", 200), ("/metrics", 421), ("/", 421)):
        async with site.client.get(path, headers={"Host": "pod.internal:7412"}) as response:
            assert response.status == status


async def test_who_has_the_token_may_scrape_under_any_name(site: Site) -> None:
    """Prometheus asks under the name that its configuration has."""
    headers = {"Host": "robot.local:7412", "Authorization": f"Bearer {site.server.token}"}
    async with site.client.get("/metrics", headers=headers) as response:
        assert response.status == 200

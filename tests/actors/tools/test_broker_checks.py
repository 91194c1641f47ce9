"""Checks of a broker by its answers: WELCOME, statistics and graph."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from actors.graph.broker_report import BrokerReport
from actors.graph.snapshot import GraphSnapshot
from actors.qos.profile import QoSProfile, ReliabilityPolicy
from actors.tools import broker_checks
from proto.wire.codes import EntryKind
from proto.wire.frames import GraphEntry
from proto.wire.identity import VERSION
from proto.wire.stats import BrokerStats, LinkStats, TopicStats

if TYPE_CHECKING:
    from actors.tools.check import Check

QUICK = LinkStats(0, 1, "x", ("/talker",), 2, False, 0, 0, 0, 0, 0, 0, 0, 0, 0)
FINE = TopicStats(0, "/chatter", 1, 1, 9, 90, 9, 0, 0, 0, 0, 0, 0)


def bad(checks: list[Check]) -> list[tuple[str, str, str]]:
    """Return name, status and finding of what is not ok; each of them has a remedy."""
    assert all(check.remedy for check in checks if check.status in {"warn", "fail"})
    return [check[:3] for check in checks if check.status != "ok"]


def report(
    *, links: tuple[LinkStats, ...] = (), topics: tuple[TopicStats, ...] = (), **totals: float | str
) -> BrokerReport:
    """Make a report."""
    return BrokerReport(
        totals=BrokerStats(**{"broker": "b1", **totals}),  # type: ignore[arg-type]
        topics={each.name: each for each in topics},
        links={each.session: each for each in links},
    )


def snapshot(*entries: tuple[EntryKind, str, str, str, str], **profiles: QoSProfile) -> GraphSnapshot:
    """Make a graph of (kind, node, name, type, hash); a node's endpoints have its profile."""
    made = GraphSnapshot()
    for key, (kind, node, name, type_name, type_hash) in enumerate(entries):
        qos = profiles.get(node, QoSProfile(depth=10)).to_wire()
        made.entries[key] = GraphEntry(key, kind, f"/{node}", name, type_name, type_hash, qos)
    return made


def test_versions_are_compared() -> None:
    """The same is fine; another, or none, is reported."""
    same = {"agent": f"callboard-broker/{VERSION}"}
    assert not bad(broker_checks.greeting(same, 0.0, 0.001))
    for agent in ("callboard-broker/9.9", "callboard-broker", ""):
        ((name, status, _),) = bad(broker_checks.greeting({"agent": agent}, 0.0, 0.001))
        assert (name, status) == ("versions", "warn")


@pytest.mark.parametrize(
    ("ahead", "round_trip", "status"),
    [
        (0.0, 0.001, "ok"),
        (0.3, 0.5, "ok"),  # the way there and back may account for it
        (0.3, 0.1, "warn"),
        (-0.3, 0.1, "warn"),
        (-3600.0, 0.1, "fail"),
        (None, 0.1, "skip"),
    ],
)
def test_clocks_are_compared(ahead: float | None, round_trip: float, status: str) -> None:
    """What the round trip may account for is no skew."""
    agent = {"agent": f"callboard-broker/{VERSION}"}
    _, clock = broker_checks.greeting(agent, ahead, round_trip)
    assert (clock.name, clock.status) == ("clock", status)


def test_a_quiet_broker_is_fine() -> None:
    """Nobody slow, nothing lost."""
    assert not bad(broker_checks.numbers(report(links=(QUICK,), topics=(FINE,))))


def test_a_broker_under_strain_is_reported() -> None:
    """A late loop, and connections turned away, for one of several limits."""
    checks = broker_checks.numbers(report(lag_longest_sec=0.25, refused_connections=3))
    assert "--max-connections-per-address" in checks[1].remedy
    assert bad(checks) == [
        ("load", "warn", "connections: 0; the loop at worst 250 ms late"),
        ("load", "warn", "3 connections turned away: there were too many"),
    ]


def test_limits_that_were_reached_are_reported() -> None:
    """Each counter of a refusal gives a line with the number; none is missing from the statistics."""
    assert bad(broker_checks.numbers(report(stalls=2, tls_failures=1))) == [
        ("limits", "warn", "1 connections failed in TLS"),
        ("limits", "warn", "2 KEEP_ALL subscriptions took nothing and lost messages"),
    ]
    for name in broker_checks.LIMITS:
        totals: dict[str, Any] = {name: 3}
        ((check, _, finding),) = bad(broker_checks.numbers(report(**totals)))
        assert (check, finding[:2]) == ("limits", "3 ")


def test_slow_and_silent_links_are_named() -> None:
    """By their nodes, with how much has been dropped and how much waits."""
    slow = QUICK._replace(dropped=12, queued=5)
    silent = QUICK._replace(session=2, suspended=True, silent_ms=7000, nodes=(), agent="thing/1")
    assert bad(broker_checks.numbers(report(links=(slow, silent)))) == [
        ("links", "warn", "/talker: 12 messages dropped because it was slow, 5 wait"),
        ("links", "warn", "a link without nodes (thing/1) has been silent for 7 s and counts as gone"),
    ]


def test_losses_are_reported_by_topic() -> None:
    """Each kind of loss that there was."""
    lossy = FINE._replace(dropped=1, lost_on_break=2, latched_dropped=3)
    assert bad(broker_checks.numbers(report(topics=(lossy,)))) == [
        (
            "messages",
            "warn",
            "/chatter: 1 dropped for slow readers, 2 lost with broken links, 3 missed by late joiners",
        )
    ]


def test_types_that_do_not_meet_are_wrong() -> None:
    """Two names on a topic, two definitions of a service's type; a raw subscription takes any."""
    graph = snapshot(
        (EntryKind.PUBLISHER, "talker", "/chatter", "std_msgs/msg/String", "a"),
        (EntryKind.SUBSCRIPTION, "listener", "/chatter", "std_msgs/msg/Int32", "b"),
        (EntryKind.SUBSCRIPTION, "recorder", "/chatter", "", ""),
        (EntryKind.SERVICE, "server", "/add", "demo/srv/Add", "a"),
        (EntryKind.CLIENT, "client", "/add", "demo/srv/Add", "b"),
    )
    assert bad(broker_checks.graph(graph)) == [
        (
            "types",
            "fail",
            "topic /chatter has several: std_msgs/msg/Int32 (/listener), std_msgs/msg/String (/talker)",
        ),
        ("types", "fail", "service /add: demo/srv/Add has 2 definitions (/client, /server)"),
    ]


def test_types_that_meet_are_fine() -> None:
    """A topic and a service may have the same name and different types."""
    graph = snapshot(
        (EntryKind.PUBLISHER, "talker", "/x", "std_msgs/msg/String", "a"),
        (EntryKind.SUBSCRIPTION, "recorder", "/x", "", ""),
        (EntryKind.SERVICE, "server", "/x", "demo/srv/Add", "b"),
    )
    assert not bad(broker_checks.graph(graph))


def test_a_strict_pair_that_disagrees_is_a_failure() -> None:
    """Nothing is delivered between the two; a lax subscription beside is only warned of."""
    string = ("/chatter", "std_msgs/msg/String", "a")
    graph = snapshot(
        (EntryKind.PUBLISHER, "talker", *string),
        (EntryKind.SUBSCRIPTION, "listener", *string),
        (EntryKind.SUBSCRIPTION, "lax", *string),
        talker=QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT),
    )
    graph.entries[1] = graph.entries[1]._replace(qos=QoSProfile(depth=10).to_wire(strict=True))
    assert [(each.status, "nothing is delivered" in each.finding) for each in broker_checks.graph(graph)] == [
        ("ok", False),
        ("warn", False),
        ("fail", True),
    ]


def test_profiles_that_disagree_are_reported_once() -> None:
    """However many publishers have the same profile."""
    hasty = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
    string = ("/chatter", "std_msgs/msg/String", "a")
    graph = snapshot(
        (EntryKind.PUBLISHER, "talker", *string),
        (EntryKind.PUBLISHER, "second", *string),
        (EntryKind.SUBSCRIPTION, "listener", *string),
        talker=hasty,
        second=hasty,
    )
    ((name, status, finding),) = bad(broker_checks.graph(graph))
    assert (name, status) == ("qos", "warn")
    assert finding == "/chatter, from /talker to /listener: Best effort publisher and reliable subscription"

"""Overviews from samples."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest

from actors.cli.commands.top.columns import NODES
from actors.graph.snapshot import GraphSnapshot
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String
from actors.tools.overview import Overview, Sample, Samples
from proto.wire.codes import EntryKind
from tests.actors.meeting import matched, until
from tests.actors.tools.made_up import STRING, entry, link, sample, snapshot, topic

if TYPE_CHECKING:
    from tests.actors.meeting import Meeting

NODE, PUBLISHER, SUBSCRIPTION, SERVICE, CLIENT = EntryKind
PAIR = snapshot(
    entry(NODE, "/talker"),
    entry(PUBLISHER, "/talker", "/chatter"),
    entry(NODE, "/listener"),
    entry(SUBSCRIPTION, "/listener", "/chatter"),
    entry(SUBSCRIPTION, "/listener", "/quiet"),
)


def at_second(second: int) -> Sample:
    """Return a sample of a pair of nodes that sends 10 messages of 5 bytes a second."""
    return sample(
        float(second),
        PAIR,
        topics=(
            topic("/chatter", messages=10 * second, bytes=50 * second, dropped=2 * second, queued=3),
            topic("/quiet", messages=7, lost_on_break=1, dropped=4),
        ),
        links=(
            link(1, "/talker", bytes_received=100 * second, bytes_sent=second, pending_calls=2),
            link(2, "/listener", bytes_sent=200 * second, queued=3, dropped=2 * second, owed_calls=5),
        ),
        routed=10 * second,
        delivered=20 * second,
        dropped=2 * second,
        lag_longest_sec=0.25,
    )


def names(seen: Overview) -> list[list[str]]:
    """Return the names of topics, nodes and services."""
    return [[row.name for row in rows] for rows in (seen.topics, seen.nodes, seen.services)]


def test_one_sample_has_no_rates() -> None:
    """But it has everything else."""
    seen = Samples().add(at_second(4))
    assert (seen.interval_sec, seen.totals.routed_per_sec, seen.topics[0].messages_per_sec) == (
        0.0,
        None,
        None,
    )
    assert (seen.nodes[0].sent_bytes_per_sec, seen.nodes[0].queued) == (None, 3)
    assert (seen.topics[0].queued, seen.topics[0].dropped, seen.totals.longest_lag_sec) == (3, 8, 0.25)


def test_two_samples_give_rates() -> None:
    """Per second of the broker's clock, however long the time between the samples."""
    samples = Samples()
    samples.add(at_second(1))
    seen = samples.add(at_second(3))
    assert seen.interval_sec == 2.0
    assert (seen.totals.routed_per_sec, seen.totals.delivered_per_sec, seen.totals.drops_per_sec) == (
        10,
        20,
        2,
    )
    chatter, quiet = seen.topics
    assert (chatter.name, chatter.types) == ("/chatter", (STRING,))
    assert (chatter.publishers, chatter.subscriptions) == (1, 1)
    assert (chatter.messages_per_sec, chatter.bytes_per_sec, chatter.drops_per_sec) == (10, 50, 2)
    assert (quiet.messages_per_sec, quiet.publishers, quiet.lost) == (0, 0, 5)
    listener, talker = seen.nodes
    assert (talker.sent_bytes_per_sec, talker.received_bytes_per_sec, talker.pending_calls) == (100, 1, 2)
    assert (listener.received_bytes_per_sec, listener.drops_per_sec, listener.owed_calls) == (200, 2, 5)
    assert (listener.endpoints, talker.endpoints, talker.state) == (2, 1, "linked")


def test_rates_are_those_of_the_last_few_samples() -> None:
    """What was before the window is forgotten."""
    samples = Samples(window=2)
    for second in (0, 50, 51):
        samples.add(at_second(second))
    assert samples.add(at_second(52)).interval_sec == 2.0


def test_samples_that_come_too_soon_do_not_decide_the_rates() -> None:
    """Two readers of the same samples, the second one right behind the first."""
    samples = Samples(window=2, least_sec=0.5)
    for second in range(1, 5):
        seen = samples.add(at_second(second))
        assert seen.interval_sec == min(second - 1, 2)
        rest = topic("/chatter", messages=10 * second + 5, bytes=50 * second, dropped=2 * second)
        close = samples.add(sample(second + 0.01, PAIR, topics=(rest,)))
        assert close.topics[0].messages_per_sec == (None if second == 1 else pytest.approx(14.9, abs=0.1))


def test_a_broker_that_began_anew_has_no_rates() -> None:
    """Nor one whose clock stands still."""
    samples = Samples()
    samples.add(at_second(5))
    again = samples.add(sample(9.0, PAIR, broker="b2"))
    assert (again.interval_sec, again.totals.broker) == (0.0, "b2")
    assert samples.add(sample(9.0, PAIR, broker="b2")).interval_sec == 0.0
    assert samples.add(sample(10.0, PAIR, broker="b2")).interval_sec == 1.0


def test_graph_and_numbers_may_differ() -> None:
    """A topic and a node that the numbers do not know yet have none; those that have left are left out."""
    samples = Samples()
    samples.add(sample(1.0, PAIR))
    seen = samples.add(sample(2.0, PAIR, topics=(topic("/gone"),), links=(link(7, "/gone"),)))
    assert names(seen) == [["/chatter", "/quiet"], ["/listener", "/talker"], []]
    assert (seen.topics[0].messages_per_sec, seen.nodes[0].sent_bytes_per_sec) == (None, None)


def test_a_suspended_node_is_shown() -> None:
    """Its link names it, though it is not in the graph."""
    silent = link(3, "/frozen", suspended=True, silent_ms=4000, endpoints=4)
    seen = Samples().add(sample(1.0, PAIR, links=(silent,)))
    frozen = seen.nodes[0]
    assert (frozen.name, frozen.state, frozen.silent_ms, frozen.endpoints) == (
        "/frozen",
        "suspended",
        4000,
        3,
    )


def test_nodes_that_share_a_name_have_a_row_each() -> None:
    """With the numbers and the state of its own link; their services owe what all of them owe."""
    graph = snapshot(
        *(entry(NODE, "/same") for _ in range(2)),
        *(entry(SERVICE, "/same", "/add", "example_interfaces/srv/AddTwoInts") for _ in range(2)),
        entry(PUBLISHER, "/same", "/news"),
    )
    links = (
        link(4, "/same", endpoints=3, queued=1, owed_calls=1),
        link(7, "/same", endpoints=2, queued=2, owed_calls=2),
        link(9, "/same", "/other", endpoints=5, suspended=True),
    )
    seen = Samples().add(sample(1.0, graph, links=links))
    rows = [(row.name, row.link, row.shared, row.state, row.endpoints, row.queued) for row in seen.nodes]
    assert rows == [
        ("/other", 9, False, "suspended", 3, 0),
        ("/same", 4, True, "linked", 2, 1),
        ("/same", 7, True, "linked", 1, 2),
        ("/same", 9, True, "suspended", 3, 0),
    ]
    assert seen.services[0].owed_calls == 3
    assert [NODES[0].text(row) for row in seen.nodes][:2] == ["/other", "/same (link 4)"]


def test_services_owe_what_their_nodes_owe() -> None:
    """Each server's link once, however many services it has under the name."""
    graph = snapshot(
        *(entry(SERVICE, node, "/add", "example_interfaces/srv/AddTwoInts") for node in ("/a", "/a", "/b")),
        entry(CLIENT, "/c", "/add", "std_srvs/srv/Empty"),
        entry(CLIENT, "/c", "/nowhere", "std_srvs/srv/Empty"),
    )
    owing = (link(1, "/a", owed_calls=3), link(2, "/b", owed_calls=4), link(3, "/c", owed_calls=9))
    add, nowhere = Samples().add(sample(1.0, graph, links=owing)).services
    assert (add.name, add.servers, add.clients, add.owed_calls) == ("/add", 3, 1, 7)
    assert add.types == ("example_interfaces/srv/AddTwoInts", "std_srvs/srv/Empty")
    assert (nowhere.name, nowhere.servers, nowhere.clients, nowhere.owed_calls) == ("/nowhere", 0, 1, 0)


def test_hidden_names_can_be_left_out() -> None:
    """Topics, nodes and services with a token that starts with an underscore."""
    graph = snapshot(
        *(entry(NODE, name) for name in ("/_tool", "/node")),
        *(entry(PUBLISHER, "/node", name) for name in ("/a/_feedback", "/topic")),
        *(entry(SERVICE, "/node", name) for name in ("/_get", "/service")),
    )
    seen = Samples().add(sample(1.0, graph))
    assert names(seen) == [["/a/_feedback", "/topic"], ["/_tool", "/node"], ["/_get", "/service"]]
    assert names(seen.without_hidden()) == [["/topic"], ["/node"], ["/service"]]


def test_what_the_broker_does_not_report_is_unknown() -> None:
    """Such as to a user who may not administer it: 0 dropped messages would be wrong."""
    made = (
        entry(NODE, "/talker"),
        entry(PUBLISHER, "/talker", "/chatter"),
        entry(SERVICE, "/talker", "/add"),
    )
    graph = snapshot(*made)
    seen = Samples().add(sample(1.0, graph, broker=""))
    (chatter,), (talker,), (add,) = seen.topics, seen.nodes, seen.services
    assert (chatter.publishers, chatter.queued, chatter.dropped, chatter.lost) == (1, None, None, None)
    assert (talker.endpoints, talker.queued, talker.queued_bytes, talker.owed_calls) == (2, None, None, None)
    assert (add.servers, add.owed_calls) == (1, None)


def test_what_passes_in_shared_memory_counts() -> None:
    """A camera that sends by reference does not look idle; its topic says how it sends."""
    samples = Samples()
    for second in range(3):
        camera = link(1, "/talker", bytes_received=10 * second, shared_bytes_received=5000 * second)
        viewer = link(2, "/listener", bytes_sent=20 * second, shared_bytes_sent=5000 * second)
        images = topic("/chatter", messages=3 * second, by_reference=2 * second)
        seen = samples.add(sample(float(second), PAIR, topics=(images,), links=(camera, viewer)))
    by_name = {row.name: row for row in seen.nodes}
    assert by_name["/talker"].sent_bytes_per_sec == 5010.0
    assert by_name["/listener"].received_bytes_per_sec == 5020.0
    assert (seen.topics[0].messages_per_sec, seen.topics[0].shared_per_sec) == (3.0, 2.0)


def test_withheld_totals_do_not_take_the_rates_of_topics_away() -> None:
    """A user who may administer some topics has their rates; what the broker withholds is None, not 0."""
    samples = Samples()
    topics = [topic("/chatter", messages=10 * second) for second in range(3)]
    for second in range(3):
        seen = samples.add(sample(float(second), PAIR, topics=(topics[second],), broker=""))
    assert seen.topics[0].messages_per_sec == 10.0
    assert seen.totals.withheld
    assert seen.totals.routed_per_sec is None
    assert {*seen.as_dict()["totals"].values()} == {"", None}


def test_an_overview_is_json() -> None:
    """Everything in it is plain."""
    samples = Samples()
    samples.add(at_second(1))
    document = json.loads(json.dumps(samples.add(at_second(2)).as_dict()))
    assert set(document) == {"interval_sec", "seconds", "totals", "topics", "nodes", "services"}
    assert document["topics"][0]["messages_per_sec"] == 10.0


def test_nobody_there() -> None:
    """An empty graph."""
    assert names(Samples().add(sample(1.0, GraphSnapshot()))) == [[], [], []]


async def test_a_real_broker_is_seen_as_it_is(meeting: Meeting) -> None:
    """The rates are those of the messages published between two samples."""
    talker, listener = await meeting.node("talker"), await meeting.node("listener")
    received: list[String] = []
    listener.create_subscription(String, "chatter", received.append, 100)
    listener.create_service(AddTwoInts, "add", lambda request, response: response)
    publisher = talker.create_publisher(String, "chatter", 100)
    await matched(publisher)
    samples = Samples()
    samples.add(Sample(await talker.get_graph(), await talker.get_broker_stats()))
    for _ in range(50):
        publisher.publish(String(data="hello"))
    await until(lambda: len(received) == 50)
    await meeting.settled(talker, listener)
    seen = samples.add(Sample(await talker.get_graph(), await talker.get_broker_stats()))
    assert names(seen) == [["/chatter"], ["/listener", "/talker"], ["/add"]]
    rate, routed = seen.topics[0].messages_per_sec, seen.totals.routed_per_sec
    assert rate is not None
    assert routed is not None
    assert (round(rate * seen.interval_sec), round(routed * seen.interval_sec)) == (50, 50)

"""Nodes that are kept apart: their endpoints match all others, and never each other's."""

from __future__ import annotations

import random

import pytest

from broker.routing.pool import Pool
from broker.routing.records import NodeRecord, Peer, ServiceRecord
from broker.routing.router import Router
from broker.routing.router_limits import RouterLimits
from proto import limits
from proto.errors import ErrorCode
from proto.wire import frames
from proto.wire.codec import encode
from proto.wire.codes import EntryKind, Status
from tests.broker import frame_makers as make
from tests.broker.switch import Switch


def join(switch: Switch, name: str, apart: str = "net", labels: frames.Options | None = None) -> int:
    """Connect a peer with one node."""
    peer = switch.join()
    switch.send(peer, frames.Node(0, name, labels=labels or {}, apart=apart))
    assert switch.read(peer, frames.Accepted) == [frames.Accepted(0, 0)]
    return peer


def peers_of(switch: Switch, peer: int, endpoint: int) -> int:
    """Return how many counterparts a peer has last been told of."""
    counts = [frame.peers for frame in switch.read(peer, frames.Matched) if frame.id == endpoint]
    return counts[-1] if counts else 0


@pytest.mark.parametrize("one_link", [True, False])
def test_publishers_and_subscriptions_of_such_nodes_exchange_nothing(one_link: bool) -> None:
    """Neither on one link nor on two: no match, message, latched message or notice. Others get everything."""
    switch = Switch()
    talker = join(switch, "/talker")
    listener = talker if one_link else join(switch, "/other")
    if one_link:
        switch.send(listener, frames.Node(10, "/listener", apart="net"))
    node = 10 if one_link else 0
    outsider = switch.join("/outsider")
    number = switch.publisher(talker, make.publisher(1, qos={"durability": 1, "reliability": 2}))
    switch.send(listener, make.subscription(11, node=node, qos={"durability": 1, "strict": True}))
    switch.send(listener, make.publisher(12, "/u", node=node, type_hash="RIHS01_bb"))
    switch.send(talker, make.subscription(13, "/u"))
    switch.send(outsider, make.subscription(2, qos={"durability": 1, "reliability": 2}))
    switch.send(talker, make.batch(number, 0))
    told = [*switch.read_all(listener), *([] if one_link else switch.read_all(talker))]
    assert [each for each in told if isinstance(each, frames.Matched)] == [frames.Matched(1, 1, 1)]
    unwanted = frames.Attached | frames.Notice | frames.Batch | frames.Replay
    assert not any(isinstance(each, unwanted) for each in told)
    assert len(switch.read(outsider, frames.Batch)) == 1


def test_a_node_that_is_kept_apart_does_not_match_itself() -> None:
    """It stands for a node elsewhere, which has had its own message already."""
    switch = Switch()
    peer = join(switch, "/both")
    switch.send(peer, make.publisher(1), make.subscription(2), make.service(3), make.client(4))
    assert switch.read(peer, frames.Matched) == []


def test_nodes_of_two_networks_and_ordinary_nodes_match() -> None:
    """Only the same text keeps apart."""
    switch = Switch()
    one, other, plain = join(switch, "/a", "one"), join(switch, "/b", "other"), switch.join("/plain")
    switch.send(one, make.publisher(1))
    switch.send(other, make.subscription(1))
    switch.send(plain, make.publisher(1), make.subscription(2))
    assert peers_of(switch, one, 1) == 2
    assert peers_of(switch, other, 1) == 2


def test_pairs_that_do_not_match_do_not_count_for_the_limit_of_matches() -> None:
    """A link with many such nodes is not refused for pairs that do not exist."""
    switch = Switch(Router(limits=RouterLimits(max_matches=3)))
    peer = join(switch, "/a")
    for number in range(5):
        switch.send(peer, make.publisher(10 + number), make.subscription(20 + number))
        switch.send(peer, make.client(30 + number), make.service(40 + number))
    assert switch.read(peer, frames.Refused) == []


def test_a_call_is_never_given_to_a_server_that_is_kept_apart() -> None:
    """The idle server of the client's own network waits, however busy the other one is."""
    switch = Switch()
    asker, apart, plain = join(switch, "/asker"), join(switch, "/apart"), switch.join("/plain")
    switch.send(asker, make.client(1))
    switch.send(apart, make.service(1))
    switch.send(asker, make.request(1, 0))
    (reply,) = switch.read(asker, frames.Reply)
    assert reply.entries[0].status == Status.UNAVAILABLE
    assert peers_of(switch, asker, 1) == 0
    switch.send(plain, make.service(1))
    assert peers_of(switch, asker, 1) == 1
    switch.send(asker, make.request(1, 1), make.request(1, 2))
    assert switch.read(apart, frames.Request) == []
    assert [len(frame.entries) for frame in switch.read(plain, frames.Request)] == [1, 1]
    outsider = switch.join("/outsider")
    switch.send(outsider, make.client(1))
    switch.send(outsider, make.request(1, 0))
    assert len(switch.read(apart, frames.Request)) == 1
    switch.leave(plain)
    switch.send(asker, make.request(1, 3))
    assert switch.read(apart, frames.Request) == []


def server(number: int, apart: str) -> ServiceRecord:
    """Make a server that owes nothing."""
    peer = Peer(1)
    node = NodeRecord(key=0, id=0, peer=peer, kind=EntryKind.NODE, node=None, name="/n", kept_apart=apart)
    return ServiceRecord(key=number, id=number, peer=peer, kind=EntryKind.SERVICE, node=node, name="/add")


def test_the_least_busy_server_is_found_among_those_that_are_allowed() -> None:
    """For every mixture of servers, whatever came and went since the pool was first asked."""
    draw = random.Random(7)
    for _ in range(300):
        pool = Pool[ServiceRecord]()
        servers: list[ServiceRecord] = []
        for step in range(draw.randint(1, 30)):
            action = draw.choice(["add", "add", "remove", "call", "call", "answer"])
            if action == "add":
                servers.append(server(step, draw.choice(["", "a", "b"])))
                pool.add(servers[-1])
            elif servers and action == "remove":
                pool.remove(servers.pop(draw.randrange(len(servers))))
            elif servers and action in {"call", "answer"}:
                each = draw.choice(servers)
                if action == "call":
                    each.pending[len(each.pending)] = None  # type: ignore[assignment]
                elif each.pending:
                    each.pending.popitem()
                pool.update(each)
            apart = draw.choice(["", "a", "b", "c"])
            allowed = [each for each in servers if not apart or each.apart != apart]
            found = pool.without(apart).least_busy()
            assert (found is None) == (not allowed)
            if found is not None:
                assert found in allowed
                assert len(found.pending) == min(len(each.pending) for each in allowed)


def test_labels_are_in_the_graph_and_endpoints_name_their_node() -> None:
    """Two nodes share a name, and one has labels: a watcher knows whose each endpoint is."""
    switch = Switch()
    peer = switch.join()
    switch.send(peer, frames.Node(0, "/same", shared=True))
    switch.send(peer, frames.Node(1, "/same", shared=True, labels={"origin": "ros2/7"}))
    switch.send(peer, make.publisher(2, qos={"depth": 3}), make.publisher(3, node=1, qos={"depth": 4}))
    switch.send(peer, frames.Watch(9, keep=False))
    (graph,) = switch.read(peer, frames.Graph)
    plain, labelled, one, other = sorted(graph.added)
    assert plain.qos == {"shared": True}
    assert labelled.qos == {"shared": True, "label.origin": "ros2/7"}
    assert "node" not in one.qos
    assert (other.qos["node"], other.qos["depth"]) == (labelled.key, 4)


def test_graph_frames_stay_small_however_many_labels_there_are() -> None:
    """Of 250 nodes with names and labels that are as long as they may be."""
    switch = Switch()
    labels: frames.Options = {f"{number:064}": "x" * 32 for number in range(10)}
    peer = switch.join()
    for number in range(250):
        name = "/" + "n" * 240 + "/" + f"{number}".rjust(255, "m")
        switch.send(peer, frames.Node(number, name, labels=labels, apart="x" * 256))
    assert switch.read(peer, frames.Refused) == []
    switch.send(peer, frames.Watch(1000, keep=False))
    graphs = switch.read(peer, frames.Graph)
    assert sum(len(graph.added) for graph in graphs) == 250
    assert max(len(encode(graph)) for graph in graphs) < limits.MAX_FRAME_BYTES


@pytest.mark.parametrize(
    ("node", "reason"),
    [
        (frames.Node(0, "/a", labels={"a b": "c"}), "a label's name is 1 to 64 letters"),
        (frames.Node(0, "/a", labels={"a": 7}), "the value of the label 'a' is printable text"),
        (frames.Node(0, "/a", apart="\n"), "apart is printable text of at most 256 bytes"),
    ],
)
def test_other_labels_are_refused(node: frames.Node, reason: str) -> None:
    """With a text; the name stays free, and the link goes on."""
    switch = Switch()
    peer = switch.join()
    switch.send(peer, node)
    (refused,) = switch.read(peer, frames.Refused)
    assert refused.code == ErrorCode.MALFORMED
    assert reason in refused.text
    switch.send(peer, frames.Node(0, "/a"))
    assert switch.read(peer, frames.Accepted) == [frames.Accepted(0, 0)]

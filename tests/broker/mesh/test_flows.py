"""Flow control, latched messages, sums and sessions over two and three brokers."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING

import pytest

from broker.mesh.messages import Publish
from proto.wire import frames
from proto.wire.codes import NoticeKind
from tests.broker import frame_makers as make
from tests.broker.mesh.attack import THERE, Attack
from tests.broker.mesh.network import Network
from tests.fuzz.router import check_tables
from tests.seams.brokers import endpoint_keys, latched_bytes
from tests.seams.structure import of_router

if TYPE_CHECKING:
    from tests.broker.mesh.network import MeshBroker


def _numbers(broker: MeshBroker, peer: int) -> list[int]:
    got = [each for each in broker.read_all(peer) if isinstance(each, (frames.Batch, frames.Replay))]
    return [
        number for each in got for number in range(each.first_sequence, each.first_sequence + each.length)
    ]


def test_a_remote_reader_that_takes_nothing_stops_holding_back() -> None:
    """Its publisher and its other readers go on, both sides are told, and it may begin again."""
    network = Network(3)
    a, b, c = network
    talker, stalled, other = a.join("/talker"), b.join("/stalled"), c.join("/other")
    publisher = a.publisher(talker, make.publisher(1, qos=make.KEEP_ALL))
    b.send(stalled, make.subscription(1, qos=make.KEEP_ALL, window=2))
    c.send(other, make.subscription(1, qos=make.KEEP_ALL, window=100))
    network.settle()
    a.send(talker, frames.Credit(publisher, 2, 2**30), make.batch(publisher, 0, 2))
    network.settle()
    assert _numbers(b, stalled) == _numbers(c, other) == [0, 1]
    a.read_all(talker)
    for broker in network:
        broker.check_stalls(0, 61)
    network.settle()
    told = a.read_all(talker)
    assert [each.kind for each in told if isinstance(each, frames.Notice)] == [NoticeKind.STALLED]
    assert [each.sequence_limit for each in told if isinstance(each, frames.Credit)] == [100]
    (notice,) = b.read(stalled, frames.Notice)
    assert notice.kind == NoticeKind.STALLED
    a.send(talker, make.batch(publisher, 2, 3))
    network.settle()
    assert (_numbers(b, stalled), _numbers(c, other)) == ([], [2, 3, 4])
    b.send(stalled, frames.Grant(1, publisher, 4, 2**30))
    network.settle()
    a.send(talker, make.batch(publisher, 5))
    network.settle()
    assert _numbers(b, stalled) == _numbers(c, other) == [5]


def test_a_broker_that_stops_holds_its_publishers_for_remote_readers_too() -> None:
    """And publishers of other brokers lose nothing by it."""
    network = Network()
    a, b = network
    talker, listener = a.join("/talker"), b.join("/listener")
    for broker, peer, topic, back in ((a, talker, "/one", "/two"), (b, listener, "/two", "/one")):
        broker.send(peer, make.publisher(1, topic), make.subscription(2, back, qos=make.KEEP_ALL))
    network.settle()
    a.read_all(talker)
    a.hold()
    network.settle()
    assert [each.sequence_limit for each in a.read(talker, frames.Credit)] == [0]
    b.send(listener, make.batch(2 << 32 | 2, 0))
    network.settle()
    assert _numbers(a, talker) == [0]


def test_latched_messages_of_another_broker_expire_there_too() -> None:
    """A late joiner does not get what is older than the lifespan, whichever broker it asks."""
    network = Network()
    a, b = network
    talker, first = a.join("/talker"), b.join("/first")
    qos = {**make.LATCHED, "depth": 5, "lifespan_ns": 1_000_000_000}
    publisher = a.publisher(talker, make.publisher(1, qos=qos))
    b.send(first, make.subscription(1, qos=make.LATCHED))
    network.settle()
    a.send(talker, make.batch(publisher, 0, 3))
    network.settle()
    late = [b.join("/late"), b.join("/later")]
    b.send(late[0], make.subscription(1, qos=make.LATCHED))
    network.settle()
    assert _numbers(b, late[0]) == [0, 1, 2]
    for broker in network:
        for now in (1.0, 3.0):
            broker.router.routes.latched_expiry.check(now)
    b.send(late[1], make.subscription(1, qos=make.LATCHED))
    network.settle()
    assert _numbers(b, late[1]) == []


def test_nobody_gets_latched_messages_of_a_node_that_has_left() -> None:
    """The copies at another broker go with it."""
    network = Network()
    a, b = network
    talker, first = a.join("/talker"), b.join("/first")
    publisher = a.publisher(talker, make.publisher(1, qos=make.LATCHED))
    b.send(first, make.subscription(1, qos=make.LATCHED))
    network.settle()
    a.send(talker, make.batch(publisher, 0))
    network.settle()
    a.leave(talker)
    network.settle()
    late = b.join("/late")
    b.send(late, make.subscription(1, qos=make.LATCHED))
    network.settle()
    assert _numbers(b, late) == []
    assert [latched_bytes(each.router) for each in network] == [0, 0]


def test_a_node_that_connects_again_goes_on_at_other_brokers() -> None:
    """Its new session takes the place of the old one; each message arrives once, in order."""
    network = Network()
    a, b = network
    listener = b.join("/listener")
    b.send(listener, make.subscription(1))
    talker = a.join("/talker", instance=bytes(16))
    publisher = a.publisher(talker, make.publisher(1))
    network.settle()
    a.send(talker, make.batch(publisher, 0, 3))
    again = a.join("/talker", instance=bytes(16))
    publisher = a.publisher(again, make.publisher(1, next_sequence=2))
    a.send(again, make.batch(publisher, 2, 3))
    network.settle()
    assert _numbers(b, listener) == [0, 1, 2, 2, 3, 4]  # as at one broker: the node drops the second 2
    assert b.mesh.rejected == 0
    assert len([key for key in endpoint_keys(b.router) if key >> 32 == 1]) == 2


def test_the_deadline_of_a_call_reaches_the_server() -> None:
    """With all else that a request has."""
    network = Network()
    a, b = network
    caller, server = a.join("/caller"), b.join("/server")
    a.send(caller, make.client(1))
    b.send(server, make.service(7))
    network.settle()
    a.send(caller, frames.Request(1, (frames.RequestEntry(5, 1234, {"x": 1}, b"q"),)))
    network.settle()
    (request,) = b.read(server, frames.Request)
    assert request.entries[0][1:] == (1234, {"x": 1}, b"q")


@pytest.mark.parametrize("seed", range(20))
def test_every_published_message_is_accounted_for(seed: int) -> None:
    """Published = taken by the reader + dropped by either broker + lost on the way, for each reader."""
    chance = random.Random(seed)
    network = Network(3)
    a, b, c = network
    talker = a.join("/talker")
    publisher = a.publisher(talker, make.publisher(1, qos={"depth": 3}))
    readers = [(b, b.join("/b")), (c, c.join("/c"))]
    for broker, peer in readers:
        broker.send(peer, make.subscription(1, qos={"depth": chance.choice((1, 2, 100))}))
    network.settle()
    published = lost = 0
    read = dict.fromkeys(readers, 0)
    for _ in range(60):
        count = chance.randrange(1, 4)
        a.send(talker, make.batch(publisher, published, count))
        published += count
        action = chance.randrange(4)
        if action == 0:
            a.congest(a.mesh.peer)
        elif action == 1:
            network.lose = (Publish,) if chance.randrange(4) == 0 else ()
            waiting = a.router.routes.tallies()[0].queued
            network.settle()
            lost += waiting if network.lose else 0
        elif action == 2:
            broker, peer = chance.choice(readers)
            broker.congest(peer)
        else:
            broker, peer = chance.choice(readers)
            read[broker, peer] += len(_numbers(broker, peer))
        for broker in network:
            check_tables(broker)
    network.lose = ()
    network.settle()
    dropped = a.router.routes.tallies()[0].dropped
    for broker, peer in readers:
        taken = read[broker, peer] + len(_numbers(broker, peer))
        tally, _ = broker.router.routes.tallies()
        assert taken == tally.delivered
        assert published == taken + tally.dropped + dropped + lost
        assert broker.mesh.counts()["ignored"] == 0


def test_a_keep_all_reader_gets_all_from_where_its_publisher_has_attached_it() -> None:
    """Until then the other broker may leave messages out, for a KEEP_LAST reader that was there before."""
    attack = Attack()
    broker, node = attack.broker, attack.node
    broker.send(node, make.subscription(30, "/all"))
    attack.change(make.publisher(7, "/all", node=1, qos=make.KEEP_ALL))
    attack.direct(attack.attached(7, attack.number_of(30)))
    attack.mesh.receive(THERE, make.batch(THERE << 32 | 7, 0, 2), "/all")
    broker.read_all(node)
    broker.send(node, make.subscription(31, "/all", qos=make.KEEP_ALL))
    attack.mesh.receive(THERE, make.batch(THERE << 32 | 7, 4), "/all")
    assert broker.read(node, frames.Attached) == []
    attached = attack.attached(7, attack.number_of(31))._replace(first_sequence=8)
    attack.direct(attached, 8)
    (told,) = broker.read(node, frames.Attached)
    assert (told.subscriptions, told.first_sequence) == ((31,), 8)
    attack.mesh.receive(THERE, make.batch(THERE << 32 | 7, 8, 3), "/all")
    assert [each.first_sequence for each in broker.read(node, frames.Batch)] == [8]
    broker.send(node, frames.Undeclare(30), frames.Undeclare(31))
    assert list(of_router(broker.router)) == []


def test_a_reader_that_joins_while_a_publisher_sends_again_leaves_nothing_out() -> None:
    """Messages before the first live one come as any, and nobody else would get them."""
    attack = Attack()
    broker, node = attack.broker, attack.node
    broker.send(node, make.subscription(30, "/all", qos=make.KEEP_ALL))
    attack.change(make.publisher(7, "/all", node=1, qos=make.KEEP_ALL, next_sequence=4, live_sequence=8))
    attack.direct(attack.attached(7, attack.number_of(30))._replace(first_sequence=8), 4)
    broker.send(node, make.subscription(31, "/all", qos=make.KEEP_ALL))
    attack.direct(attack.attached(7, attack.number_of(31))._replace(first_sequence=8), 4)
    broker.read_all(node)
    attack.mesh.receive(THERE, make.batch(THERE << 32 | 7, 4, 4), "/all")
    assert [each.first_sequence for each in broker.read(node, frames.Batch)] == [4]

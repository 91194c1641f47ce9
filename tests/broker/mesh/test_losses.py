"""Messages between brokers get lost while both stay alive: a heartbeat later all is as if they had come."""

from __future__ import annotations

import pytest

from broker.mesh.held_publishers import has_lost
from broker.mesh.messages import Change, Direct, Heartbeat, Held, Publish
from proto.wire import frames
from tests.broker import frame_makers as make
from tests.broker.mesh.network import MeshBroker, Network


@pytest.mark.parametrize("lost", [Change, frames.Attached], ids=["change", "attached"])
def test_a_subscription_whose_announcement_was_lost_gets_messages(lost: type[Change]) -> None:
    """A broker that has missed a change asks for the others; one that has missed ATTACHED begins anew."""
    network = Network()
    a, b = network
    talker, listener = a.join("/talker"), b.join("/listener")
    publisher = a.publisher(talker, make.publisher(1))
    network.settle()
    network.lose = (lost,)
    b.send(listener, make.subscription(1))
    network.settle()
    assert network.lost
    network.lose = ()
    network.beat()
    a.send(talker, make.batch(publisher, 0))
    network.settle()
    assert len(b.read(listener, frames.Batch)) == 1


def test_a_lost_grant_does_not_stop_a_keep_all_publisher() -> None:
    """Both brokers begin anew, and the reader grants again."""
    network = Network()
    a, b = network
    talker, listener = a.join("/talker"), b.join("/listener")
    publisher = a.publisher(talker, make.publisher(1, qos=make.KEEP_ALL))
    b.send(listener, make.subscription(1, qos=make.KEEP_ALL, window=10))
    network.settle()
    a.send(talker, make.batch(publisher, 0, 10))
    network.settle()
    network.lose = (frames.Grant,)
    b.send(listener, frames.Grant(1, publisher, 20, 1000))
    network.settle()
    assert network.lost
    network.lose = ()
    network.beat()
    assert a.read(talker, frames.Credit)[-1].sequence_limit == 20


def test_calls_whose_reply_was_lost_fail() -> None:
    """They end with the next heartbeat, not at their deadline."""
    network = Network()
    a, b = network
    caller, server = a.join("/caller"), b.join("/server")
    a.send(caller, make.client(1))
    b.send(server, make.service(7))
    network.settle()
    a.send(caller, make.request(1, 5))
    network.settle()
    (request,) = b.read(server, frames.Request)
    network.lose = (frames.Reply,)
    b.send(server, make.reply(7, request.entries[0].call))
    network.settle()
    network.lose = ()
    network.beat()
    (reply,) = a.read(caller, frames.Reply)
    assert reply.entries[0].status != 0


def test_brokers_that_begin_anew_at_the_same_time_agree() -> None:
    """Each has lost a direct message of the other."""
    network = Network()
    a, b = network
    talker, listener = a.join("/talker"), b.join("/listener")
    a.send(talker, make.publisher(1, topic="/one"), make.subscription(2, topic="/two"))
    b.send(listener, make.publisher(1, topic="/two"), make.subscription(2, topic="/one"))
    network.lose = (Direct,)
    network.settle()
    assert network.lost == 2
    network.lose = ()
    for broker in network:
        broker.mesh.send_heartbeat()
    network.settle()
    resets = [broker.mesh.resets for broker in network]
    assert all(resets)
    network.beat()
    assert [broker.mesh.resets for broker in network] == resets
    assert len(a.read(talker, frames.Attached)) == len(b.read(listener, frames.Attached)) == 1


def test_nothing_is_begun_anew_while_nothing_is_lost() -> None:
    """Also when a broker joins others that were restarted before."""
    network = Network(3)
    a, b, c = network
    network.partition(3)
    network.heal(3)
    for broker in network:
        node = broker.join(f"/node{broker.number}")
        broker.send(node, make.publisher(1), make.subscription(2))
    network.settle()
    network.beat()
    assert [a.mesh.resets, b.mesh.resets, c.mesh.resets] == [0, 0, 0]


def test_heartbeats_of_brokers_that_are_gone_are_ignored() -> None:
    """A broker that is not alive has no exchange."""
    network = Network()
    a, _ = network
    network.partition(2)
    a.mesh.accept_heartbeat(2, Heartbeat(9, {1: (9, 9)}))
    assert a.mesh.pop_messages() == []
    assert a.mesh.ignored == 1


def test_what_is_lost_before_a_snapshot_is_noticed_with_it() -> None:
    """A direct message that waits for the snapshot shows that an earlier one is missing: both begin anew."""
    network = Network()
    a, b = network
    a.mesh.accept_heartbeat(2, Heartbeat(9, {}))
    a.mesh.receive(2, Direct(1, 1, 5, 0, frames.Grant(1, 1, 1, 1)))
    network.settle()
    assert (a.mesh.resets, b.mesh.resets) == (1, 1)
    talker, listener = a.join("/talker"), b.join("/listener")
    publisher = a.publisher(talker, make.publisher(1))
    b.send(listener, make.subscription(1))
    network.settle()
    a.send(talker, make.batch(publisher, 0))
    network.settle()
    assert len(b.read(listener, frames.Batch)) == 1


def test_lost_messages_do_not_stop_a_keep_all_publisher() -> None:
    """A reader that has missed all messages within its window grants again."""
    network = Network()
    a, b = network
    talker, listener = a.join("/talker"), b.join("/listener")
    publisher = a.publisher(talker, make.publisher(1, qos=make.KEEP_ALL))
    b.send(listener, make.subscription(1, qos=make.KEEP_ALL, window=10))
    network.settle()
    network.lose = (Publish,)
    a.send(talker, make.batch(publisher, 0, 10))
    network.settle()
    assert network.lost
    network.lose = ()
    network.beat()
    assert a.read(talker, frames.Credit)[-1].sequence_limit == 20
    a.send(talker, make.batch(publisher, 10))
    network.settle()
    assert b.read(listener, frames.Batch)[-1].first_sequence == 10


def test_a_keep_all_publisher_without_credit_is_no_loss() -> None:
    """A reader that is slow keeps what has come, and nothing begins anew."""
    network = Network()
    a, b = network
    talker, listener = a.join("/talker"), b.join("/listener")
    publisher = a.publisher(talker, make.publisher(1, qos=make.KEEP_ALL))
    b.send(listener, make.subscription(1, qos=make.KEEP_ALL, window=10))
    network.settle()
    a.send(talker, make.batch(publisher, 0, 10))
    network.beat()
    network.beat()
    assert not any(each.mesh.resets for each in network)


def test_nothing_is_sent_to_a_broker_that_does_not_know_who_sends() -> None:
    """Its endpoints are taken when it has asked for the snapshot, or does not ask for long."""
    for asks in (True, False):
        a, b = MeshBroker(1), MeshBroker(2)
        talker, listener = a.join("/talker"), b.join("/listener")
        a.publisher(talker, make.publisher(1))
        b.send(listener, make.subscription(1))
        a.mesh.add_broker(2)
        a.mesh.accept_snapshot(2, b.mesh.snapshot(0, 0))
        a.forward()
        assert a.read(talker, frames.Matched) == []
        if asks:
            a.mesh.snapshot(2, 1)
        else:
            for _ in range(3):
                a.mesh.send_heartbeat()
        a.forward()
        assert a.read(talker, frames.Matched) == [frames.Matched(1, 1, 1)]


def test_bytes_that_were_lost_do_not_stop_a_keep_all_publisher() -> None:
    """Not even if later messages have come: the reader cannot grant what it does not know of."""
    network = Network()
    a, b = network
    talker, listener = a.join("/talker"), b.join("/listener")
    publisher = a.publisher(talker, make.publisher(1, qos=make.KEEP_ALL))
    b.send(listener, make.subscription(1, qos=make.KEEP_ALL, window_bytes=100))
    network.settle()
    network.lose = (Publish,)
    a.send(talker, make.batch(publisher, 0, 5, size=10))
    network.settle()
    network.lose = ()
    a.send(talker, make.batch(publisher, 5, 5, size=10))
    network.settle()
    b.send(listener, frames.Grant(1, publisher, 1000, 100))  # it has taken nothing yet
    for _ in range(6):
        network.beat()
    assert (a.read(talker, frames.Credit)[-1].byte_limit or 0) > 100
    resets = a.mesh.resets
    for _ in range(5):
        network.beat()
    assert a.mesh.resets == resets


def test_a_silent_publisher_that_has_lost_messages_before_is_not_stuck() -> None:
    """Heartbeats name it because its last message is latched, not because it waits; then it does wait."""
    network = Network()
    a, b = network
    talker, listener = a.join("/talker"), b.join("/listener")
    qos = {**make.KEEP_ALL, **make.LATCHED}
    publisher = a.publisher(talker, make.publisher(1, qos=qos))
    b.send(listener, make.subscription(1, qos=make.KEEP_ALL, window_bytes=100))
    network.settle()
    network.lose = (Publish,)
    a.send(talker, make.batch(publisher, 0, 5, size=10))
    network.settle()
    network.lose = ()
    a.send(talker, make.batch(publisher, 5))
    for _ in range(20):
        network.beat()
    assert not any(each.mesh.resets for each in network)
    a.send(talker, make.batch(publisher, 6, 4, size=10))
    for _ in range(20):
        network.beat()
    assert b.mesh.resets == 1


def test_a_slow_reader_elsewhere_is_no_loss() -> None:
    """Although messages were lost before, and the publisher waits: not for the reader that has lost them."""
    network = Network(3)
    a, b, c = network
    talker, listener, slow = a.join("/talker"), b.join("/listener"), c.join("/slow")
    publisher = a.publisher(talker, make.publisher(1, qos=make.KEEP_ALL))
    b.send(listener, make.subscription(1, qos=make.KEEP_ALL, window_bytes=1000))
    network.settle()
    network.lose = (Publish,)
    a.send(talker, make.batch(publisher, 0))
    network.settle()
    network.lose = ()
    a.send(talker, make.batch(publisher, 1))
    c.send(slow, make.subscription(1, qos=make.KEEP_ALL, window_bytes=50))
    network.settle()
    a.send(talker, make.batch(publisher, 2, 5, size=10))
    for _ in range(20):
        network.beat()
    assert b.router.routes.publishers[publisher].has_gap
    assert not any(each.mesh.resets for each in network)


def test_the_last_latched_message_is_sent_again_if_it_was_lost() -> None:
    """A map that is published once would never arrive."""
    network = Network()
    a, b = network
    talker, listener = a.join("/talker"), b.join("/listener")
    publisher = a.publisher(talker, make.publisher(1, qos=make.LATCHED))
    b.send(listener, make.subscription(1, qos=make.LATCHED))
    network.settle()
    network.lose = (Publish,)
    a.send(talker, make.batch(publisher, 0))
    network.settle()
    assert network.lost
    network.lose = ()
    for _ in range(3):
        network.beat()
    (got,) = [each for each in b.read_all(listener) if isinstance(each, (frames.Batch, frames.Replay))]
    assert got.first_sequence == 0
    resets = a.mesh.resets
    for _ in range(20):
        network.beat()
    assert a.mesh.resets == resets
    a.mesh.pop_messages()
    a.mesh.send_heartbeat()
    assert [each.held for each in a.mesh.pop_messages() if isinstance(each, Heartbeat)] == [{}]


def test_latched_messages_that_have_come_are_no_loss() -> None:
    """Nor are those that another broker gets because it has a subscription."""
    network = Network(3)
    a, b, _ = network
    talker, listener = a.join("/talker"), b.join("/listener")
    qos = {**make.LATCHED, "depth": 2}
    publisher = a.publisher(talker, make.publisher(1, qos=qos))
    a.send(talker, make.batch(publisher, 0, 5))
    network.beat()
    b.send(listener, make.subscription(1))
    network.settle()
    for first in (5, 6):
        a.send(talker, make.batch(publisher, first))
        for _ in range(5):
            network.beat()
    assert not any(each.mesh.resets for each in network)


def test_heartbeats_name_only_publishers_whose_last_message_may_matter() -> None:
    """Neither one without latched messages that waits for nothing, nor one without messages."""
    network = Network()
    a, b = network
    talker, listener = a.join("/talker"), b.join("/listener")
    plain, _ = a.publisher(talker, make.publisher(1)), a.publisher(talker, make.publisher(2, "/idle"))
    b.send(listener, make.subscription(1), make.subscription(2, "/idle"))
    network.settle()
    a.send(talker, make.batch(plain, 0, 3))
    network.settle()
    for _ in range(3):
        a.mesh.send_heartbeat()
        (heartbeat,) = [each for each in a.mesh.pop_messages() if isinstance(each, Heartbeat)]
        assert dict(heartbeat.held) == {}


def test_a_lost_last_message_is_noticed_behind_publishers_that_are_unknown() -> None:
    """One that nobody here reads, or that has gone, says nothing about the others."""
    network = Network()
    a, b = network
    talker, listener = a.join("/talker"), b.join("/listener")
    a.publisher(talker, make.publisher(1))
    b.send(listener, make.subscription(1))
    network.settle()
    (known,) = [each for each in b.router.routes.publishers.values() if each.mirrored]
    number = known.key & 0xFFFFFFFF
    assert has_lost(b.router, 1, {99: Held(5), number: Held(3)})
    assert not has_lost(b.router, 1, {99: Held(5), number: Held(0)})

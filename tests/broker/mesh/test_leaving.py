"""Endpoints that leave, are silent, or take no more requests, seen from another broker."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from broker.mesh.messages import Change
from proto.wire import frames
from proto.wire.codes import Status
from tests.broker import frame_makers as make
from tests.broker.mesh.network import Network
from tests.seams.brokers import calls_between_brokers, endpoint_keys

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.broker.mesh.network import MeshBroker


def _entries(broker: MeshBroker, other: int) -> set[int]:
    return {key & 0xFF for key in endpoint_keys(broker.router) if key >> 32 == other}


def _changes(broker: MeshBroker) -> list[frames.Frame]:
    broker.forward()
    return [message.frame for message in broker.mesh.pop_messages() if isinstance(message, Change)]


def test_a_suspended_node_leaves_and_returns() -> None:
    """Its endpoints are removed before it, the other broker takes them all, and messages go on."""
    network = Network()
    a, b = network
    talker, listener = a.join("/talker"), b.join("/listener")
    publisher = a.publisher(talker, make.publisher(1))
    a.send(talker, make.service(2))
    b.send(listener, make.subscription(1))
    network.settle()
    a.suspend(talker)
    network.settle()
    assert _entries(b, 1) == set()
    assert b.mesh.rejected == 0
    a.restore(talker)
    network.settle()
    assert _entries(b, 1) == {1, 2, 3}
    b.read_all(listener)
    a.send(talker, make.batch(publisher, 0))
    network.settle()
    assert len(b.read(listener, frames.Batch)) == 1


def test_nodes_leave_after_their_endpoints_whatever_waits() -> None:
    """Also if a publisher's last messages are still to be sent, and if the node returns before that."""
    network = Network()
    a, b = network
    talker, listener = a.join("/talker"), b.join("/listener")
    publisher = a.publisher(talker, make.publisher(1))
    a.send(talker, make.service(2))
    b.send(listener, make.subscription(1))
    network.settle()
    a.send(talker, make.batch(publisher, 0))
    a.suspend(talker)
    a.restore(talker)
    network.settle()
    assert (b.mesh.rejected, _entries(b, 1)) == (0, {1, 2, 3})
    a.send(talker, make.batch(publisher, 1))
    a.suspend(talker)
    assert [type(each) for each in _changes(a)] == [frames.Undeclare] * 3


def test_the_last_messages_of_a_suspended_node_arrive() -> None:
    """They wait for the mesh when it is suspended."""
    network = Network()
    a, b = network
    talker, listener = a.join("/talker"), b.join("/listener")
    publisher = a.publisher(talker, make.publisher(1))
    b.send(listener, make.subscription(1))
    network.settle()
    a.send(talker, make.batch(publisher, 0))
    a.suspend(talker)
    network.settle()
    assert len(b.read(listener, frames.Batch)) == 1
    assert _entries(b, 1) == set()


def test_a_broker_that_asks_meanwhile_learns_of_publishers_whose_messages_wait() -> None:
    """They are part of the snapshot until their last message has been sent."""
    network = Network()
    a, b = network
    talker, listener = a.join("/talker"), b.join("/listener")
    publisher = a.publisher(talker, make.publisher(1))
    b.send(listener, make.subscription(1))
    network.settle()
    a.send(talker, make.batch(publisher, 0))
    a.leave(talker)
    assert [type(each) for each in a.mesh.snapshot(0, 0).declarations] == [frames.Node, frames.Publisher]
    network.settle()
    assert a.mesh.snapshot(0, 0).declarations == ()


def _reply(a: MeshBroker, network: Network, server: int, call: int) -> None:
    a.send(server, make.reply(1, call))
    network.settle()


def _undeclare(a: MeshBroker, network: Network, server: int, _call: int) -> None:
    a.send(server, frames.Undeclare(1))
    network.settle()


@pytest.mark.parametrize(
    ("end", "status"), [(_reply, Status.OK), (_undeclare, Status.UNAVAILABLE)], ids=["reply", "undeclare"]
)
def test_a_retired_server_answers_calls_of_other_brokers(
    end: Callable[[MeshBroker, Network, int, int], None], status: Status
) -> None:
    """It gets no more of them; when it has gone, those that are left fail."""
    network = Network()
    a, b = network
    server, caller = a.join("/server"), b.join("/caller")
    a.send(server, make.service(1))
    b.send(caller, make.client(1))
    network.settle()
    b.send(caller, make.request(1, 5))
    network.settle()
    (request,) = a.read(server, frames.Request)
    a.send(server, frames.Retire(1))
    network.settle()
    assert b.read(caller, frames.Reply) == []
    b.send(caller, make.request(1, 6))
    network.settle()
    (refused,) = b.read(caller, frames.Reply)
    assert [(each.call, each.status) for each in refused.entries] == [(6, Status.UNAVAILABLE)]
    end(a, network, server, request.entries[0].call)
    (reply,) = b.read(caller, frames.Reply)
    assert [(each.call, each.status) for each in reply.entries] == [(5, status)]
    a.send(server, frames.Undeclare(0))
    network.settle()
    assert (b.mesh.rejected, _entries(b, 1)) == (0, set())


def test_calls_that_are_cancelled_before_they_are_sent_leave_nothing() -> None:
    """Neither their request nor their cancellation reaches the server's broker, and others are not lost."""
    network = Network()
    a, b = network
    caller, server = a.join("/caller"), b.join("/server")
    a.send(caller, make.client(1))
    b.send(server, make.service(7))
    network.settle()
    a.send(caller, make.request(1, 5, 6), frames.Cancel(1, (5,)))
    network.settle()
    got = [each for each in b.read_all(server) if isinstance(each, (frames.Request, frames.Cancel))]
    assert [len(each.entries) for each in got if isinstance(each, frames.Request)] == [1]
    assert len(got) == calls_between_brokers(a.mesh) == 1


def test_no_call_is_remembered_after_its_end() -> None:
    """It is answered or cancelled, its client or its server has gone, or its broker is cut off."""
    network = Network()
    a, b = network
    for number, end in enumerate(("reply", "cancel", "client", "server", "cut")):
        caller, server = a.join(f"/caller{number}"), b.join(f"/server{number}")
        a.send(caller, make.client(1, f"/s{number}"))
        b.send(server, make.service(7, f"/s{number}"))
        network.settle()
        a.send(caller, make.request(1, 5))
        network.settle()
        (request,) = b.read(server, frames.Request)
        assert calls_between_brokers(a.mesh) == 1
        if end == "reply":
            b.send(server, make.reply(7, request.entries[0].call))
        elif end == "cancel":
            a.send(caller, frames.Cancel(1, (5,)))
        elif end == "client":
            a.leave(caller)
        elif end == "server":
            b.leave(server)
        else:
            network.partition(2)
        network.settle()
        assert calls_between_brokers(a.mesh) == a.router.calls.pending == b.router.calls.pending == 0, end


def test_a_publisher_whose_last_messages_are_discarded_is_forgotten() -> None:
    """It has come back meanwhile and continues its queue, whose reader leaves: DETACHED is never sent."""
    network = Network()
    a, b = network
    talker, listener = a.join("/talker", instance=b"i" * 16), b.join("/listener")
    publisher = a.publisher(talker, make.publisher(1))
    b.send(listener, make.subscription(1))
    network.settle()
    a.send(talker, make.batch(publisher, 0))
    talker = a.join("/talker", instance=b"i" * 16)  # takes over before the message is sent
    a.publisher(talker, make.publisher(1, next_sequence=1))
    a.mesh.remove_broker(2)
    a.forward()
    a.mesh.send_heartbeat()
    assert len(a.mesh.snapshot(0, 0).declarations) == 2

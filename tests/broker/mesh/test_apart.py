"""Nodes that are kept apart, and labels, in a mesh: as on one broker."""

from __future__ import annotations

from proto.wire import frames
from proto.wire.codes import EntryKind
from tests.broker import frame_makers as make
from tests.broker.mesh.network import Network

MIRROR = frames.Node(0, "/mirror", shared=True, labels={"origin": "ros2/7"}, apart="ros2/7")


def test_mirrors_of_one_network_at_two_brokers_exchange_nothing() -> None:
    """Neither messages nor calls; an ordinary node of the other broker gets both."""
    network = Network()
    a, b = network
    one, other, plain = a.join(), b.join(), b.join("/plain")
    a.send(one, MIRROR)
    b.send(other, MIRROR)
    network.settle()
    number = a.publisher(one, make.publisher(1))
    b.send(other, make.subscription(1))
    b.send(plain, make.subscription(1))
    a.send(one, make.client(2))
    b.send(other, make.service(2))
    network.settle()
    assert [(each.id, each.peers) for each in a.read(one, frames.Matched)] == [(1, 1)]
    a.send(one, make.batch(number, 0))
    network.settle()
    assert len(b.read(plain, frames.Batch)) == 1
    b.send(plain, make.service(2))
    network.settle()
    a.send(one, make.request(2, 0), make.request(2, 1))
    network.settle()
    assert sum(len(frame.entries) for frame in b.read(plain, frames.Request)) == 2
    told = b.read_all(other)
    assert not any(
        isinstance(each, frames.Batch | frames.Request | frames.Attached | frames.Matched) for each in told
    )


def test_every_broker_shows_the_labels() -> None:
    """Endpoints name the key that the node has in the mesh."""
    network = Network()
    a, b = network
    one, watcher = a.join(), b.join("/watcher")
    a.send(one, MIRROR, make.publisher(1))
    network.settle()
    b.send(watcher, frames.Watch(9, keep=False))
    (graph,) = b.read(watcher, frames.Graph)
    (node,) = [each for each in graph.added if each.node == "/mirror" and each.kind == EntryKind.NODE]
    (publisher,) = [each for each in graph.added if each.kind == EntryKind.PUBLISHER]
    assert node.qos == {"shared": True, "label.origin": "ros2/7"}
    assert publisher.qos["node"] == node.key
    assert node.broker == 1

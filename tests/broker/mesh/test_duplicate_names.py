"""Nodes of two brokers that have one name, because they took it while the brokers were apart."""

from __future__ import annotations

from proto.wire import frames
from proto.wire.codes import NoticeKind
from tests.broker.mesh.network import MeshBroker, Network


def warned(broker: MeshBroker, *peers: int) -> list[NoticeKind]:
    """Return the kinds of notices that peers get."""
    return [NoticeKind(notice.kind) for peer in peers for notice in broker.read(peer, frames.Notice)]


def test_both_nodes_learn_of_it_once_and_go_on() -> None:
    """Also with a third broker that knew both; the name is free when both have gone."""
    network = Network(3)
    a, b, c = network
    network.partition(2)
    one, two = a.join("/same"), b.join("/same")
    network.heal(2)
    (notice,) = a.read(one, frames.Notice)
    text = "Another broker of the mesh has a node named '/same', too: rename one of them"
    assert notice == frames.Notice(0, NoticeKind.DUPLICATE_NAME, text, 0, 1)
    assert warned(b, two) == [NoticeKind.DUPLICATE_NAME]
    watcher = c.join("/watcher")
    c.send(watcher, frames.Watch(1, keep=False))
    (graph,) = c.read(watcher, frames.Graph)
    assert sorted(each.broker for each in graph.added if each.node == "/same") == [1, 2]
    a.leave(one)
    b.leave(two)
    network.settle()
    c.send(watcher, frames.Node(1, "/same"))
    assert c.read(watcher, frames.Refused) == []


def test_a_node_whose_name_was_taken_while_it_was_silent_learns_of_it() -> None:
    """Silent nodes are not in the graphs of other brokers, so that they may take the name at once."""
    network = Network()
    a, b = network
    one = a.join("/same")
    network.settle()
    a.suspend(one)
    network.settle()
    two = b.join("/same")
    network.settle()
    assert warned(a, one) == []
    a.restore(one)
    network.settle()
    assert warned(a, one) == [NoticeKind.SUSPENDED, NoticeKind.DUPLICATE_NAME]
    assert warned(b, two) == [NoticeKind.DUPLICATE_NAME]


def test_names_that_nodes_share_are_no_duplicates() -> None:
    """If all of them share it, nobody is warned; entries of the graph say so."""
    network = Network()
    a, b = network
    one, two = a.join(), b.join()
    a.send(one, frames.Node(1, "/same", shared=True))
    network.settle()
    b.send(two, frames.Node(1, "/same", shared=True))
    network.settle()
    assert warned(a, one) + warned(b, two) == []
    b.send(two, frames.Watch(2, keep=False))
    (graph,) = b.read(two, frames.Graph)
    assert [each.qos for each in graph.added] == [{"shared": True}] * 2


def test_a_node_that_yields_its_name_is_no_duplicate() -> None:
    """One of another broker gets the name beside it, and nobody is warned: it should be taken back."""
    network = Network()
    a, b = network
    mirror = a.join("/bridge")
    a.send(mirror, frames.Node(1, "/same", shared=True, yields=True))
    network.settle()
    newcomer = b.join("/newcomer")
    b.send(newcomer, frames.Node(1, "/same"))
    assert b.read(newcomer, frames.Refused) == []
    third = b.join("/third")
    b.send(third, frames.Node(1, "/same", shared=True))
    (refused,) = b.read(third, frames.Refused)
    assert "does not share its name" in refused.text
    network.settle()
    assert warned(a, mirror) == warned(b, newcomer) == []
    a.send(mirror, frames.Undeclare(1))
    network.settle()
    watcher = a.join("/watcher")
    a.send(watcher, frames.Watch(1, keep=False))
    (graph,) = a.read(watcher, frames.Graph)
    assert [each.broker for each in graph.added if each.node == "/same"] == [2]

"""The graph in the router: snapshots, changes and watchers."""

from __future__ import annotations

import pytest

from proto import limits
from proto.errors import ErrorCode, ProtocolError
from proto.wire import frames
from proto.wire.codec import encode
from proto.wire.codes import EntryKind
from tests.broker import frame_makers as make
from tests.broker.switch import Switch
from tests.seams.brokers import suspended_keys


def names(graphs: list[frames.Graph]) -> list[tuple[int, str, str]]:
    """Return (kind, node, name) of everything added."""
    return [(entry.kind, entry.node, entry.name) for graph in graphs for entry in graph.added]


def test_a_watch_shows_all_entries_and_then_changes() -> None:
    """Changes follow until UNWATCH."""
    switch = Switch()
    viewer, talker = switch.join(), switch.join("/_hidden")
    number = switch.publisher(talker, make.publisher(1))
    switch.send(viewer, frames.Watch(4, keep=True))
    first = switch.read(viewer, frames.Graph)
    assert [graph.more for graph in first] == [False]
    assert sorted(names(first))[1] == (EntryKind.PUBLISHER, "/_hidden", "/t")
    switch.send(talker, make.service(2))
    assert names(switch.read(viewer, frames.Graph)) == [(EntryKind.SERVICE, "/_hidden", "/s")]
    switch.send(talker, frames.Undeclare(1))
    (change,) = switch.read(viewer, frames.Graph)
    assert change.removed == (number,)
    switch.send(viewer, frames.Unwatch(4))
    switch.leave(talker)
    assert switch.read(viewer, frames.Graph) == []


def test_a_watch_without_keep_is_answered_once() -> None:
    """Also if the graph is empty."""
    switch = Switch()
    viewer = switch.join()
    switch.send(viewer, frames.Watch(1, keep=False))
    assert switch.read(viewer, frames.Graph) == [frames.Graph(1, False, (), (), ())]
    switch.join("/n")
    assert switch.read(viewer, frames.Graph) == []


def test_a_suspended_node_is_not_in_the_graph() -> None:
    """Watchers see a frozen node go, and come back."""
    switch = Switch()
    viewer, node = switch.join(), switch.join("/n")
    switch.send(viewer, frames.Watch(1, keep=True))
    switch.read_all(viewer)
    switch.suspend(node)
    [change] = switch.read(viewer, frames.Graph)
    assert len(change.removed) == 1
    assert change.suspended == change.removed
    switch.restore(node)
    assert names(switch.read(viewer, frames.Graph))[0][1] == "/n"


def test_a_retired_server_is_removed_once() -> None:
    """Watchers get no second removal when its link is suspended, restored or closed."""
    switch = Switch()
    watcher, server = switch.join("/watcher"), switch.join("/server")
    switch.send(server, make.service(1))
    switch.send(watcher, frames.Watch(1, keep=True))
    key = next(
        entry.key
        for frame in switch.read(watcher, frames.Graph)
        for entry in frame.added
        if entry.kind == EntryKind.SERVICE
    )
    switch.send(server, frames.Retire(1))
    assert [frame.removed for frame in switch.read(watcher, frames.Graph)] == [(key,)]
    switch.suspend(server)
    switch.restore(server)
    switch.suspend(server)
    switch.leave(server)
    sent_frames = switch.read(watcher, frames.Graph)
    assert key not in {gone for frame in sent_frames for gone in frame.removed}
    assert len(sent_frames) == 4


def test_a_suspended_node_that_leaves_is_removed() -> None:
    """Watchers see it suspended, then removed; nothing of it is left."""
    switch = Switch()
    viewer, node = switch.join(), switch.join("/n")
    switch.send(viewer, frames.Watch(1, keep=True))
    switch.suspend(node)
    switch.read_all(viewer)
    switch.leave(node)
    [change] = switch.read(viewer, frames.Graph)
    assert len(change.removed) == 1
    assert not change.suspended
    assert not suspended_keys(switch.router)


def test_a_large_graph_comes_in_slices() -> None:
    """No GRAPH frame exceeds the size limit, and only the last is marked as last."""
    switch = Switch()
    node, viewer = switch.join("/n"), switch.join()
    switch.send(node, *(make.subscription(n, "/" + "x" * 240 + str(n)) for n in range(1, 3000)))
    switch.send(viewer, frames.Watch(1, keep=False))
    graphs = switch.read(viewer, frames.Graph)
    assert len(names(graphs)) == 3000
    assert [graph.more for graph in graphs] == [True] * (len(graphs) - 1) + [False]
    assert max(len(encode(graph)) for graph in graphs) < limits.MAX_FRAME_BYTES


def test_watches_are_limited_and_their_ids_are_single() -> None:
    """A used id, or one watch too many, closes the link."""
    switch = Switch()
    viewer = switch.join()
    switch.send(viewer, frames.Watch(1, keep=True))
    with pytest.raises(ProtocolError) as caught:
        switch.send(viewer, frames.Watch(1, keep=True))
    assert caught.value.code is ErrorCode.UNEXPECTED
    too_many = [frames.Watch(number, keep=True) for number in range(2, 10_000)]
    with pytest.raises(ProtocolError) as caught:
        switch.send(viewer, *too_many)
    assert caught.value.code is ErrorCode.LIMIT
    assert switch.router.refusals.count == 1


def test_matched_and_watched_peers_are_relied_on() -> None:
    """A watched peer is relied on until its next sign of life; a removed one is not."""
    switch = Switch()
    talker, listener, loner = switch.join("/talker"), switch.join("/listener"), switch.join("/loner")
    relied_on = switch.router.relied_on
    assert relied_on == set()
    for number in (1, 2):
        switch.publisher(talker, make.publisher(number, topic=f"/t{number}"))
        switch.send(listener, make.subscription(number, topic=f"/t{number}"))
    assert relied_on == {talker, listener}
    switch.send(listener, frames.Watch(9, keep=False))
    assert relied_on == {talker, listener, loner}
    for peer in (talker, listener, loner):
        switch.router.mark_alive(peer)
    assert relied_on == {talker, listener}
    other = switch.join()
    switch.send(other, frames.Node(0, "/loner"))
    assert relied_on == {talker, listener, loner}
    for peer in (loner, talker):
        switch.leave(peer)
    switch.router.mark_alive(listener)
    assert relied_on == set()


def test_a_peer_with_pending_calls_is_relied_on() -> None:
    """A retired server has no counterparts any more, but is relied on until its last answer."""
    switch = Switch()
    server, asker = switch.join("/server"), switch.join("/asker")
    relied_on = switch.router.relied_on
    switch.send(server, make.service(1))
    switch.send(asker, make.client(1), make.request(1, 5))
    [request] = switch.read(server, frames.Request)
    switch.send(server, frames.Retire(1))
    switch.router.mark_alive(server)
    assert server in relied_on
    switch.send(server, make.reply(1, request.entries[0].call))
    switch.router.mark_alive(server)
    assert server not in relied_on

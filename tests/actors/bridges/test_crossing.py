"""The messages of one topic in one direction."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.bridges.counters import Counts
from actors.bridges.crossing import HELD_MESSAGES, UNNUMBERED, Crossing
from actors.interfaces.errors import InvalidMessageError
from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Callable

A, B, OTHER = b"a" * 16, b"b" * 16, b"o" * 16


class Side:
    """The side where messages come from, and what has left on the other one."""

    def __init__(self, nodes: dict[bytes, str | None] | None = None, **limits: int) -> None:
        self.nodes: dict[bytes, str | None] = {A: "/a", B: "/b"} if nodes is None else nodes
        self.sent: list[tuple[str, bytes, int]] = []
        self.counts = Counts()
        self.crossing = Crossing(self.convert, self.counts, self.node_of, **limits)

    def node_of(self, gid: bytes) -> str | None:
        """Return what the graph says."""
        return self.nodes.get(gid, "")

    @staticmethod
    def convert(data: bytes) -> bytes:
        """Return the message in capitals."""
        if data == b"bad":
            raise InvalidMessageError("it is bad")
        return data.upper()

    def mirror(self, node: str) -> Callable[[bytes, int], None]:
        """Return what sends for a node."""
        return lambda data, stamp_ns: self.sent.append((node, data, stamp_ns))

    def add(self, node: str) -> None:
        """Show a node."""
        self.crossing.add_mirror(node, self.mirror(node))


def test_messages_leave_through_the_mirror_of_their_node() -> None:
    """Converted, with their source's time."""
    side = Side()
    side.add("/a")
    side.add("/b")
    side.crossing.receive(b"x", A, 1, 10)
    side.crossing.receive(b"y", B, 7, 20)
    side.crossing.receive(b"z", OTHER, 1, 30, node="/a")
    assert side.sent == [("/a", b"X", 10), ("/b", b"Y", 20), ("/a", b"Z", 30)]
    assert (side.counts.received, side.counts.sent, side.counts.lost) == (3, 3, 0)


def test_what_arrives_before_the_mirror_waits_for_it() -> None:
    """The newest few, in order; the others are counted as dropped."""
    side = Side()
    for number in range(HELD_MESSAGES + 2):
        side.crossing.receive(b"%d" % number, A, number, 0)
    assert not side.sent
    side.add("/a")
    assert [data for _, data, _ in side.sent] == [b"%d" % each for each in range(2, HELD_MESSAGES + 2)]
    assert side.counts.dropped.total() == 2


def test_a_publisher_that_the_graph_shows_late_loses_nothing() -> None:
    """Its node is looked up again until it is known, whether or not the mirror was there first."""
    side = Side({})
    side.add("/a")
    side.crossing.receive(b"x", A, 1, 0)
    side.crossing.look_again()
    assert not side.sent
    side.nodes[A] = "/a"
    side.crossing.look_again()
    side.crossing.receive(b"y", A, 2, 0)
    assert side.sent == [("/a", b"X", 0), ("/a", b"Y", 0)]


def test_what_a_mirror_has_published_does_not_cross() -> None:
    """Neither if that is known at once nor if it turns out later, and it is not counted as received."""
    side = Side({A: None})
    side.add("/a")
    side.crossing.receive(b"x", A, 1, 0)
    assert (side.sent, side.counts.received) == ([], 0)
    side.crossing.receive(b"x", B, 1, 0)
    side.nodes[B] = None
    side.crossing.look_again()
    assert not side.sent


def test_latched_messages_that_come_again_cross_once() -> None:
    """A subscription that is made again gets them again: they are known by their numbers."""
    side = Side()
    side.add("/a")
    for _ in range(2):
        side.crossing.begin()
        for number in (3, 4):
            side.crossing.receive(b"%d" % number, A, number, 0)
    side.crossing.receive(b"5", A, 5, 0)
    assert [data for _, data, _ in side.sent] == [b"3", b"4", b"5"]
    assert (side.counts.repeated, side.counts.lost) == (2, 0)


def test_gaps_are_losses_unless_nobody_listened() -> None:
    """What was published while there was no subscription is not lost, nor what came before the first."""
    side = Side()
    side.add("/a")
    for number in (5, 8):
        side.crossing.receive(b"x", A, number, 0)
    assert side.counts.lost == 2
    side.crossing.begin()
    side.crossing.receive(b"x", A, 20, 0)
    assert side.counts.lost == 2


def test_invalid_messages_are_counted_with_an_example() -> None:
    """The next one crosses."""
    side = Side()
    side.add("/a")
    side.crossing.receive(b"bad", A, 1, 0)
    side.crossing.receive(b"good", A, 2, 0)
    assert [data for _, data, _ in side.sent] == [b"GOOD"]
    assert dict(side.counts.dropped) == {"invalid": 1}
    assert side.counts.examples == {"invalid": "it is bad"}


def test_a_message_that_the_other_side_refuses_is_counted() -> None:
    """With what it says; the next one crosses."""
    side = Side()
    sent: list[bytes] = []

    def send(data: bytes, _: int) -> None:
        if data == b"NO":
            raise CallboardError("not this one")
        sent.append(data)

    side.crossing.add_mirror("/a", send)
    side.crossing.receive(b"no", A, 1, 0)
    side.crossing.receive(b"yes", A, 2, 0)
    assert sent == [b"YES"]
    assert (side.counts.sent, side.counts.examples) == (1, {"refused": "not this one"})


def test_a_node_that_leaves_takes_what_waits_for_it() -> None:
    """That is counted; when it comes back, it begins anew."""
    side = Side()
    side.crossing.receive(b"x", A, 1, 0)
    side.crossing.remove_mirror("/a")
    assert side.counts.dropped.total() == 1
    side.add("/a")
    side.crossing.receive(b"y", A, 1, 0)
    assert [data for _, data, _ in side.sent] == [b"Y"]


def test_a_mirror_that_goes_when_its_node_has_another_one_takes_nothing_with_it() -> None:
    """Publishers of a node that is back are not forgotten when its former mirror has gone at last."""
    side = Side()
    former, present = side.mirror("former"), side.mirror("present")
    side.crossing.add_mirror("/a", former)
    side.crossing.add_mirror("/a", present)
    side.crossing.remove_mirror("/a", former)
    side.crossing.receive(b"x", A, 1, 0)
    side.crossing.remove_mirror("/a", present)
    side.crossing.receive(b"y", A, 2, 0)
    assert side.sent == [("present", b"X", 0)]


def test_a_node_that_is_back_before_its_mirror_has_gone_sends_each_message_once() -> None:
    """What it publishes waits for the next mirror, and is known when another subscription brings it again."""
    side = Side({A: "/a", OTHER: "/a"})
    old, new = side.mirror("old"), side.mirror("new")
    side.crossing.add_mirror("/a", old)
    side.crossing.receive(b"first", A, 1, 0)
    side.crossing.retire_mirror("/a", old)
    side.crossing.receive(b"last", A, 2, 0)
    side.crossing.receive(b"next", OTHER, 1, 0)
    side.crossing.remove_mirror("/a", old)
    side.crossing.receive(b"next", OTHER, 1, 0)
    side.crossing.add_mirror("/a", new)
    side.crossing.receive(b"more", OTHER, 2, 0)
    assert [(node, data) for node, data, _ in side.sent] == [
        *(("old", b"FIRST"), ("old", b"LAST")),
        *(("new", b"NEXT"), ("new", b"MORE")),
    ]
    assert (side.counts.repeated, side.counts.dropped.total()) == (1, 0)


def test_what_waits_for_a_mirror_that_will_never_be_leaves_by_another_way() -> None:
    """The last words of a node that has gone; a mirror that comes later sends what follows."""
    side = Side()
    side.crossing.receive(b"x", A, 1, 0)
    side.crossing.receive(b"y", OTHER, 1, 0)
    assert side.crossing.waiting == {"/a"}
    side.crossing.send_held("/a", side.mirror("substitute"))
    assert side.crossing.waiting == set()
    side.crossing.receive(b"z", A, 2, 0)
    side.add("/a")
    assert side.sent == [("substitute", b"X", 0), ("/a", b"Z", 0)]


def test_what_waits_has_a_limit_in_bytes_and_publishers() -> None:
    """Beyond it messages are dropped and counted, and the oldest publisher is forgotten."""
    side = Side(max_held_bytes=10, max_publishers=2)
    side.crossing.receive(b"x" * 8, A, 1, 0)
    side.crossing.receive(b"y" * 8, B, 1, 0)
    assert side.counts.dropped.total() == 1
    side.crossing.receive(b"z" * 8, OTHER, 1, 0, node="/o")
    side.add("/a")
    side.add("/o")
    assert side.sent == [("/o", b"Z" * 8, 0)]


def test_a_single_message_of_any_size_waits() -> None:
    """A latched map comes once, before its publisher has a mirror; what comes behind it has no space."""
    side = Side(max_held_bytes=10)
    side.crossing.receive(b"x" * 12, A, 1, 0)
    side.crossing.receive(b"y", B, 1, 0)
    assert side.counts.dropped.total() == 1
    side.add("/a")
    assert side.sent == [("/a", b"X" * 12, 0)]
    side.crossing.receive(b"y", B, 2, 0)
    side.add("/b")
    assert side.sent[1:] == [("/b", b"Y", 0)]


def test_messages_without_numbers_cross() -> None:
    """Some middleware numbers none: all have the greatest number, and none is a repetition."""
    side = Side()
    side.add("/a")
    side.crossing.receive(b"x", A, UNNUMBERED, 0)
    side.crossing.receive(b"y", A, UNNUMBERED, 0)
    assert [data for _, data, _ in side.sent] == [b"X", b"Y"]
    assert (side.counts.repeated, side.counts.lost) == (0, 0)


def test_a_mirror_that_is_made_again_gets_latched_messages_again() -> None:
    """Once, in order, and of its own node only; what is new goes its usual way, and no old one follows it."""
    side = Side()
    side.add("/a")
    side.add("/b")
    for number in (1, 2, 3):
        side.crossing.receive(b"a%d" % number, A, number, number)
        side.crossing.receive(b"b%d" % number, B, number, number)
    assert not side.crossing.wants_replay
    side.sent.clear()
    side.crossing.replace_mirror("/a")
    side.crossing.replay(b"a2", A, 2, 2)
    assert not side.sent
    side.add("/a")
    assert side.crossing.wants_replay
    for number in (2, 2, 3, 4):
        side.crossing.replay(b"a%d" % number, A, number, number)
        side.crossing.replay(b"b%d" % number, B, number, number)
    side.crossing.replay(b"x", OTHER, 1, 1)
    assert side.sent == [("/a", b"A2", 2), ("/a", b"A3", 3)]
    side.crossing.receive(b"a4", A, 4, 4)
    side.crossing.replay(b"a3", A, 3, 3)
    assert side.sent[2:] == [("/a", b"A4", 4)]
    assert (side.counts.sent, side.counts.lost, side.counts.repeated) == (7, 0, 0)


def test_a_message_while_a_mirror_is_made_again_waits_for_it() -> None:
    """It is not lost, and no latched one follows it."""
    side = Side()
    side.add("/a")
    side.crossing.receive(b"a1", A, 1, 0)
    side.crossing.replace_mirror("/a")
    side.crossing.receive(b"a2", A, 2, 0)
    side.add("/a")
    side.crossing.replay(b"a1", A, 1, 0)
    assert [data for _, data, _ in side.sent] == [b"A1", b"A2"]


def test_a_middleware_without_numbers_repeats_nothing() -> None:
    """What is new could not be told from what is latched."""
    side = Side()
    side.add("/a")
    side.crossing.receive(b"a1", A, UNNUMBERED, 0)
    side.crossing.replace_mirror("/a")
    side.add("/a")
    side.crossing.replay(b"a1", A, UNNUMBERED, 0)
    assert [data for _, data, _ in side.sent] == [b"A1"]
    assert not side.crossing.wants_replay

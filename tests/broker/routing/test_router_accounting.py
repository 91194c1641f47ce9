"""Nothing is lost in silence: each routed copy is counted once, and the sums add up."""

from __future__ import annotations

from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from broker.serving.stats import collect
from proto import limits
from proto.wire import frames
from tests.broker import frame_makers as make
from tests.broker.switch import Switch, talk

LARGE = 3 * limits.FRAGMENT_BYTES
"""A message of this size leaves in pieces."""

READERS = 3
WRITERS = 2


class Accounts(RuleBasedStateMachine):
    """A few links that publish, subscribe, freeze, read, break and leave, also in mid-message."""

    def __init__(self) -> None:
        super().__init__()
        self.switch = Switch()
        self.read = 0
        self.published = 0
        self.subscribed: dict[int, list[int]] = {}
        self.readers = [
            self.switch.join(f"/reader{n}", instance=(100 + n).to_bytes(16, "big")) for n in range(READERS)
        ]
        self.writers: list[tuple[int, int]] = []
        for n in range(WRITERS):
            peer = self.switch.join(f"/writer{n}")
            qos = {"durability": 1 + n, "depth": 3}
            self.writers.append((peer, self.switch.publisher(peer, make.publisher(1, qos=qos))))
        self.sequences = [0] * WRITERS
        self.suspended: set[int] = set()
        self.ids = 1
        self.last: dict[tuple[int, int], int] = {}
        for reader in range(READERS):
            self.subscribe(reader, depth=3, latched=False)

    @rule(reader=st.integers(0, READERS - 1), depth=st.integers(1, 6), latched=st.booleans())
    def subscribe(self, reader: int, depth: int, latched: bool) -> None:
        peer = self.readers[reader]
        self.ids += 1
        qos = {"depth": depth, "durability": 1 if latched else 2}
        self.switch.send(peer, make.subscription(self.ids, qos=qos))
        self.subscribed.setdefault(reader, []).append(self.ids)

    @rule(reader=st.integers(0, READERS - 1))
    def unsubscribe(self, reader: int) -> None:
        if self.subscribed.get(reader):
            self.switch.send(self.readers[reader], frames.Undeclare(self.subscribed[reader].pop()))

    @rule(
        writer=st.integers(0, WRITERS - 1),
        length=st.integers(1, 9),
        back=st.integers(0, 3),
        size=st.sampled_from([10, 10, 10, LARGE]),
    )
    def publish(self, writer: int, length: int, back: int, size: int) -> None:
        peer, number = self.writers[writer]
        first = max(0, self.sequences[writer] - back)
        length = length if size < LARGE else 1
        self.switch.send(peer, make.batch(number, first, length, size))
        self.published += length
        self.sequences[writer] = max(self.sequences[writer], first + length)

    @rule(reader=st.integers(0, READERS - 1))
    def congest(self, reader: int) -> None:
        self.switch.congest(self.readers[reader])

    @rule(reader=st.integers(0, READERS - 1), pieces=st.sampled_from([1, 2, 5, 1000]))
    def hear(self, reader: int, pieces: int) -> None:
        for frame in self.switch.read_all(self.readers[reader], pieces):
            if isinstance(frame, frames.Batch):
                self.read += frame.length
                key = (self.readers[reader], frame.publisher)
                assert frame.first_sequence >= self.last.get(key, 0), "out of order, or twice"
                self.last[key] = frame.first_sequence + frame.length

    @rule(reader=st.integers(0, READERS - 1))
    def freeze_or_thaw(self, reader: int) -> None:
        peer = self.readers[reader]
        if peer in self.suspended:
            self.suspended.discard(peer)
            self.switch.restore(peer)
        else:
            self.suspended.add(peer)
            self.switch.suspend(peer)

    @rule(reader=st.integers(0, READERS - 1), again=st.booleans())
    def reader_breaks(self, reader: int, again: bool) -> None:
        """Its connection breaks, or it connects again before anybody has seen that."""
        before = self.readers[reader]
        identity = (100 + reader).to_bytes(16, "big")
        if not again:
            self.switch.leave(before)
        self.readers[reader] = self.switch.join(f"/reader{reader}", instance=identity)
        self.suspended.discard(before)
        self.subscribed.pop(reader, None)

    @rule(reader=st.integers(0, READERS - 1))
    def reader_is_ending(self, reader: int) -> None:
        """It breaks the protocol: the router has not heard of it yet, and what comes finds no link."""
        self.switch.cut(self.readers[reader])

    @rule(writer=st.integers(0, WRITERS - 1))
    def publisher_comes_back(self, writer: int) -> None:
        peer, _ = self.writers[writer]
        self.ids += 1
        self.switch.leave(peer)
        peer = self.switch.join(f"/writer{writer}")
        declaration = make.publisher(self.ids, next_sequence=self.sequences[writer])
        self.writers[writer] = peer, self.switch.publisher(peer, declaration)

    @invariant()
    def accounts_balance(self) -> None:
        stats = collect(0, [self.switch.router])
        assert stats.delivered == self.read
        assert stats.copies == stats.accounted
        assert self.published == stats.routed + stats.unmatched + stats.stale


def half_sent() -> tuple[Switch, int, int, int]:
    """A listener with depth 2 has got the first piece of a large message, and a small one waits behind it."""
    switch = Switch()
    talker, listener, number = talk(switch, qos={"depth": 2})
    switch.send(talker, make.batch(number, 0, 1, LARGE), make.batch(number, 1))
    switch.read_all(listener, 1)
    stats = collect(0, [switch.router])
    assert (stats.copies, stats.leaving, stats.queued, stats.delivered) == (2, 1, 1, 0)
    return switch, talker, listener, number


def test_a_large_message_is_delivered_with_its_last_piece() -> None:
    """Until then it counts as leaving."""
    switch, _, listener, _ = half_sent()
    switch.read_all(listener, 2)
    stats = collect(0, [switch.router])
    assert (stats.leaving, stats.queued, stats.delivered) == (1, 1, 0)
    switch.read_all(listener)
    stats = collect(0, [switch.router])
    assert (stats.leaving, stats.queued, stats.delivered) == (0, 0, 2)


def test_messages_for_a_subscription_that_leaves_are_abandoned() -> None:
    """Also a message that is half sent."""
    switch, _, listener, _ = half_sent()
    switch.send(listener, frames.Undeclare(1))
    stats = collect(0, [switch.router])
    assert (stats.copies, stats.abandoned, stats.accounted) == (2, 2, 2)


def test_messages_for_a_link_that_breaks_are_lost_on_break() -> None:
    """Also a half sent message, and those routed before the router knows of the break."""
    switch, talker, listener, number = half_sent()
    switch.cut(listener)
    switch.send(talker, make.batch(number, 2, 3))
    assert collect(0, [switch.router]).lost_on_break == 3
    switch.leave(listener)
    stats = collect(0, [switch.router])
    assert (stats.copies, stats.lost_on_break, stats.accounted) == (5, 5, 5)


def test_messages_of_a_departed_publisher_are_accounted_for() -> None:
    """Its queues are emptied, or end with their link."""
    switch, talker, listener, _ = half_sent()
    switch.leave(talker)
    stats = collect(0, [switch.router])
    assert (stats.leaving, stats.queued) == (1, 1)
    switch.read_all(listener, 3)
    switch.leave(listener)
    stats = collect(0, [switch.router])
    assert (stats.delivered + stats.lost_on_break, stats.accounted) == (2, 2)


def test_two_queues_of_one_gid_are_both_accounted_for() -> None:
    """Clients choose gids: a second publisher with the same one does not hide the queue of the first."""
    switch = Switch()
    talker, listener, number = talk(switch)
    second = switch.publisher(talker, make.publisher(2))
    switch.read_all(listener)
    switch.send(talker, make.batch(number, 0, 4), make.batch(second, 0, 3))
    switch.leave(talker)
    stats = collect(0, [switch.router])
    assert (stats.queued, stats.accounted) == (7, 7)


def test_no_queue_outlives_its_link() -> None:
    """Not even one of two departed publishers with the same gid."""
    switch = Switch()
    talker, listener, number = talk(switch)
    second = switch.publisher(talker, make.publisher(2))
    switch.send(talker, make.batch(number, 0, 4), make.batch(second, 0, 3))
    switch.leave(talker)
    switch.leave(listener)
    stats = collect(0, [switch.router])
    assert (stats.queued, stats.lost_on_break, stats.accounted) == (0, 7, 7)
    assert all(peer_queue.queue.empty for peer_queue in switch.router.routes.peer_queues())


def test_a_gid_names_a_publisher_of_one_topic() -> None:
    """The queue left on one topic is not resumed by a publisher with the same gid on another topic."""
    switch = Switch()
    talker, listener, number = talk(switch)
    switch.send(listener, make.subscription(2, "/other"))
    switch.send(talker, make.batch(number, 0, 5))
    switch.leave(talker)
    another = switch.join("/another")
    second = switch.publisher(another, make.publisher(1, "/other"))
    switch.send(another, make.batch(second, 0))
    _, topics = switch.router.routes.tallies()
    assert {topic.name: tally.queued for topic, tally in topics.items()} == {"/t": 5, "/other": 1}


def test_a_link_that_is_taken_over_loses_its_queued_messages() -> None:
    """They count as lost on break, not as abandoned."""
    switch = Switch()
    talker = switch.join("/talker")
    listener = switch.join("/listener", instance=b"i" * 16)
    switch.send(listener, make.subscription(1))
    number = switch.publisher(talker, make.publisher(1))
    switch.send(talker, make.batch(number, 0, 4))
    switch.join("/listener", instance=b"i" * 16)
    stats = collect(0, [switch.router])
    assert (stats.lost_on_break, stats.abandoned) == (4, 0)


TestAccounts = Accounts.TestCase

"""Nothing is lost in silence: what was routed is delivered, dropped, abandoned or queued, come what may."""

from __future__ import annotations

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from broker.stats import collect
from proto import frames
from tests.broker import frame_makers as make
from tests.broker.switch import Switch

READERS = 3
WRITERS = 2


class Accounts(RuleBasedStateMachine):
    """A few links that publish, subscribe, freeze, read and leave in any order."""

    def __init__(self) -> None:
        super().__init__()
        self.switch = Switch()
        self.read = 0
        self.published = 0
        self.subscribed: dict[int, list[int]] = {}
        self.readers = [self.switch.join(f"/reader{n}") for n in range(READERS)]
        self.writers: list[tuple[int, int]] = []
        for n in range(WRITERS):
            peer = self.switch.join(f"/writer{n}")
            qos = {"durability": 1 + n, "depth": 3}
            self.writers.append((peer, self.switch.publisher(peer, make.publisher(1, qos=qos))))
        self.sequences = [0] * WRITERS
        self.suspended: set[int] = set()
        self.ids = 1
        self.last: dict[tuple[int, int], int] = {}

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

    @rule(writer=st.integers(0, WRITERS - 1), length=st.integers(1, 9), back=st.integers(0, 3))
    def publish(self, writer: int, length: int, back: int) -> None:
        peer, number = self.writers[writer]
        first = max(0, self.sequences[writer] - back)
        self.switch.send(peer, make.run(number, first, length))
        self.published += length
        self.sequences[writer] = max(self.sequences[writer], first + length)

    @rule(reader=st.integers(0, READERS - 1))
    def congest(self, reader: int) -> None:
        self.switch.congest(self.readers[reader])

    @rule(reader=st.integers(0, READERS - 1))
    def hear(self, reader: int) -> None:
        for frame in self.switch.read_all(self.readers[reader]):
            if isinstance(frame, frames.Run):
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
        assert stats.copies == stats.delivered + stats.dropped + stats.abandoned + stats.queued
        assert self.published == stats.routed + stats.unmatched + stats.stale
        assert min(stats.delivered, stats.dropped, stats.abandoned, stats.queued) >= 0


TestAccounts = Accounts.TestCase
TestAccounts.settings = settings(max_examples=60, stateful_step_count=40, deadline=None)

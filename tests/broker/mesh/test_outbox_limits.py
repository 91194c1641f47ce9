"""What waits for the mesh has limits; beyond them, brokers begin anew, and nodes go on."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any
from unittest import mock

from broker import BrokerOptions
from broker.mesh.engine.channel import MeshChannel
from broker.mesh.engine.engine import EngineStats
from broker.mesh.messages import Ask, Change, Direct, Publish
from broker.serving.memory_guard import MemoryGuard
from proto.wire import frames
from proto.wire.fragments import ByteTotal, ReassemblyTotal
from tests.broker import frame_makers as make
from tests.broker.mesh.attack import NODE, OTHER, THERE, Attack

if TYPE_CHECKING:
    from collections.abc import Callable

    from broker.mesh.messages import Message

KIB = 1024


class Engine:
    """An engine that keeps what it gets, while it is not full."""

    def __init__(self) -> None:
        self.full = False
        self.messages: list[Any] = []

    def send(self, domain: int, messages: list[Message]) -> None:
        """Engine."""
        del domain
        self.messages += messages

    def take(self, kind: type[Any]) -> list[Any]:
        """Remove all messages; return those of one kind."""
        messages, self.messages = self.messages, []
        return [message for message in messages if isinstance(message, kind)]

    async def start(self) -> None:
        """Engine."""

    def join(self, domain: int) -> None:
        """Engine."""

    def statistics(self) -> EngineStats:
        """Engine."""
        return EngineStats({})

    async def stop(self) -> None:
        """Engine."""


class Congestion(Attack):
    """A broker whose mesh can be congested.

    Attributes:
        engine: Full while nothing leaves.
        channel: The outbox of the mesh.
    """

    def __init__(self, options: BrokerOptions | None = None, **limits: int) -> None:
        super().__init__(**limits)
        self.engine = Engine()
        options = options or BrokerOptions()
        self.channel = MeshChannel(self.mesh, self.broker.router, self.engine, lambda: options)
        self.broker.use_outbox(self.mesh.peer, self.channel.outbox)

    def flush(self) -> None:
        """Let the channel send what it can."""
        self.broker.report()
        self.channel.flush()
        self.channel.ask()
        self.broker.use_outbox(self.mesh.peer, self.channel.outbox)

    def answer(self, size: int, *calls: int, broker: int = THERE, client: int = 4) -> None:
        """Let broker 2 or 3 call the local server, which answers."""
        for call in calls:
            self.direct(make.request(client, call), 3, broker=broker)
        for request in self.broker.read(self.node, frames.Request):
            for entry in request.entries:
                self.broker.send(self.node, make.reply(3, entry.call, body=bytes(size)))

    def asked(self) -> list[int]:
        """Return the brokers with which it begins anew."""
        self.engine.full = False
        self.flush()
        return [ask.broker for ask in self.engine.take(Ask)]


def test_requests_for_snapshots_do_not_go_with_messages() -> None:
    """Case 65: each takes 0.1 ms, so that messages between nodes would wait for those of many brokers."""
    attack = Congestion()
    for broker in range(1000, 1050):
        attack.mesh.add_broker(broker)
    for number in range(3):
        attack.broker.send(attack.node, make.batch(attack.publisher, number))
        attack.channel.flush()
    assert attack.engine.take(Ask) == []
    attack.channel.ask()
    assert len(attack.engine.take(Ask)) == 1


def test_a_graph_with_nothing_to_send_is_passed_over() -> None:
    """Case 64: another broker may be in many graphs, and each is flushed after each message of any node."""
    attack = Congestion()
    attack.flush()
    options = mock.Mock(return_value=BrokerOptions())
    channel = MeshChannel(attack.mesh, attack.broker.router, attack.engine, options)
    channel.flush()
    assert not options.called
    begins: tuple[Callable[[], None], ...] = (
        lambda: attack.mesh.add_broker(1000),
        attack.mesh.send_heartbeat,
        lambda: attack.mesh.wanted.touch("/chatter"),
        lambda: attack.mesh.overflows.note(THERE, "why"),
        lambda: channel.send(frames.Ping(1)),
    )
    for begin in begins:
        begin()
        channel.flush()
        assert options.called
        while channel.mesh.busy:
            channel.ask()
        options.reset_mock()
        channel.flush()
        assert not options.called


def test_small_replies_that_wait_for_a_mesh_have_a_limit() -> None:
    """Nothing of them is kept, all brokers begin anew, and local nodes notice only that their peers go."""
    attack = Congestion(BrokerOptions(max_queue_bytes=64 * KIB))
    attack.engine.full = True
    attack.answer(KIB, *range(100))
    attack.flush()
    assert attack.channel.outbox.urgent_bytes == 0
    assert attack.asked() == [THERE, OTHER]
    assert (attack.mesh.overflows.count, attack.mesh.rejected, attack.broker.closed) == (1, 0, {})
    assert {what for what, *_ in attack.warnings} == {"reset the session with"}
    attack.rejoin(NODE, make.subscription(3, node=1))
    attack.flush()
    attack.broker.send(attack.node, make.batch(attack.publisher, 0))
    attack.flush()
    assert len(attack.engine.take(Publish)) == 1


def test_large_replies_are_the_fault_of_the_broker_that_has_asked_for_most() -> None:
    """Its replies are dropped, and those for another one arrive."""
    attack = Congestion(BrokerOptions(max_bulk_bytes=2 * KIB * KIB))
    attack.change(make.client(9, node=1), broker=OTHER)
    attack.engine.full = True
    attack.answer(400 * KIB, 1, broker=OTHER, client=9)
    attack.answer(400 * KIB, *range(5))
    attack.flush()
    attack.engine.full = False
    attack.flush()
    messages = attack.engine.take(object)
    assert [each.broker for each in messages if isinstance(each, Ask)] == [THERE]
    replies = [each for each in messages if isinstance(each, Direct) and isinstance(each.frame, frames.Reply)]
    assert [each.broker for each in replies] == [OTHER]
    assert list(attack.mesh.sessions.names()) == [THERE, OTHER]


def test_messages_that_wait_for_a_mesh_have_a_limit() -> None:
    """The oldest of KEEP_LAST publishers are dropped and counted, as for a link."""
    attack = Congestion(BrokerOptions(max_link_bytes=64 * KIB))
    attack.change(make.subscription(8, "/t", node=1, qos={"depth": 1000}))
    attack.flush()
    attack.engine.full = True
    for number in range(100):
        attack.broker.send(attack.node, make.batch(attack.publisher, number, size=2 * KIB))
    attack.flush()
    assert attack.channel.outbox.held_bytes <= 64 * KIB
    assert attack.mesh.overflows.count == 0
    tally, _ = attack.broker.router.routes.tallies()
    assert tally.dropped > 60


def test_messages_that_must_not_be_dropped_have_a_limit() -> None:
    """They are abandoned and counted when all brokers begin anew; publishers that have left are removed."""
    attack = Congestion(BrokerOptions(max_link_bytes=64 * KIB))
    keep_all = make.publisher(20, "/all", qos=make.KEEP_ALL)
    publisher = attack.broker.publisher(attack.node, keep_all)
    attack.change(make.subscription(8, "/all", node=1, qos=make.KEEP_ALL, window=1000))
    attack.flush()
    attack.engine.full = True
    for number in range(50):
        attack.broker.send(attack.node, make.batch(publisher, number, size=2 * KIB))
    attack.broker.send(attack.node, frames.Undeclare(20))
    attack.flush()
    assert attack.channel.outbox.held_bytes == 0
    attack.engine.full = False
    attack.flush()
    messages = attack.engine.take(object)
    assert {each.broker for each in messages if isinstance(each, Ask)} == {THERE, OTHER}
    changes = [each.frame for each in messages if isinstance(each, Change)]
    assert changes[-1] == frames.Undeclare(publisher & 0xFFFF)
    assert not [each for each in messages if isinstance(each, Publish)]
    tally, _ = attack.broker.router.routes.tallies()
    assert tally.dropped + tally.abandoned == 50


def test_a_publisher_of_another_broker_that_ignores_credit_ends_no_link() -> None:
    """Its broker begins anew; the reader keeps what it was sent, and another broker goes on."""
    attack = Congestion(max_keep_all_queue_bytes=10 * KIB)
    attack.broker.send(attack.node, make.subscription(30, "/all", qos=make.KEEP_ALL, window=2))
    attack.change(make.publisher(7, "/all", node=1, qos=make.KEEP_ALL))
    attack.direct(attack.attached(7, attack.number_of(30)))
    for number in range(12):
        attack.mesh.receive(THERE, make.batch(THERE << 32 | 7, number, size=KIB))
    assert attack.asked() == [THERE]
    assert attack.broker.closed == {}
    assert len(attack.broker.read(attack.node, frames.Batch)) == 12


def test_a_remote_reader_that_grants_too_much_ends_no_link() -> None:
    """The brokers of the readers for which too much waits begin anew."""
    attack = Congestion(max_keep_all_queue_bytes=10 * KIB)
    publisher = attack.broker.publisher(attack.node, make.publisher(20, "/all", qos=make.KEEP_ALL))
    attack.change(make.subscription(8, "/all", node=1, qos=make.KEEP_ALL, window=1000))
    attack.broker.send(attack.node, frames.Credit(publisher, 1000, 2**30))
    attack.flush()
    attack.engine.full = True
    for number in range(12):
        attack.broker.send(attack.node, make.batch(publisher, number, size=KIB))
    assert attack.asked() == [THERE]
    assert attack.broker.closed == {}


def test_what_waits_for_a_mesh_counts_for_the_memory_of_the_broker() -> None:
    """First the oldest messages go, then all that waits, as for the link that holds most."""
    attack = Congestion()
    attack.engine.full = True
    attack.answer(KIB, *range(100))
    attack.flush()
    guard = MemoryGuard(64 * KIB, lambda: None, ReassemblyTotal(0), ByteTotal(), ByteTotal())
    guard.count(attack.channel)
    assert guard.held_bytes > 100 * KIB
    guard.relieve((), (attack.channel,))
    attack.flush()
    assert guard.held_bytes == 0
    assert attack.asked() == [THERE, OTHER]

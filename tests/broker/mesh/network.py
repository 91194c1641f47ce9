"""Brokers of one mesh without I/O: routers with outboxes, and a network that carries messages at once."""

from __future__ import annotations

from typing import TYPE_CHECKING

from broker.mesh.mesh import Mesh
from broker.mesh.messages import Ask, Change, Direct, Heartbeat, Message, Publish, Subscribe
from broker.mesh.slices import SLICE
from broker.routing.router import Router
from broker.routing.router_limits import RouterLimits
from proto.wire import frames
from proto.wire.codec import decode
from tests.broker.switch import Switch

if TYPE_CHECKING:
    from collections.abc import Iterator

    from broker.mesh.broker_session import MeshMemory


class MeshBroker(Switch):
    """A broker of a mesh: a switch whose router has a peer for the other brokers.

    Attributes:
        number: The broker's number.
        mesh: Its part of the mesh.
        topics: Topics that it wants of others.
        warnings: What it would log of other brokers.
    """

    def __init__(
        self, number: int, memory: MeshMemory | None = None, /, *, max_endpoints: int = 1000, **limits: int
    ) -> None:
        super().__init__(Router(key_base=number << 32, limits=RouterLimits(**limits)))
        self.number = number
        self.warnings: list[tuple[str, int, str]] = []
        self.mesh = Mesh(
            number,
            self.router,
            self.carry,
            lambda what, broker, text: self.warnings.append((what, broker, text)),
            max_endpoints=max_endpoints,
            name=f"broker{number}",
            memory=memory,
        )
        self.add(self.mesh.peer)
        self.topics: set[str] = set()

    def forward(self) -> None:
        """Let the mesh take what the router has for it."""
        self.report()
        self.mesh.wanted.update()
        self.mesh.overflows.handle()
        for frame in self.read_all(self.mesh.peer):
            self.mesh.sender.send(frame)


class Network:
    """Carries messages between brokers, in order.

    Args:
        count: How many brokers there are; their numbers begin with 1.

    Attributes:
        brokers: They, by number.
        cut: The numbers of those that are cut off.
        lose: The types of messages that get lost. Nobody notices, as when a route changes.
        lost: How many have been lost.
    """

    def __init__(self, count: int = 2) -> None:
        self.brokers = {number: MeshBroker(number) for number in range(1, count + 1)}
        self.cut: set[int] = set()
        self.lose: tuple[type[Message | frames.Frame], ...] = ()
        self.lost = 0
        for broker in self:
            self._introduce(broker.number)
        self.settle()

    def __iter__(self) -> Iterator[MeshBroker]:
        return iter(self.brokers.values())

    def settle(self) -> None:
        """Carry messages until there are none."""
        busy = True
        while busy:
            busy = False
            for broker in self:
                broker.forward()
                while broker.mesh.work.pending:
                    broker.mesh.work.go_on(SLICE)
                for message in broker.mesh.pop_messages():
                    busy = True
                    self.carry(broker, message)

    def carry(self, sender: MeshBroker, message: Message) -> None:
        """Carry one message to whom it concerns, unless its sender is cut off."""
        if isinstance(message, Subscribe):
            (sender.topics.add if message.wanted else sender.topics.discard)(message.topic)
            return
        if sender.number in self.cut:
            return
        if isinstance(message, self.lose) or isinstance(getattr(message, "frame", None), self.lose):
            self.lost += 1
            return
        for other in self:
            if other is not sender and other.number not in self.cut:
                _hand_over(sender, other, message)

    def beat(self) -> None:
        """Let every broker send a heartbeat, and carry on."""
        for broker in self:
            broker.mesh.send_heartbeat()
        self.settle()

    def partition(self, number: int) -> None:
        """Cut one broker off."""
        self.settle()
        self.cut.add(number)
        for other in self:
            if other.number != number:
                other.mesh.remove_broker(number)
                self.brokers[number].mesh.remove_broker(other.number)
        self.settle()

    def heal(self, number: int) -> None:
        """Connect a broker that was cut off."""
        self.cut.discard(number)
        self._introduce(number)
        self.settle()

    def _introduce(self, number: int) -> None:
        for other in self:
            if other.number != number:
                other.mesh.add_broker(number)
                self.brokers[number].mesh.add_broker(other.number)


def _hand_over(sender: MeshBroker, other: MeshBroker, message: Message) -> None:
    if isinstance(message, Publish):
        if message.topic in other.topics:
            frame = decode(message.raw)
            assert isinstance(frame, (frames.Batch, frames.Assert))
            other.mesh.receive(sender.number, frame, message.topic)
    elif isinstance(message, Ask):
        if message.broker == other.number:
            snapshot = other.mesh.snapshot(sender.number, message.epoch)
            sender.mesh.accept_snapshot(other.number, snapshot)
    elif isinstance(message, Heartbeat):
        other.mesh.accept_heartbeat(sender.number, message)
    elif isinstance(message, Change) or (isinstance(message, Direct) and message.broker == other.number):
        other.mesh.receive(sender.number, message)

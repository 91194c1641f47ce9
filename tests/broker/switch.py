"""A router with an outbox for each peer in place of a socket: frames in, frames out, no I/O."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, TypeVar

from broker.routing.router import Router
from proto import limits
from proto.queues.outbox import Outbox
from proto.wire import frames
from proto.wire.codec import decode, encode
from proto.wire.fragments import Reassembler
from tests.broker import frame_makers as make

if TYPE_CHECKING:
    from broker.access.rules import Principal
    from broker.routing.deliveries import Delivery
    from proto.errors import ErrorCode, ProtocolError

F = TypeVar("F")


class Switch:
    """Carries deliveries as the server does, and decodes what a peer would read.

    Attributes:
        router: The router under test.
        closed: Why the router had peers closed: peer to error code.
    """

    def __init__(self, router: Router | None = None) -> None:
        self.router = router or Router()
        self.closed: dict[int, int] = {}
        self._outboxes: dict[int, Outbox] = {}
        self._reassemblers: dict[int, Reassembler] = {}
        self.hellos = 0

    def join(
        self,
        node: str | None = None,
        *,
        instance: bytes | None = None,
        token: bytes = b"t" * 16,
        principal: Principal | None = None,
    ) -> int:
        """Connect a peer; with a name, declare that node under id 0 and forget the answer."""
        self.hellos += 1
        identity = instance or self.hellos.to_bytes(limits.INSTANCE_BYTES, "big")
        peer, deliveries = self.router.connect(identity, token, principal)
        self.add(peer)
        self.carry(deliveries)
        self.report()
        if node is not None:
            self.send(peer, frames.Node(0, node))
            accepted = self.read(peer, frames.Accepted)
            assert accepted == [frames.Accepted(0, 0)]
        return peer

    def add(self, peer: int) -> None:
        """Give an outbox to a peer that the router has made itself."""
        self._outboxes[peer] = Outbox()
        self._reassemblers[peer] = Reassembler()

    def use_outbox(self, peer: int, outbox: Outbox) -> None:
        """Let what the router sends to a peer wait in this outbox."""
        self._outboxes[peer] = outbox

    def send(self, peer: int, *sent: frames.Frame) -> None:
        """Let a peer send frames."""
        for frame in sent:
            self.carry(self.router.handle(peer, frame))
        self.report()

    def report(self) -> None:
        """Report what has changed, as the server does once in a loop turn."""
        self.carry(self.router.report())
        while self.router.graph.asked:
            self.carry(self.router.report())

    def publisher(self, peer: int, declaration: frames.Publisher) -> int:
        """Declare a publisher; return its broker-wide id."""
        self.send(peer, declaration)
        accepted = [frame for frame in self.read(peer, frames.Accepted) if frame.id == declaration.id]
        return accepted[0].number

    def check_stalls(self, *times: float) -> None:
        """Check for stalled subscriptions at these times."""
        for now in times:
            _, deliveries = self.router.check_stalls(now)
            self.carry(deliveries)

    def cut(self, peer: int) -> None:
        """A peer's connection is ending, and the router does not know yet."""
        self._outboxes.pop(peer, None)

    def leave(self, peer: int) -> None:
        """Break a peer's connection."""
        self.cut(peer)
        self.carry(self.router.disconnect(peer))
        self.report()

    def suspend(self, peer: int) -> None:
        """A peer has been silent for too long."""
        self.carry(self.router.suspend(peer))
        self.report()

    def set_principal(self, peer: int, principal: Principal, gone: Principal | None = None) -> None:
        """The access rules have changed, for one peer and for all users that are gone."""
        self.carry(self.router.set_principal(peer, principal))
        self.carry(self.router.drop_denied(lambda before: gone or before))

    def restore(self, peer: int) -> None:
        """A peer has been heard of again."""
        self.carry(self.router.restore(peer))
        self.report()

    def hold(self) -> None:
        """The broker stops: publishers may send no more."""
        self.carry(self.router.hold_publishers())
        self.report()

    def congest(self, peer: int) -> None:
        """Bring a peer's queues to their depth, as happens when its transport is full."""
        if peer in self._outboxes:
            self._outboxes[peer].trim()

    def read_all(self, peer: int, pieces: int = sys.maxsize) -> list[frames.Frame]:
        """Return what waits for a peer, in the order in which it would leave; fragments put together.

        At most so many pieces: frames or fragments.
        """
        read: list[frames.Frame] = []
        outbox = self._outboxes.get(peer) or Outbox()
        while pieces > 0 and (raw := b"".join(outbox.pop_frames(1)[0])):
            pieces -= 1
            assert len(raw) <= limits.MAX_FRAME_BYTES + limits.PREFIX_BYTES
            frame = decode(raw)
            if isinstance(frame, frames.Abort):
                self._reassemblers[peer].abort(frame)
                continue
            if isinstance(frame, frames.Fragment):
                whole = self._reassemblers[peer].add(frame)
                if whole is None:
                    continue
                frame = decode(whole)
            read.append(frame)
        outbox.trim()
        return read

    def read(self, peer: int, kind: type[F]) -> list[F]:
        """Return what waits for a peer, of one kind; the rest is forgotten."""
        return [frame for frame in self.read_all(peer) if isinstance(frame, kind)]

    def carry(self, deliveries: list[Delivery]) -> None:
        for delivery in deliveries:
            outbox = self._outboxes.get(delivery.peer)
            if outbox is None:
                delivery.lose()
                continue
            channel = _Channel(outbox)
            delivery.deliver(channel)
            if channel.error is not None:
                self.closed[delivery.peer] = channel.error
                self.cut(delivery.peer)


class _Channel:
    """A Recipient without a socket."""

    def __init__(self, outbox: Outbox) -> None:
        self.outbox = outbox
        self.error: ErrorCode | None = None

    def send(self, frame: frames.Frame) -> None:
        """Queue a control frame."""
        self.outbox.put_control(encode(frame))

    def fail(self, error: ProtocolError) -> None:
        """Keep the error's code."""
        self.error = error.code


def talk(switch: Switch, *, qos: frames.Options | None = None) -> tuple[int, int, int]:
    """Join a talker with a publisher and a listener with a subscription on /t; nothing waits any more.

    Returns:
        The two peers, and the publisher's broker-wide id.
    """
    talker, listener = switch.join("/talker"), switch.join("/listener")
    switch.send(listener, make.subscription(1, qos=qos))
    number = switch.publisher(talker, make.publisher(1, qos=qos))
    switch.read_all(talker)
    switch.read_all(listener)
    return talker, listener, number


class ManualSwitch(Switch):
    """A switch whose router reports only when the test says that a loop turn ends."""

    def send(self, peer: int, *sent: frames.Frame) -> None:
        """Let a peer send frames in one loop turn."""
        for frame in sent:
            self.carry(self.router.handle(peer, frame))

    def publisher(self, peer: int, declaration: frames.Publisher) -> int:
        """Declare a publisher; return its broker-wide id."""
        number = super().publisher(peer, declaration)
        self.report()
        return number

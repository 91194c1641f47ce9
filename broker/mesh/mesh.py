"""One graph's part of the mesh, pure: other brokers as one peer of the router.

The router does with the peer what it does with any: it matches, counts, queues, grants credit and keeps
latched messages. Nothing that comes from one broker goes on to another: the engine (Zenoh) does that.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from broker.mesh.broker_session import BrokerSession
from broker.mesh.calls import MeshCalls
from broker.mesh.exports import MeshExports
from broker.mesh.imports import MeshImports
from broker.mesh.incoming import MeshReceiver
from broker.mesh.messages import Ask, Change, Direct, Heartbeat, Message, Snapshot, Subscribe
from broker.mesh.outgoing import MeshSender
from broker.mesh.queries import MeshQueries
from proto.errors import ErrorCode, ProtocolError
from proto.identity import VERSION
from proto.limits import MAX_U32

if TYPE_CHECKING:
    from collections.abc import Callable

    from broker.deliveries import Delivery
    from broker.mesh.messages import Received
    from broker.router import Router
    from proto.frames import Frame


def _ignore(*_: object) -> None:
    """Take a line for the log, and do nothing."""


MAX_EPOCH: Final = 2**63
"""Epochs that brokers reach are far smaller."""

MAX_BROKERS: Final = 1000
"""Other brokers. Further ones are ignored."""

MAX_EPOCHS: Final = 10_000
"""Brokers, gone ones included, whose last epoch is remembered."""


class Mesh:
    """One graph's part of the mesh.

    A broker that breaks a rule is rejected: its endpoints are removed, and it is ignored until its presence
    ends.

    Args:
        number: This broker's number.
        router: The graph's router.
        deliver: Takes what the router returns; a `report` must follow.
        warn: For logs. Called with what has happened (for all such lines the same), a broker, and why.
        max_endpoints: Nodes and endpoints that one other broker may have. Others are refused.
        name: This broker's name for people.

    Attributes:
        peer: The id of the router's peer for the mesh. What waits in its outbox goes to `sender`.
        sender: Takes frames from the router.
        queries: What brokers ask each other.
        resets: How often messages to or from a broker were lost, so that the exchange has begun anew.
        ignored: Messages of brokers that are not alive or rejected, of an earlier epoch, or too many before a
            snapshot.
        rejected: How many brokers were rejected.
    """

    def __init__(
        self,
        number: int,
        router: Router,
        deliver: Callable[[list[Delivery]], None],
        warn: Callable[[str, int, str], None] = _ignore,
        *,
        max_endpoints: int = 100_000,
        name: str = "",
    ) -> None:
        self._number = number
        self._name = name
        self._router = router
        self._out: list[Message] = []
        self._touched: set[str] = set()
        """Topics whose subscriptions have changed."""
        self._wanted: set[str] = set()
        """The topics whose messages are wanted of other brokers."""
        self._sessions: dict[int, BrokerSession] = {}
        self._rejected: set[int] = set()
        """Brokers that are alive and ignored."""
        self._epochs: dict[int, int] = {}
        """By broker, the epoch of the last exchange with it, also if it is gone."""
        self._warn = warn
        self.resets = self.ignored = self.rejected = 0
        self.peer, _ = router.connect(b"", b"", mesh=True)
        self._calls = calls = MeshCalls()
        self._exports = router.declarations.exports = MeshExports(self._change, self._touched.add, self.peer)
        self._imports = MeshImports(
            router,
            self.peer,
            calls,
            deliver,
            lambda broker, text: warn("refused endpoints of brokers", broker, text),
            max_endpoints=max_endpoints,
        )
        self.sender = MeshSender(
            router,
            self._exports,
            self._imports,
            calls,
            peer=self.peer,
            publish=self._out.append,
            direct=self._direct,
        )
        queries = self.queries = MeshQueries(router, self._exports, self._direct, deliver)
        router.declarations.request_definition = queries.request
        self._receiver = MeshReceiver(
            router,
            self.peer,
            self._imports,
            calls,
            deliver=deliver,
            direct=self._direct,
            others=queries.handlers,
        )

    # What goes out

    def take(self) -> list[Message]:
        """Return the messages to send, in order."""
        out = self._out[:]
        self._out.clear()
        return out

    def snapshot(self, broker: int, epoch: int) -> Snapshot:
        """Return this broker's endpoints.

        Args:
            broker: Who has asked; 0 for a program that is none.
            epoch: As in its request.
        """
        session = self._sessions.get(broker)
        if session is not None and epoch <= MAX_EPOCH:
            self._agree(broker, session, epoch)
        version, declarations = self._exports.version, self._exports.declarations()
        epoch = 0 if session is None else session.epoch
        return Snapshot(epoch, version, declarations, self._name, VERSION)

    def beat(self) -> None:
        """Send a heartbeat, if there is another broker."""
        self.queries.beat()
        if self._sessions:
            sent = {broker: (each.epoch, each.sent) for broker, each in self._sessions.items()}
            self._out.append(Heartbeat(self._exports.version, sent))

    def update_wanted(self) -> None:
        """Subscribe to the topics to which this broker's nodes subscribe.

        Whether there are publishers elsewhere makes no difference: a publisher that is told of a subscription
        may send at once.
        """
        for topic in self._touched:
            record = self._router.topics.by_name.get(topic)
            wanted = record is not None and not all(each.peer.mesh for each in record.subscriptions.values())
            if wanted != (topic in self._wanted):
                (self._wanted.add if wanted else self._wanted.discard)(topic)
                self._out.append(Subscribe(topic, wanted=wanted))
        self._touched.clear()

    def _change(self, change: Change) -> None:
        self.update_wanted()  # before others learn of the subscription
        self._out.append(change)

    def _direct(self, broker: int, frame: Frame, endpoint: int = 0) -> None:
        session = self._sessions.get(broker)
        if session is not None:
            session.sent += 1
            self._out.append(Direct(broker, session.epoch, session.sent, endpoint, frame))

    # What comes in

    def names(self) -> dict[int, tuple[str, str]]:
        """Return the names and versions of the other brokers that are alive, by their numbers."""
        return {number: (each.name, each.software) for number, each in self._sessions.items()}

    def counts(self) -> dict[str, int]:
        """Return how often something was lost or not taken, by the names of `MeshStats`."""
        ignored = self.ignored + self._receiver.unexpected
        return {"ignored": ignored, "refused": self._imports.refused, "resets": self.resets}

    def add_broker(self, broker: int) -> None:
        """Ask a broker that is alive for its endpoints."""
        if broker in self._sessions or broker in self._rejected:
            return
        if not 0 < broker <= MAX_U32 or broker == self._number or len(self._sessions) >= MAX_BROKERS:
            self._warn("ignored brokers", broker, f"no valid number, or more than {MAX_BROKERS} brokers")
            return
        session = self._sessions[broker] = BrokerSession(0)
        self._begin(broker, session, self._epochs.pop(broker, 0) + 1)
        if len(self._epochs) > MAX_EPOCHS:
            del self._epochs[next(iter(self._epochs))]
        self._ask(broker, session)

    def remove_broker(self, broker: int) -> None:
        """Remove a broker that is gone, with its endpoints; calls to it fail."""
        self._rejected.discard(broker)
        if self._sessions.pop(broker, None) is not None:
            self._imports.remove_broker(broker)
            self.queries.remove_broker(broker)

    def reject(self, broker: int, reason: str) -> None:
        """Remove a broker that has broken a rule, and ignore it until its presence ends.

        Args:
            broker: The broker.
            reason: What it has done, for the log.
        """
        if broker in self._sessions:
            self.remove_broker(broker)
            self._rejected.add(broker)
            self.rejected += 1
            self._warn("rejected brokers", broker, reason)

    def take_snapshot(self, broker: int, snapshot: Snapshot | None) -> None:
        """Replace what is known of a broker.

        Args:
            broker: The broker.
            snapshot: Its answer; None if there was none.
        """
        session = self._sessions.get(broker)
        if session is None or not session.asked:
            return
        session.asked = False
        if snapshot is None:
            self._ask(broker, session)
            return
        session.name, session.software = snapshot.name, snapshot.software
        try:
            self._agree(broker, session, snapshot.epoch)
            if session.asked:
                return
            self._imports.take_snapshot(broker, snapshot)
        except ProtocolError as error:
            self.reject(broker, str(error))
            return
        session.ready = True
        session.asked = True  # if changes are missing again, the next heartbeat has it asked
        for message in session.take_waiting():
            self.receive(broker, message)
        session.asked = False

    def take_heartbeat(self, broker: int, heartbeat: Heartbeat) -> None:
        """Begin anew if messages have been lost."""
        session = self._sessions.get(broker)
        if session is None:
            self.ignored += 1
            return
        epoch, sent = heartbeat.sent.get(self._number, (0, 0))
        try:
            self._agree(broker, session, epoch)
        except ProtocolError as error:
            self.reject(broker, str(error))
            return
        if not session.ready:
            self._ask(broker, session)
        elif epoch == session.epoch and sent > session.received:
            self._reset(broker, session, epoch + 1)
        elif heartbeat.version > self._imports.version(broker):
            self._ask_again(broker, session)

    def receive(self, broker: int, message: Received) -> None:
        """Take a message.

        Args:
            broker: The sender.
            message: What it has sent to this broker or to all, in its order.
        """
        session = self._sessions.get(broker)
        if session is None:
            self.ignored += 1
            return
        try:
            self._receive(broker, session, message)
        except ProtocolError as error:
            self.reject(broker, str(error))

    def _receive(self, broker: int, session: BrokerSession, message: Received) -> None:
        if isinstance(message, Direct):
            self._agree(broker, session, message.epoch)
        if not session.ready:
            self.ignored += not session.wait(message)
        elif isinstance(message, Change):
            if not self._imports.take_change(broker, message):
                self._ask_again(broker, session)
                session.wait(message)
        elif isinstance(message, Direct):
            self._receive_direct(broker, session, message)
        else:
            self._receiver.published(broker, message)

    def _receive_direct(self, broker: int, session: BrokerSession, message: Direct) -> None:
        if message.epoch < session.epoch or message.number <= session.received:
            self.ignored += 1
        elif message.number > session.received + 1:
            self._reset(broker, session, message.epoch + 1)
        else:
            session.received += 1
            self._receiver.received(broker, message)

    def _ask_again(self, broker: int, session: BrokerSession) -> None:
        """Ask for a snapshot because changes are missing; what follows waits for it."""
        session.ready = False
        self._ask(broker, session)

    def _ask(self, broker: int, session: BrokerSession) -> None:
        if not session.asked:
            session.asked = True
            self._out.append(Ask(broker, session.epoch))

    def _agree(self, broker: int, session: BrokerSession, epoch: int) -> None:
        """Begin the epoch of the other broker if it is greater.

        Raises:
            ProtocolError: It is too great.
        """
        if epoch > MAX_EPOCH:
            raise ProtocolError(ErrorCode.MALFORMED, f"there is no epoch {epoch}")
        if epoch > session.epoch:
            if session.sent or session.received:
                self._reset(broker, session, epoch)
            else:
                session.epoch = self._epochs[broker] = epoch

    def _reset(self, broker: int, session: BrokerSession, epoch: int) -> None:
        """Forget a broker's endpoints and ask for them again, because messages were lost."""
        self.resets += 1
        self._imports.remove_broker(broker)
        self.queries.remove_broker(broker)
        self._begin(broker, session, epoch)
        self._ask(broker, session)
        self.beat()

    def _begin(self, broker: int, session: BrokerSession, epoch: int) -> None:
        session.begin(epoch)
        self._epochs[broker] = epoch

"""One graph's part of the mesh, pure: other brokers as one peer of the router.

The router does with the peer what it does with any: it matches, counts, queues, grants credit and keeps
latched messages. Nothing that comes from one broker goes on to another: the engine (Zenoh) does that.
"""

from __future__ import annotations

from collections import Counter
from functools import partial
from itertools import islice
from typing import TYPE_CHECKING, Final

from broker.mesh.broker_session import (
    MAX_BROKERS,
    MAX_UNANSWERED,
    MAX_UNHEARD_FIRST,
    BrokerSessions,
    MeshMemory,
)
from broker.mesh.calls import MeshCalls
from broker.mesh.exports import MeshExports, WantedTopics
from broker.mesh.held_publishers import HeldPublishers, has_lost, stuck_publishers
from broker.mesh.imports import MeshImports
from broker.mesh.messages import Ask, Change, Direct, Message, Snapshot
from broker.mesh.overflows import MeshOverflows
from broker.mesh.queries import MeshQueries
from broker.mesh.receiver import MeshReceiver
from broker.mesh.sender import MeshSender
from broker.mesh.slices import SlicedWork
from broker.mesh.standing import Standings
from proto.errors import ErrorCode, ProtocolError
from proto.limits import MAX_U32
from proto.wire.identity import VERSION

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from broker.access.rules import Rights
    from broker.mesh.broker_session import BrokerSession
    from broker.mesh.messages import Heartbeat, Received
    from broker.routing.deliveries import Delivery
    from broker.routing.router import Router


def _ignore(*_: object) -> None:
    """Log nothing."""


REFUSED: Final = "refused an endpoint of"
"""Text of the warning about a refused endpoint; the other broker's name follows."""

UNCHANGED: Final = 10
"""Declarations of a snapshot that count as one change, even if the endpoints are known."""

MAX_ANSWERS: Final = 5
"""Snapshots that one broker gets between two heartbeats. It needs one when it joins, or lost something."""

MAX_ANSWERS_TO_STRANGERS: Final = 20
"""The same for all requests together that do not show who asks: brokers of earlier versions, and programs."""

MAX_ASKERS: Final = 10_000
"""Brokers, unknown ones included, that are known to have asked for the snapshot."""

MAX_EPOCH: Final = 2**63
"""A greater epoch is refused. Brokers count epochs up from 1, so that they never get near it."""


class Mesh:
    """One graph's part of the mesh.

    A broker that breaks a rule is rejected: its endpoints are removed, and it is ignored for a while, longer
    each time, or until its presence ends.

    A broker counts as one when it has answered. Whoever announces brokers that never do costs little, and
    keeps none out.

    Args:
        number: This broker's number.
        router: The graph's router.
        deliver: Takes what the router returns; a `report` must follow.
        warn: For logs. Called with what was done ("rejected"; "the broker NAME" follows), a broker, and why.
        max_endpoints: Nodes and endpoints that one other broker may have; more are refused.
        name: This broker's name in lists and logs.
        memory: Counts what waits for other brokers in all graphs; None to count only that of this one.

    Attributes:
        peer: The id of the router's peer for the mesh. What waits in its outbox goes to `sender`.
        sender: Takes frames from the router.
        queries: What brokers ask each other.
        sessions: The sessions with the brokers that are alive.
        out: Messages to send, for `pop_messages`.
        wanted: The topics whose messages are wanted of them.
        overflows: Resets the sessions with brokers for which too much waits.
        work: What is left to do of long work; whoever uses a mesh calls `go_on` while `busy`.
        resets: How often a session was reset, mostly because messages to or from the broker were lost.
        ignored: Messages of brokers that are not alive or rejected, of an earlier epoch, or too many before a
            snapshot.
        rejected: How many brokers were rejected.
        limited: How often a limit was reached: brokers given up that did not answer, changes that came too
            fast, snapshots that were too large together, queries that were not answered.
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
        memory: MeshMemory | None = None,
    ) -> None:
        self._number, self._name = number, name
        self._router = router
        self._deliver, self._warn = deliver, warn
        self.out: list[Message] = []
        self.wanted = WantedTopics(router, self.out.append)
        self.sessions = BrokerSessions(self.out.append, memory or MeshMemory())
        self._snapshot_sent_to: dict[int, None] = {}
        """Brokers that have asked for the snapshot, in this epoch: they can take what is sent to them."""
        self._answers = Counter[int]()
        """By broker, its requests since the last heartbeat; 0 for strangers."""
        self._asks: dict[int, None] = {}
        """Brokers to ask next."""
        self._standings = Standings()
        self.work = SlicedWork()
        self.resets = self.ignored = self.rejected = self.limited = 0
        self.peer, _ = router.connect(b"", b"", mesh=True)
        self._held = HeldPublishers(router, self.peer)
        self._calls = calls = MeshCalls()
        publish, direct = self.out.append, self.sessions.direct
        exports = self._exports = MeshExports(self._change, self.wanted.touch, self.peer)
        imports = self._imports = MeshImports(
            router,
            self.peer,
            calls,
            deliver,
            partial(warn, REFUSED),
            count_change=self._standings.count_changes,
            max_endpoints=max_endpoints,
        )
        self.sender = MeshSender(
            router, exports, imports, calls, peer=self.peer, publish=publish, direct=direct
        )
        queries = self.queries = MeshQueries(router, exports, direct, deliver)
        self._receiver = MeshReceiver(
            router, self.peer, imports, calls, deliver=deliver, direct=direct, others=queries.handlers
        )
        self.overflows = MeshOverflows(self.sessions, exports, self._reset, warn)
        router.routes.report_mesh = self.overflows.note
        router.declarations.exports = exports
        router.declarations.request_definition = queries.request

    def set_rights(self, imports: Rights | None, exports: Rights | None) -> None:
        """Apply the access rules' rights of other brokers.

        Args:
            imports: What their nodes may do here; None for everything. If it changes, the sessions with
                all brokers are reset.
            exports: What they may know of the nodes here; likewise.
        """
        if imports != self._imports.rights:
            self._imports.rights = imports
            for broker, session in self.sessions.items():
                if session.answered:
                    self._reset(broker, session)
        if (imports, exports) != (self._exports.import_rights, self._exports.rights):
            self._exports.import_rights, self._exports.rights = imports, exports
            self._router.declarations.renew_exports(self._exports)
            self._deliver(self._router.report())

    # What goes out

    def pop_messages(self, asks: int = MAX_ASKERS) -> list[Message]:
        """Return the messages to send, in order.

        Args:
            asks: The most requests for snapshots among them.
        """
        for broker in tuple(islice(self._asks, asks)):
            del self._asks[broker]
            session = self.sessions.get(broker)
            if session is not None and session.asked:
                self.out.append(Ask(broker, session.epoch))
        out = self.out[:]
        self.out.clear()
        return out

    @property
    def busy(self) -> bool:
        """Whether there is work to go on with in a later loop turn."""
        return self.work.pending or bool(self._asks)

    def admits_query(self, broker: int) -> bool:
        """Count a request for the snapshot; return whether to answer it.

        Args:
            broker: The broker that certainly asks; 0 for anybody else.
        """
        self._answers[broker] += 1
        admitted = self._answers[broker] <= (MAX_ANSWERS if broker else MAX_ANSWERS_TO_STRANGERS)
        self.limited += not admitted
        return admitted

    def snapshot(self, broker: int, epoch: int) -> Snapshot:
        """Return this broker's endpoints.

        Args:
            broker: The broker that asks; 0 for another program.
            epoch: As in its request.
        """
        # An empty answer, not none: it need not ask again and again, and learns nothing.
        if self._standings.is_banned(broker):
            return Snapshot(0, 0, (), self._name, VERSION)
        session = self.sessions.get(broker)
        if session is not None and epoch <= MAX_EPOCH:
            self._agree(broker, session, epoch)
        version, declarations = self._exports.version, self._exports.declarations()
        own_epoch = 0 if session is None else session.epoch
        own = Snapshot(own_epoch, version, declarations, self._name, VERSION, sourced=True)
        if broker:
            self._snapshot_sent_to[broker] = None
            if len(self._snapshot_sent_to) > MAX_ASKERS:
                del self._snapshot_sent_to[next(iter(self._snapshot_sent_to))]
        # Its own snapshot came before it had asked for this one. Now it knows the endpoints here, so that
        # what follows from matching with its own can be sent.
        if session is not None and session.snapshot is not None:
            self._import(broker, session)
        return own

    def send_heartbeat(self) -> None:
        """Count a second: do what is due by then, and send a heartbeat, if there is another broker."""
        self.queries.expire()
        self._answers.clear()
        self.sessions.memory.expecting = False
        for broker in self._standings.beat():
            self.add_broker(broker, announced=self.sessions.given_up.get(broker, True))
        for broker, session in self.sessions.items():
            if session.is_silent():
                self._forget(broker)
                self.sessions.give_up(broker, session)
            elif session.is_snapshot_overdue():
                self._import(broker, session)
            elif session.is_due():
                self._ask(broker, session)
        self._send_heartbeat()

    def _send_heartbeat(self) -> None:
        self._exports.forget_emptied()
        if self.sessions or self._standings.any_banned:
            self.out.append(self.sessions.heartbeat(self._exports.version, self._held.next_sequences()))

    def _change(self, change: Change) -> None:
        self.wanted.update()  # before others learn of the subscription
        self.out.append(change)

    # What comes in

    def counts(self) -> dict[str, int]:
        """Return how often something was lost or not taken, by the names of `MeshStats`."""
        ignored = self.ignored + self.sessions.ignored + self._receiver.unexpected
        return {
            "ignored": ignored,
            "refused": self._imports.refused,
            "resets": self.resets,
            "rejected": self.rejected,
            "limited": self.limited,
            "overflows": self.overflows.count,
        }

    def add_broker(self, broker: int, *, announced: bool = True, heard: bool = False) -> None:
        """Ask a broker that is alive for its endpoints.

        Args:
            broker: The broker.
            announced: Whether `remove_broker` will follow when it goes. If not, its heartbeats show that.
            heard: Whether a heartbeat of it has come, so that it is asked even if many do not answer.
        """
        session = self.sessions.get(broker)
        if session is not None:
            session.announced |= announced
        if session is not None or self._standings.is_banned(broker):
            return
        if not 0 < broker <= MAX_U32 or broker == self._number:
            self._warn("ignored", broker, "it has no valid number")
            return
        self.sessions.given_up.pop(broker, None)
        session = self.sessions.add(broker)
        session.announced = announced
        if self.sessions.crowded and not heard:
            session.pause = MAX_UNHEARD_FIRST
        else:
            self._ask(broker, session)
        surplus = self.sessions.surplus()
        if surplus is not None:
            self.limited += 1
            self._warn("gave up", surplus, f"more than {MAX_UNANSWERED} brokers do not answer")
            given_up = self.sessions.get(surplus) or session
            self._forget(surplus)
            self.sessions.give_up(surplus, given_up)

    def remove_broker(self, broker: int) -> None:
        """Remove a broker that is gone, with its endpoints; calls to it fail."""
        # Its presence has ended, so that it may begin again: the operator who restarts a faulty broker need
        # not restart others.
        self._standings.end_ban(broker)
        self.sessions.given_up.pop(broker, None)
        self._forget(broker)

    def _forget(self, broker: int) -> None:
        self._snapshot_sent_to.pop(broker, None)
        self._asks.pop(broker, None)
        if self.sessions.remove(broker):
            self.work.start(broker, self._imports.remove_broker(broker))
            self.queries.remove_broker(broker)

    def reject(self, broker: int, reason: str) -> None:
        """Remove a broker that has broken a rule, and ignore it for a while, or until its presence ends.

        Args:
            broker: The broker.
            reason: What it has done, for the log.
        """
        session = self.sessions.get(broker)
        if session is not None:
            self._warn("rejected", broker, reason)  # while its name is known
            self._standings.ban(broker)
            self._forget(broker)
            if not session.announced:
                self.sessions.give_up(broker, session)
            self.rejected += 1

    def accept_snapshot(self, broker: int, snapshot: Snapshot | None) -> None:
        """Replace what is known of a broker.

        Args:
            broker: The broker.
            snapshot: Its answer; None if there was none.
        """
        session = self.sessions.get(broker)
        if session is None or not session.asked:
            return
        session.asked = False
        if snapshot is None:
            if self.sessions.fail(broker, session):
                self._ask(broker, session)
            return
        if not session.answered and self.sessions.full:
            self.limited += 1
            self._warn("ignored", broker, f"there are {MAX_BROKERS} brokers")
            self.sessions.postpone(broker, session)
            return
        self.sessions.answer(broker, session)
        session.sourced = snapshot.sourced
        session.name, session.software = snapshot.name, snapshot.software
        try:
            self._agree(broker, session, snapshot.epoch)
        except ProtocolError as error:
            self.reject(broker, str(error))
            return
        # `_agree` has begun another epoch, and asked again: this snapshot is of the earlier one.
        if session.asked:
            return
        session.keep(snapshot)
        if broker in self._snapshot_sent_to:
            self._import(broker, session)
        else:
            self.ignored += self.sessions.memory.shed()

    def _import(self, broker: int, session: BrokerSession) -> None:
        """Take a broker's endpoints, once it has the declarations of what will be sent to it."""
        snapshot = session.pop_snapshot()
        assert snapshot is not None
        # Also to compare what has not changed takes time.
        self._standings.count_changes(broker, len(snapshot.declarations) // UNCHANGED)
        if not self.sessions.memory.begin_import(snapshot):
            self.limited += 1  # it is asked again at a heartbeat, when there is space
            session.postponed = snapshot.size
            self._warn("postponed", broker, "the endpoints of others take too much memory")
            return
        session.importing, session.postponed = True, 0
        self.work.start(broker, self._import_all(broker, session, snapshot))

    def _import_all(self, broker: int, session: BrokerSession, snapshot: Snapshot) -> Iterator[None]:
        """Take a broker's endpoints and what it has sent meanwhile, one at a step."""
        epoch = session.epoch
        try:
            if self.sessions.get(broker) is session and session.importing:
                for _ in self._imports.accept_snapshot(broker, snapshot):
                    yield
                    # It has gone meanwhile, or another epoch has begun: this snapshot counts no more.
                    if self.sessions.get(broker) is not session or session.epoch != epoch:
                        return
            # In the order in which they came. If one of them resets the session, the rest is dropped.
            while session.waiting and session.importing and session.epoch == epoch:
                message, topic = session.next_waiting()
                if not self._handle(broker, session, message, topic):
                    session.importing = False
                    session.wait_again(message, topic)  # the next heartbeat has it asked
                    return
                yield
        except ProtocolError as error:
            self.reject(broker, str(error))
            return
        finally:
            self.sessions.memory.importing -= snapshot.size
        if session.importing and session.epoch == epoch:
            session.importing, session.ready = False, True

    def accept_heartbeat(self, broker: int, heartbeat: Heartbeat) -> None:
        """Reset the session if messages have been lost."""
        session = self.sessions.get(broker)
        if session is None:
            self.ignored += 1
            # It was given up and is there, or its token was lost on a route that has just begun.
            if broker in self.sessions.given_up or not self.sessions.has_seen(broker):
                self.add_broker(broker, announced=self.sessions.given_up.get(broker, False), heard=True)
            return
        session.silent = 0
        epoch, sent = heartbeat.sent.get(self._number, (0, 0))
        try:
            self._agree(broker, session, epoch)
        except ProtocolError as error:
            self.reject(broker, str(error))
            return
        if not session.ready:
            # Its heartbeat shows that it can be reached. A single request follows from many heartbeats.
            if session.snapshot is None and not (session.importing or session.nudged):
                session.nudged = True
                self._ask(broker, session)
        # A broker names all to which it has a session. Not to be named means that it has forgotten this one.
        elif session.sent and self._number not in heartbeat.sent:
            self._reset(broker, session)  # it does not take messages of this broker
        elif epoch == session.epoch and sent > session.received:
            self._reset(broker, session, epoch + 1)
        elif heartbeat.version > self._imports.version(broker):
            session.ready = False  # what follows waits for the snapshot
            self._ask(broker, session)
        elif has_lost(self._router, broker, heartbeat.held) or session.is_stuck(
            stuck_publishers(self._router, self._number, broker, heartbeat.held)
        ):
            self._reset(broker, session, epoch + 1)

    def receive(self, broker: int, message: Received, topic: str = "") -> None:
        """Take a message.

        Args:
            broker: The sender.
            message: What it has sent to this broker or to all, in its order.
            topic: To whose key it was sent; "" for other messages.
        """
        session = self.sessions.get(broker)
        if session is None:
            self.ignored += 1
            return
        try:
            self._receive(broker, session, message, topic)
        except ProtocolError as error:
            self.reject(broker, str(error))

    def _receive(self, broker: int, session: BrokerSession, message: Received, topic: str) -> None:
        if isinstance(message, Direct):
            self._agree(broker, session, message.epoch)
        # Before the snapshot nobody knows whether a message is in it already. The wait is limited: a broker
        # that never answers would fill it.
        if not session.ready:
            self.ignored += not session.wait(message, topic)
            self.ignored += self.sessions.memory.shed()
            return
        too_fast = isinstance(message, Change) and not self._standings.may_change(broker)
        if too_fast:
            self.limited += 1
            self._warn("slowed down", broker, "its endpoints come and go too fast")
        if too_fast or not self._handle(broker, session, message, topic):
            session.ready = False  # what follows waits for a snapshot
            self._ask(broker, session)
            session.wait(message, topic)

    def _handle(self, broker: int, session: BrokerSession, message: Received, topic: str) -> bool:
        """Take a message; return False if a snapshot is needed first."""
        if isinstance(message, Change):
            return self._imports.accept_change(broker, message)
        if isinstance(message, Direct):
            self._receive_direct(broker, session, message)
        else:
            self._receiver.published(broker, message, topic)
        return True

    def _receive_direct(self, broker: int, session: BrokerSession, message: Direct) -> None:
        if message.epoch < session.epoch or message.number <= session.received:
            self.ignored += 1
        elif message.number > session.received + 1:
            self._reset(broker, session, message.epoch + 1)
        else:
            session.received += 1
            self._receiver.received(broker, message)

    def _ask(self, broker: int, session: BrokerSession) -> None:
        # A broker that changes too much is asked when it may change again.
        if session.asked or not self._standings.may_change(broker):
            return
        if self.sessions.expect(broker, session):
            session.asked = True
            self._asks[broker] = None

    def _agree(self, broker: int, session: BrokerSession, epoch: int) -> None:
        """Begin the epoch of the other broker if it is greater.

        Raises:
            ProtocolError: It is too great.
        """
        if epoch > MAX_EPOCH:
            raise ProtocolError(ErrorCode.MALFORMED, f"there is no epoch {epoch}")
        if epoch > session.epoch:
            # An import of the earlier epoch ends without having made the session ready: a new one is needed.
            if session.sent or session.received or session.ready or session.importing:
                self._reset(broker, session, epoch)
            else:
                self.sessions.rename(broker, session, epoch)

    def _reset(self, broker: int, session: BrokerSession, epoch: int = 0) -> None:
        """Forget a broker's endpoints and ask for them again; begin this epoch, or else the next one."""
        self.resets += 1
        self._snapshot_sent_to.pop(broker, None)
        self.sessions.reset(broker, session, epoch or session.epoch + 1)
        self.work.start(broker, self._imports.remove_broker(broker))
        self.queries.remove_broker(broker)
        self._ask(broker, session)
        self._send_heartbeat()

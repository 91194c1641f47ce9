"""The router: takes frames, returns deliveries. Pure: no I/O, no clock, no randomness.

One router is one graph. It knows the peers and gives each frame to the part that handles it.
"""

from __future__ import annotations

from itertools import count
from typing import TYPE_CHECKING, Any, Final, get_args

from broker.routing.calls import CallFrames, Calls
from broker.routing.declarations import Declarations
from broker.routing.deliveries import Close, Delivery, Send
from broker.routing.graph import Graph, WatchCount
from broker.routing.mirrored import Forward, Mirror, Open
from broker.routing.notices import Assertions, Notices
from broker.routing.records import Endpoint, NodeRecord, Peer
from broker.routing.refusals import Refusals
from broker.routing.router_limits import RouterLimits
from broker.routing.routes import Routes
from broker.routing.services import Services
from broker.routing.stalls import Stalls
from broker.routing.topics import Topics
from proto.errors import ErrorCode, ProtocolError
from proto.wire import frames
from proto.wire.codes import NoticeKind
from proto.wire.fragments import ByteTotal
from proto.wire.references import SharedBatch

if TYPE_CHECKING:
    from collections.abc import Callable

    from broker.access.rules import Principal
    from broker.routing.mirrored import Mirrored
    from proto.wire.frames import Frame

REPORTED: Final = frozenset({*get_args(frames.Declaration), frames.Assert, frames.Watch, frames.Unwatch})
"""Frames that change what `Router.report` returns."""

DEFAULT_LIMITS: Final = RouterLimits()

WAS_SILENT: Final = "This node was silent for the keepalive limit; until now the graph was without it"


def _ignore(*_: object) -> None:
    """Take a report, and do nothing."""


class Router:
    """One graph: its peers, and everything they have declared.

    Args:
        domain: The graph's number.
        limits: What its peers may have and send.
        watches: The kept watches of all graphs of the broker, and their limit; None for its own.
        report: For logs. Called with each endpoint and None when it is declared, and with the reason when it
            is removed; "" if its connection has ended.
        report_refusal: For logs. Called with a peer, what of it a limit has refused (plural), and why.
        latched: Counts the bytes of latched messages, possibly of several graphs; None for its own.
        memory_full: Returns whether large calls are refused because the broker holds too much.
        key_base: The keys of its endpoints are greater, so that they differ from those of other brokers.

    Attributes:
        domain: The same number.
        relied_on: Ids of the peers to check closely: others are matched with them, wait for their answers, or
            have asked for the graph.
        refusals: What limits have refused.
        routes, topics, calls, services, graph, declarations: The parts.
    """

    def __init__(
        self,
        *,
        domain: int = 0,
        limits: RouterLimits = DEFAULT_LIMITS,
        watches: WatchCount | None = None,
        report: Callable[[Endpoint, str | None], None] = _ignore,
        report_refusal: Callable[[Peer, str, str], None] = _ignore,
        latched: ByteTotal | None = None,
        memory_full: Callable[[], bool] = bool,  # bool() is False
        key_base: int = 0,
    ) -> None:
        self.domain = domain
        self.relied_on: set[int] = set()
        self._latched = latched or ByteTotal()
        self._out: list[Delivery] = []
        self._peer_ids = count(1)
        self._peers: dict[int, Peer] = {}
        self._instances: dict[bytes, Peer] = {}
        self._notices = Notices(self._emit)
        stalls = Stalls(stall_sec=limits.keep_all_stall_sec, max_sec=limits.keep_all_stall_max_sec)
        self.routes = Routes(self._emit, limits)
        self._assertions = Assertions(self._emit, self.routes)
        self.topics = Topics(self._emit, self._notices, self.routes, stalls)
        self.calls = Calls(self._emit, limits, memory_full, report_refusal)
        self.services = Services(self._notices, self.calls)
        self.refusals = Refusals(report_refusal)
        self.graph = Graph(self._emit, watches or WatchCount(), self.refusals)
        self.declarations = Declarations(
            self._emit,
            limits=limits,
            refusals=self.refusals,
            topics=self.topics,
            services=self.services,
            graph=self.graph,
            replace_peer=self._replace_peer,
            report=report,
            key_base=key_base,
        )
        self._handlers = self._handler_table()

    def _handler_table(self) -> dict[type[Any], Callable[[Peer, Any], None]]:
        declare = self.declarations.declare
        calls = CallFrames(self._emit, self.calls, self.services)
        return {
            frames.Batch: self.routes.route,
            SharedBatch: self.routes.route,
            frames.Request: calls.request,
            frames.Reply: calls.reply,
            frames.Cancel: calls.cancel,
            frames.Grant: self.topics.grant,
            frames.Assert: self._assertions.add,
            frames.Credit: self.topics.confirm_credit,
            frames.Node: declare,
            frames.Publisher: declare,
            frames.Subscription: declare,
            frames.Service: declare,
            frames.Client: declare,
            frames.Undeclare: self.declarations.undeclare,
            frames.Retire: self.declarations.retire,
            frames.Watch: self._watch,
            frames.Unwatch: lambda peer, frame: self.graph.unwatch(peer, frame.id),
            frames.Describe: self.declarations.describe,
            Mirror: self.declarations.mirror,
            Open: self.topics.open_publisher,
            Forward: calls.forward,
        }

    def _emit(self, delivery: Delivery) -> None:
        self._out.append(delivery)

    def _pop_deliveries(self) -> list[Delivery]:
        """Return the deliveries, with ATTACHED and DETACHED frames."""
        self.routes.flush()
        out, self._out = self._out, []
        return out

    def report(self) -> list[Delivery]:
        """Return what reports changes: ATTACHED, ASSERT, MATCHED and GRAPH frames.

        Call it once after many frames, soon after the last: these frames are combined, so that their number
        does not depend on that of the declarations. While `graph.asked`, another call is needed.
        """
        self._assertions.report()
        self._notices.flush()
        self.graph.flush()
        return self._pop_deliveries()

    # Peers

    def connect(
        self, instance: bytes, token: bytes, principal: Principal | None = None, *, mesh: bool = False
    ) -> tuple[int, list[Delivery]]:
        """Add a peer.

        Args:
            instance: The client's identity.
            token: The client's secret. With both the client takes over from its earlier connection, which is
                closed, unless it is another user's.
            principal: Whose it is; None if there are no access rules.
            mesh: Whether it stands for the other brokers of a mesh.

        Returns:
            The new peer's id, and deliveries.
        """
        peer = Peer(
            next(self._peer_ids),
            instance,
            token,
            relied_on=self.relied_on,
            principal=principal,
            all_latched=self._latched,
            mesh=mesh,
        )
        self._peers[peer.id] = peer
        old = self._instances.get(instance)
        if old is None or (old.token == token and _user(old) == _user(peer)):
            if old is not None:
                self._replace_peer(old, "the same node has connected again")
            self._instances[instance] = peer
        return peer.id, self._pop_deliveries()

    def disconnect(self, peer_id: int) -> list[Delivery]:
        """Remove a peer whose connection is gone; ignore one that has been replaced."""
        peer = self._peers.get(peer_id)
        if peer is not None:
            self._remove_peer(peer, "")
        return self._pop_deliveries()

    def _replace_peer(self, peer: Peer, reason: str) -> None:
        """Remove a peer because another takes its place, and close its connection."""
        self._emit(Close(peer.id, ErrorCode.TAKEN_OVER, reason))
        self._remove_peer(peer, reason)

    def _remove_peer(self, peer: Peer, reason: str) -> None:
        del self._peers[peer.id]
        if self._instances.get(peer.instance) is peer:
            del self._instances[peer.instance]
        self.graph.forget(peer)
        for endpoint in tuple(peer.endpoints.values()):
            self.declarations.remove(endpoint, reason)
        self.routes.remove_peer(peer.id)
        self.relied_on.discard(peer.id)

    def peer(self, peer_id: int) -> Peer | None:
        """Return a peer's record; None if the peer has been replaced."""
        return self._peers.get(peer_id)

    def endpoint(self, peer_id: int, endpoint_id: int) -> Endpoint | None:
        """Return what a peer has declared with an id; None if it has not, or not any more."""
        peer = self._peers.get(peer_id)
        return None if peer is None else peer.endpoints.get(endpoint_id)

    def set_principal(self, peer_id: int, principal: Principal) -> list[Delivery]:
        """Apply changed access rules to a peer, and remove what it may not have any more."""
        peer = self._peers.get(peer_id)
        if peer is not None:
            before, peer.principal = peer.rights, principal
            self.graph.reassess(peer, before)
            self.declarations.revoke(peer)
        return self._pop_deliveries()

    def drop_denied(self, renew: Callable[[Principal], Principal | None]) -> list[Delivery]:
        """Drop messages in departed queues that changed access rules deny to their publisher or reader.

        Args:
            renew: Returns a user by the changed rules; None if it has none. For publishers that are gone.
        """
        self.routes.drop_denied(self._peers, renew)
        return self._pop_deliveries()

    def hold_publishers(self) -> list[Delivery]:
        """Let the publishers send no more messages than they have sent, as the broker stops."""
        self.topics.hold()
        return self._pop_deliveries()

    def mark_alive(self, peer_id: int) -> None:
        """Record a sign of life of a peer: after a graph query it needs no closer check any more."""
        peer = self._peers.get(peer_id)
        if peer is not None and not peer.matched and not peer.owed_calls:
            self.relied_on.discard(peer_id)

    def suspend(self, peer_id: int) -> list[Delivery]:
        """Take a silent peer's endpoints out of the graph: its calls fail, and its credit does not count."""
        peer = self._peers.get(peer_id)
        if peer is not None and not peer.suspended:
            peer.suspended = True
            for endpoint in peer.endpoints.values():
                self.declarations.leave(endpoint)
        return self._pop_deliveries()

    def release_names(self, peer_id: int) -> None:
        """Let other nodes take the names of a peer that has been suspended for too long."""
        peer = self._peers.get(peer_id)
        if peer is not None and peer.suspended:
            peer.names_released = True

    def restore(self, peer_id: int) -> list[Delivery]:
        """Put the endpoints of a suspended peer back into the graph."""
        peer = self._peers.get(peer_id)
        if peer is not None and peer.suspended:
            peer.suspended = peer.names_released = False
            for endpoint in peer.endpoints.values():
                if not self.declarations.fits(endpoint):  # its counterparts have increased meanwhile
                    text = self.declarations.too_many_matches
                    self.refusals.add(peer, text)
                    self._emit(Close(peer.id, ErrorCode.LIMIT, text))
                    self._remove_peer(peer, text)
                    break
                if isinstance(endpoint, NodeRecord):
                    notice = frames.Notice(endpoint.id, NoticeKind.SUSPENDED, WAS_SILENT, policy=0, peers=1)
                    self._emit(Send(peer.id, notice))
                self.declarations.join(endpoint)
        return self._pop_deliveries()

    def check_stalls(self, now: float) -> tuple[list[str], list[Delivery]]:
        """Suspend the credit of KEEP_ALL subscriptions that take nothing; return lines for the log, too."""
        lines = self.topics.check_stalls(now)
        return lines, self._pop_deliveries()

    # Frames

    def handle(self, peer_id: int, frame: Frame | Mirrored) -> list[Delivery]:
        """Take one frame of an open session; if its type is in `REPORTED`, a `report` must follow.

        Raises:
            ProtocolError: Close the peer and call `disconnect` for it. Earlier effects of the frame remain.
        """
        peer = self._peers.get(peer_id)
        if peer is None:
            return []
        handler = self._handlers.get(type(frame))
        if handler is not None:
            try:
                handler(peer, frame)
            except ProtocolError as error:
                unknown = error.code is ErrorCode.UNKNOWN_ID
                if not (unknown and getattr(frame, "publisher", None) in peer.revoked):
                    raise
        out, self._out = self._out, []
        return out

    def _watch(self, peer: Peer, frame: frames.Watch) -> None:
        self.relied_on.update(self._peers)
        self.graph.watch(peer, frame)


def _user(peer: Peer) -> str | None:
    return None if peer.principal is None else peer.principal.user

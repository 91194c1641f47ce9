"""The links of one broker and the graphs that they have joined; delivers what the routers return."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Final

from broker.access.errors import Unauthorized
from broker.access.rules import Rights
from broker.routing.graph import WatchCount
from broker.routing.router import Router
from broker.routing.router_limits import RouterLimits
from broker.serving.memory_guard import MemoryGuard
from broker.serving.reports import Reports
from broker.serving.shared_memory import SharedMemory
from proto.aio.machine_memory import memory_bytes, resident_bytes
from proto.errors import ErrorCode
from proto.queues.outbox import Outbox
from proto.wire.fragments import ByteTotal, ReassemblyTotal
from proto.wire.mesh_keys import mesh_key

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from broker.access.admission import Admission
    from broker.access.rules import AccessRules
    from broker.options import BrokerOptions
    from broker.routing.deliveries import Delivery
    from broker.serving.capacity import Capacity
    from broker.serving.link import Link
    from broker.serving.mesh_access import MeshMembership, MeshOutbox
    from broker.serving.peer_warnings import PeerWarnings
    from broker.serving.presence_log import PresenceLog
    from proto.aio.read_budget import ReadBudget

UNKNOWN_USER: Final = "the access rules do not know this user or its credentials any more"


@dataclass(slots=True)
class LimitCounts:
    """Counts refusals and endings of one run of a broker that no other part counts.

    The field names are those of the statistics.
    """

    refused_per_address: int = 0
    tls_failures: int = 0
    reassembly_timeouts: int = 0


class Dispatcher:
    """One run of a broker, from start to stop.

    Args:
        options: The broker's limits.
        capacity: How many links it may have.
        admission: Decides which links are accepted, and identifies their users.
        presence_log: Logs which nodes and endpoints come and go.
        warnings: Logs warnings that peers cause.

    Attributes:
        links: All links.
        handshaking: Links that have not finished their handshake.
        joined: By router, the links of its graph, by peer.
        reassembly: The bytes of incomplete messages of all links.
        latched: The bytes of latched messages of all links.
        received: The bytes of buffers for received bytes and for TLS of all links.
        memory: Counts the memory of all links, and frees some beyond the limit.
        shared_memory: What clients on this host share with the broker.
        limit_counts: How often links have reached limits that no other part counts.
        partial: Links that have, or had, incomplete messages.
        max_reassembly_bytes: Bytes of incomplete messages of one link.
        draining: Whether the broker is stopping: no peer may join any more.
        on_progress: Called after each delivery, write and end of a link. A drain sets it, to check whether it
            may go on.
        budget: Limits the frames that are handled in one loop turn. It needs a running loop, so the broker
            sets it when it starts, before the first link.
        reports: Reports changes of the graphs, once per loop turn.
        mesh: The broker's part in a mesh; None without one.
        mesh_channels: By router, the outbox to the mesh.
        closed_bytes_received, closed_bytes_sent: Bytes of the closed links.
        closed_frames_received: Frames from them.
    """

    def __init__(
        self,
        options: BrokerOptions,
        capacity: Capacity,
        admission: Admission,
        presence_log: PresenceLog,
        warnings: PeerWarnings,
    ) -> None:
        self.options = options
        self.capacity = capacity
        self.admission = admission
        self.presence_log = presence_log
        self.warnings = warnings
        self._limits = _router_limits(options)
        self.links: dict[Link, None] = {}
        self.handshaking: dict[Link, None] = {}
        self.joined: dict[Router, dict[int, Link]] = {}
        self.reassembly = ReassemblyTotal(options.max_total_reassembly_bytes, self._warn_of_discarded)
        self.partial: dict[Link, None] = {}
        self.latched, self.received = ByteTotal(), ByteTotal()
        self.memory = MemoryGuard(
            options.max_broker_bytes or memory_bytes() // 2,
            resident_bytes,
            self.reassembly,
            self.latched,
            self.received,
        )
        self.shared_memory = SharedMemory(
            enabled=options.shared_memory, descriptors=capacity.arenas, max_bytes=self.memory.max_bytes
        )
        self.limit_counts = LimitCounts()
        self.max_reassembly_bytes = max(options.max_reassembly_bytes, options.max_message_bytes)
        self.draining = False
        self.on_progress: Callable[[], None] | None = None
        self.budget: ReadBudget | None = None
        self.reports = Reports(self)
        self.closed_bytes_received = self.closed_bytes_sent = self.closed_frames_received = 0
        self.mesh: MeshMembership | None = None
        self.mesh_channels: dict[Router, MeshOutbox] = {}
        self._routers: dict[int, Router] = {}
        self._unflushed: dict[Link, None] = {}
        self._watches = WatchCount(options.max_watches)

    def open(self, link: Link) -> None:
        """Add a new link, or refuse it if there are too many."""
        # A refused link is added, too, until its connection has ended: `close` undoes what is counted here.
        self.links[link] = self.handshaking[link] = None
        too_many = self.admission.enter(link.origin)
        refusal = self.capacity.refusal if len(self.links) > self.capacity.most else too_many
        if refusal:
            self.capacity.refused += 1
            self.limit_counts.refused_per_address += refusal == too_many
            self.warnings.warn(refusal, "Refused a connection from %s: %s", link.address, refusal)
            link.refuse(ErrorCode.LIMIT, refusal)

    def close(self, link: Link) -> None:
        """Remove a link whose connection has ended."""
        self.leave(link)
        if link in self.links:
            self.admission.leave(link.origin)
        self.closed_bytes_received += link.channel.bytes_received
        self.closed_bytes_sent += link.channel.bytes_sent
        self.closed_frames_received += link.channel.frames_received
        self.links.pop(link, None)
        self.handshaking.pop(link, None)
        self.partial.pop(link, None)
        self._unflushed.pop(link, None)
        self.note_progress()

    def identify(self, link: Link, token: object, now: float) -> bool:
        """Identify the user of a link; refuse a link without one.

        Args:
            link: The link, which has sent its HELLO.
            token: The token in it; None for none.
            now: Loop time.

        Returns:
            Whether it may go on.
        """
        try:
            link.principal = self.admission.identify(link.origin, token, now)
        except Unauthorized as error:
            reason = "connections without valid credentials"
            self.warnings.warn(reason, "Refused a connection from %s: %s", link.address, error)
            if error.late:  # the periodic check answers
                link.rejected = str(error)
            else:
                link.refuse(error.code, str(error))
            return False
        return True

    def apply(self, rules: AccessRules) -> None:
        """Let changed access rules hold for all connections, those with a session included."""
        self.admission.rules = rules
        for link in tuple(self.links):
            router = link.router
            if router is None or link.principal is None:
                continue
            principal = rules.renewed(link.principal)
            # The link leaves its graph only in the next loop turn (`Connection.failed`). Until then it has no
            # rights, so that the reload holds at once.
            if principal is None:
                link.fail(ErrorCode.UNAUTHORIZED, UNKNOWN_USER)
                principal = replace(link.principal, rights=Rights((), UNKNOWN_USER))
            link.principal = principal
            self.deliver(router, router.set_principal(link.peer, principal))
        # After all principals are new: a message in a departed queue needs the rights of both its ends.
        for router in tuple(self.joined):
            self.deliver(router, router.drop_denied(rules.renewed))
        if self.mesh is not None:
            self.mesh.apply(rules)
        self.reports.report_soon()
        self.flush()

    def join(self, link: Link, domain: int, instance: bytes, token: bytes) -> None:
        """Add a link to the graph of its domain after its handshake."""
        router = self.router(domain)
        link.peer, deliveries = router.connect(instance, token, link.principal)
        link.router = router
        self.handshaking.pop(link, None)
        self.joined[router][link.peer] = link
        self.deliver(router, deliveries)
        self.reports.report_soon()

    def router(self, domain: int) -> Router:
        """Return the router of a domain's graph."""
        router = self._routers.get(domain)
        if router is None:
            joined: dict[int, Link] = {}
            router = self._routers[domain] = Router(
                domain=domain,
                limits=self._limits,
                watches=self._watches,
                report=lambda endpoint, reason: self.presence_log.log_change(
                    domain, joined.get(endpoint.peer.id), endpoint, reason
                ),
                report_refusal=lambda peer, what, text: self.warnings.warn(
                    f"refused {what}", "Refused %s of %s: %s", what, joined.get(peer.id), text
                ),
                latched=self.latched,
                memory_full=lambda: self.memory.full,
                key_base=0 if self.mesh is None else mesh_key(self.mesh.number, 0),
            )
            self.joined[router] = joined
            # Only now: the mesh may deliver at once, and `deliver` looks the router up in `joined`.
            if self.mesh is not None:
                self.mesh_channels[router] = self.mesh.add(router)
        return router

    def _warn_of_discarded(self) -> None:
        text = "Discarded a large message because the broker holds too much (--max-broker-bytes)"
        self.warnings.warn("discarded large messages", text)

    def report_omitted(self, *, at_once: bool = False) -> None:
        """Log how many lines about peers were not logged, if there are any.

        Args:
            at_once: Whether to ignore the limits, because the broker ends.
        """
        self.presence_log.report_omitted(at_once=at_once)
        self.warnings.report_omitted(at_once=at_once)

    def leave(self, link: Link) -> None:
        """Remove a link from its graph, and close it."""
        self.memory.end(link)
        # A link leaves twice if it said GOODBYE: then, and when its connection ends. The second time has no
        # router.
        router, link.router = link.router, None
        if router is not None:
            self.note_ending(link, "")
            deliveries = router.disconnect(link.peer)
            self.joined[router].pop(link.peer, None)
            self.deliver(router, deliveries)
            self.reports.report_soon()
            self.flush()
        link.channel.close()
        # An empty outbox frees what waited, although the transport may keep the channel for a while.
        link.channel.outbox = Outbox()
        memory, link.memory = link.memory, None
        if memory is not None:
            memory.end()
        self.memory.count(link)

    def note_ending(self, link: Link, reason: str, *, left: bool = False) -> None:
        """Record why a link ends; only the first reason counts.

        Args:
            link: The link.
            reason: For the log; "" if there is no special one. Ignored while the broker stops.
            left: Whether the client stops on purpose, so that its nodes count as left, not as dead.
        """
        if not link.ending:
            link.left = left or self.draining
            link.ending = "the broker is stopping" if self.draining else reason or "closed"

    def suspend(self, link: Link, router: Router, now: float) -> None:
        """Remove a silent link's endpoints from the graph until something arrives on it again."""
        silent = now - link.liveness.last_seen_at
        self.warnings.warn("suspended links", "%s has been silent for %.1f s: suspended", link, silent)
        link.suspended_at = now
        self.deliver(router, router.suspend(link.peer))
        self.reports.report_soon()

    def restore(self, link: Link) -> None:
        """Put the endpoints of a suspended link back into the graph, because something has arrived on it."""
        link.suspended_at = None
        if link.router is not None:
            self.warnings.warn("links that are back", "%s is back", link)
            self.deliver(link.router, link.router.restore(link.peer))
            self.reports.report_soon()

    def caught_up(self, link: Link) -> None:
        """Note that everything a link sent before the hold has arrived."""
        link.behind = False
        self.note_progress()

    def note_progress(self) -> None:
        """Let a drain check its conditions again."""
        if self.on_progress is not None:
            self.on_progress()

    def note_partial(self, link: Link) -> None:
        """Note that a link has sent a part of a message; close the links with most if all hold too much."""
        self.partial[link] = None
        total = self.reassembly
        while total.bytes > total.max_bytes:
            most = max(self.partial, key=_held_partly)
            text = (
                f"all links together have sent over {total.max_bytes} bytes of incomplete messages, and"
                f" this link {_held_partly(most)} (the broker's --max-total-reassembly-bytes)"
            )
            most.fail(ErrorCode.LIMIT, text)
            most.channel.reassembler.clear()

    def deliver(self, router: Router, deliveries: list[Delivery]) -> None:
        """Put deliveries into the outboxes of their links; `flush` sends them."""
        # Nothing is written here: a frame of one link may cause deliveries for many, and the frames behind it
        # in the same read for the same ones again. `flush` writes once to each, at the end of the read.
        joined, unflushed = self.joined[router], self._unflushed
        most, most_bulk = self.options.max_queue_bytes, self.options.max_bulk_bytes
        for delivery in deliveries:
            link = joined.get(delivery.peer)
            if link is None:
                to_mesh = self.mesh_channels.get(router)
                if to_mesh is not None and to_mesh.peer == delivery.peer:
                    delivery.deliver(to_mesh)
                else:
                    delivery.lose()
                continue
            if not (channel := link.channel).connected:
                delivery.lose()
                channel.outbox = Outbox()  # it is not sent any more; its queues may be empty now
                continue
            unflushed[link] = None
            delivery.deliver(channel)
            outbox = channel.outbox
            # What is never dropped is compared with its limits after each delivery, as one frame may cause
            # thousands. Messages are not: `trim` bounds them, once for each flush.
            waiting = outbox.urgent_bytes + outbox.ordered_bytes
            if (waiting > most and outbox.undroppable_bytes > most) or outbox.bulk_bytes > most_bulk:
                channel.flush()
                link.fail_if_over_limit()

    def flush(self) -> None:
        """Write to every link with new deliveries; close those that are over their limits."""
        while self._unflushed:  # closing a link below may cause deliveries for others
            unflushed, self._unflushed = self._unflushed, {}
            for link in unflushed:
                channel = link.channel
                channel.flush()
                outbox = channel.outbox
                if outbox.held_bytes > outbox.max_held_bytes:
                    link.fail_if_over_limit()
                if link.held_bytes or outbox.held_bytes or outbox.urgent_bytes or outbox.ordered_bytes:
                    self.memory.count(link)
        for to_mesh in self.mesh_channels.values():
            to_mesh.flush()
            self.memory.count(to_mesh)
        if self.memory.needs_relief:
            self.memory.relieve(self.links, self.mesh_channels.values())
        if self._unflushed:  # what waited for a mesh was too much, and its endpoints have been removed
            self.flush()
            return
        if self.on_progress is not None:
            self.on_progress()

    @property
    def mesh_has_unsent(self) -> bool:
        """Whether anything waits for other brokers."""
        return any(each.has_unsent for each in self.mesh_channels.values())

    def descriptors(self) -> Iterator[int]:
        """DescriptorOwner: the descriptors of all links."""
        for link in tuple(self.links):
            yield from link.channel.descriptors()


def _router_limits(options: BrokerOptions) -> RouterLimits:
    own = {"max_keep_all_queue_bytes", "max_departed_queues"}  # they follow from others, or have no option
    same = {each.name: getattr(options, each.name) for each in fields(RouterLimits) if each.name not in own}
    # One more message than may wait for a peer fits into its queues.
    most = options.max_queue_bytes + options.max_message_bytes
    return RouterLimits(**same, max_keep_all_queue_bytes=most)


def _held_partly(link: Link) -> int:
    return link.channel.reassembler.held_bytes

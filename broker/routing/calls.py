"""Calls: requests to a server, replies to their clients, and the calls without an answer.

The broker gives each call an id of its own, so that no client can guess another's, and accepts a reply only
from the server it chose: the one with the fewest pending calls; ties rotate. It has no timer: clients own
deadlines.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, TypeVar

from broker.routing.deliveries import CancelCalls, Send, SendCalls
from broker.routing.records import ClientRecord, PendingCall, ServiceRecord
from proto import limits
from proto.errors import ErrorCode, ProtocolError
from proto.queues.queued_calls import WAITING_BYTES, QueuedCalls
from proto.wire import frames
from proto.wire.codec import encode
from proto.wire.codes import Status
from proto.wire.fragments import is_large
from proto.wire.frames import ReplyEntry, RequestEntry

if TYPE_CHECKING:
    from collections.abc import Callable

    from broker.routing.deliveries import Delivery
    from broker.routing.mirrored import Forward
    from broker.routing.pool import Pool
    from broker.routing.records import Peer
    from broker.routing.router_limits import RouterLimits
    from broker.routing.services import OneServer, Services
    from proto.queues.queued_calls import CallShare
    from proto.wire.frames import Options


EntryT = TypeVar("EntryT", RequestEntry, ReplyEntry)

TOO_LARGE: Final = "with the broker's call id it is larger than a message may be"
SERVER_GONE: Final = "the server has gone"
CLIENT_SILENT: Final = "this link was silent for too long"
STOPPING: Final = "the broker is stopping"
OVERLOADED: Final = "wait for the server already (the broker's --max-queued-call-bytes, --max-bulk-bytes)"
MEMORY_FULL: Final = "the broker takes no large calls, since it holds too much (its --max-broker-bytes)"
NO_SERVER: Final = "no server; wait for one with wait_for_service()"


class Calls:
    """All calls of one graph.

    Args:
        emit: Takes each delivery.
        router_limits: Has the limits of calls. The broker's call ids may make a frame longer than it came.
        memory_full, report_refusal: See `Router`.

    Attributes:
        closed: Whether new calls are refused, except those that the answer to another may need.
        pending: Calls without an answer.
        routed: Requests routed to a server.
        refused: Requests that the broker answered: there was no server, or too many calls were pending.
        overloaded: Those of them that exceeded a limit of queued calls, or were large while `memory_full`.
        late: Replies to calls that were no longer pending.
    """

    def __init__(
        self,
        emit: Callable[[Delivery], None],
        router_limits: RouterLimits,
        memory_full: Callable[[], bool],
        report_refusal: Callable[[Peer, str, str], None],
    ) -> None:
        self._emit = emit
        self._max_bytes = router_limits.max_message_bytes
        self._max_pending = router_limits.max_pending_calls
        self._max_queued = router_limits.max_queued_call_bytes, router_limits.max_bulk_bytes
        self._last_call = 0
        self.closed = False
        self._memory_full = memory_full
        self._report_refusal = report_refusal
        self.pending = self.routed = self.refused = self.overloaded = self.late = 0

    def request(
        self,
        client: ClientRecord,
        pool: Pool[ServiceRecord] | OneServer | None,
        entries: tuple[RequestEntry, ...],
    ) -> None:
        """Route a client's requests.

        Args:
            client: Who calls.
            pool: The servers of its service and type; None if there are none.
            entries: The requests.

        Raises:
            ProtocolError: A call id is in use.
        """
        # One frame for each server and each direction, in the order of the entries: calls coalesce as
        # messages do.
        routed: dict[ServiceRecord, list[RequestEntry]] = {}
        refused: list[ReplyEntry] = []
        # A stopping broker still routes the calls of a link that owes an answer: the answer may depend on
        # them.
        closed = self.closed and not client.peer.owed_calls
        for entry in entries:
            if entry.call in client.pending:
                raise ProtocolError(ErrorCode.UNEXPECTED, f"REQUEST: the call id {entry.call} is in use")
            if client.peer.pending_calls >= self._max_pending:
                text = (
                    f"{self._max_pending} calls of this link wait already (the broker's --max-pending-calls)"
                )
                refused.append(answer(entry.call, Status.OVERLOADED, text))
                continue
            server = None if pool is None or closed else pool.least_busy()
            if pool is None or server is None:
                refused.append(answer(entry.call, Status.UNAVAILABLE, STOPPING if closed else NO_SERVER))
                continue
            # Counted before the next entry chooses, so that the entries of one frame are spread over the
            # servers.
            call = self._open(client, entry.call, server)
            if server.pool is not None:
                server.pool.update(server)
            routed.setdefault(server, []).append(RequestEntry(call, *entry[1:]))
        self.refused += len(refused)
        if refused:
            self._send_replies(client, refused)
        for server, chosen in routed.items():
            self.routed += len(chosen)
            self._send_requests(client, server, chosen)

    def _send_requests(
        self, client: ClientRecord, server: ServiceRecord, entries: list[RequestEntry]
    ) -> None:
        raw = encode(frames.Request(server.id, tuple(entries)))
        # The broker's call ids may be longer than the client's, so that a frame can outgrow its limit here.
        if len(entries) > 1 and self._must_split(raw):
            for part in _split(entries, len(raw)):
                self._send_requests(client, server, part)
            return
        if len(raw) > self._max_bytes:
            self._refuse_unsent(client, server, entries, Status.UNAVAILABLE, TOO_LARGE)
            return
        share = self._share(client, server)
        refused = is_large(raw) and self._memory_full()
        if not refused and share.admit(raw):
            self._emit(SendCalls(server.peer.id, raw, (server.id, entries[0].call), share))
            return
        # They count as refused, not as routed: `request` has counted them before their size was known.
        self.routed -= len(entries)
        self.refused += len(entries)
        self.overloaded += len(entries)
        text, waiting = MEMORY_FULL, 0
        if not refused:
            waiting = share.bytes
            text = f"{waiting} bytes of this link's calls, {share.all.bytes} of all links, {OVERLOADED}"
        self._refuse_unsent(client, server, entries, Status.OVERLOADED, text, waiting_bytes=waiting)
        self._report_refusal(client.peer, "calls", text)

    def _share(self, client: ClientRecord, server: ServiceRecord) -> CallShare:
        """Return the count of the client's requests that wait for the server."""
        queued = server.peer.queued_calls
        if queued is None:
            queued = server.peer.queued_calls = QueuedCalls(*self._max_queued)
        return queued.share(client.broker << 32 | client.peer.id)  # all other brokers are one peer

    def _refuse_unsent(
        self,
        client: ClientRecord,
        server: ServiceRecord,
        entries: list[RequestEntry],
        status: Status,
        text: str,
        *,
        waiting_bytes: int = 0,
    ) -> None:
        """Answer requests that cannot be sent to their server."""
        attributes: Options | None = {WAITING_BYTES: waiting_bytes} if waiting_bytes else None
        refused: list[ReplyEntry] = []
        for entry in entries:
            pending = server.pending[entry.call]
            self._close(pending)
            refused.append(answer(pending.client_call, status, text, attributes))
        self._send_replies(client, refused)

    def _must_split(self, raw: bytes) -> bool:
        """Return whether to split a frame: a large call travels alone, so that it can be removed alone."""
        return is_large(raw) or len(raw) > self._max_bytes

    def _open(self, client: ClientRecord, client_call: int, server: ServiceRecord) -> int:
        call = self._last_call = self._last_call + 1
        pending = PendingCall(call, client, client_call, server)
        self.pending += 1
        server.pending[call] = pending
        client.pending[client_call] = pending
        client.peer.pending_calls += 1
        server.peer.owed_calls += 1
        return call

    def _close(self, pending: PendingCall) -> None:
        # Both sides and both peers at once: `pending` of a graph is always the sum of its clients' and its
        # servers'.
        server = pending.server
        del server.pending[pending.call]
        server.peer.owed_calls -= 1
        if server.pool is not None:
            server.pool.update(server)
        self.pending -= 1
        del pending.client.pending[pending.client_call]
        pending.client.peer.pending_calls -= 1

    def reply(self, server: ServiceRecord, entries: tuple[ReplyEntry, ...]) -> None:
        """Route a server's replies; count and drop those to calls that are no longer pending."""
        answered: dict[ClientRecord, list[ReplyEntry]] = {}
        for entry in entries:
            # Only the chosen server can answer: another one does not have the id, even if it guesses it.
            pending = server.pending.get(entry.call)
            if pending is None:
                self.late += 1
                continue
            self._close(pending)
            answered.setdefault(pending.client, []).append(ReplyEntry(pending.client_call, *entry[1:]))
        for client, chosen in answered.items():
            self._send_replies(client, chosen)

    def _send_replies(self, client: ClientRecord, entries: list[ReplyEntry]) -> None:
        most = limits.MAX_CALLS_PER_FRAME
        while len(entries) > most:
            self._send_reply(client, entries[:most])
            entries = entries[most:]
        self._send_reply(client, entries)

    def _send_reply(self, client: ClientRecord, entries: list[ReplyEntry]) -> None:
        raw = encode(frames.Reply(client.id, tuple(entries)))
        if len(entries) > 1 and self._must_split(raw):
            for part in _split(entries, len(raw)):
                self._send_reply(client, part)
            return
        if len(raw) > self._max_bytes:
            refusal = answer(entries[0].call, Status.UNAVAILABLE, TOO_LARGE)
            raw = encode(frames.Reply(client.id, (refusal,)))
        self._emit(SendCalls(client.peer.id, raw, (client.id, entries[0].call)))

    def cancel(self, client: ClientRecord, calls: tuple[int, ...]) -> None:
        """Cancel calls of a client at their servers; unknown ones have just been answered."""
        unwanted: dict[ServiceRecord, list[int]] = {}
        for client_call in calls:
            pending = client.pending.get(client_call)
            if pending is not None:
                self._close(pending)
                unwanted.setdefault(pending.server, []).append(pending.call)
        for server, server_calls in unwanted.items():
            self._emit(CancelCalls(server.peer.id, server.id, server_calls, self._share(client, server)))

    def client_left(self, client: ClientRecord) -> None:
        """Cancel all calls of a client; if it is only suspended, tell it that they have failed."""
        calls = tuple(client.pending)
        self.cancel(client, calls)
        # A client that is gone for good hears nothing; a suspended one may come back and still wait.
        if calls and client.peer.suspended:
            self._send_replies(client, [answer(call, Status.UNAVAILABLE, CLIENT_SILENT) for call in calls])

    def server_left(self, server: ServiceRecord) -> None:
        """Answer all calls of a server with an error."""
        if server.pending and server.peer.suspended:  # if it comes back, it should not work on them any more
            self._emit(CancelCalls(server.peer.id, server.id, list(server.pending)))
        # All calls are closed before anything is sent, so that no reply meets a half-ended server.
        failed: dict[ClientRecord, list[ReplyEntry]] = {}
        for pending in tuple(server.pending.values()):
            self._close(pending)
            entry = answer(pending.client_call, Status.UNAVAILABLE, SERVER_GONE)
            failed.setdefault(pending.client, []).append(entry)
        for client, entries in failed.items():
            self._send_replies(client, entries)


def _split(entries: list[EntryT], size: int) -> list[list[EntryT]]:
    """Return entries, of this size together, in parts of half a frame, assuming that all have one size."""
    half = min(size, limits.MAX_FRAME_BYTES) // 2
    count = max(1, len(entries) * half // size)
    return [entries[start : start + count] for start in range(0, len(entries), count)]


def answer(call: int, status: Status, text: str, attributes: Options | None = None) -> ReplyEntry:
    """Return the broker's own answer to a call."""
    return ReplyEntry(call, status, more=False, attributes=attributes, body=text.encode())


class CallFrames:
    """The handlers of these frames in one graph.

    Args:
        emit: Takes each delivery.
        calls: The graph's calls.
        services: Knows the servers for a client's calls.
    """

    def __init__(self, emit: Callable[[Delivery], None], calls: Calls, services: Services) -> None:
        self._emit = emit
        self._calls = calls
        self._services = services

    def request(self, peer: Peer, frame: frames.Request) -> None:
        """Send a client's calls to servers."""
        client = peer.endpoints.get(frame.endpoint)
        if isinstance(client, ClientRecord):
            self._calls.request(client, self._services.pool(client), frame.entries)
            return
        # The client was refused, or has just been undeclared.
        for entry in frame.entries:
            refusal = answer(entry.call, Status.UNAVAILABLE, NO_SERVER)
            self._emit(Send(peer.id, frames.Reply(frame.endpoint, (refusal,))))

    def forward(self, peer: Peer, frame: Forward) -> None:
        """Send calls of a client of another broker to the server that this broker has chosen."""
        client = peer.endpoints.get(frame.request.endpoint)
        if isinstance(client, ClientRecord):
            server = self._services.only(client, frame.server)
            self._calls.request(client, server, frame.request.entries)

    def reply(self, peer: Peer, frame: frames.Reply) -> None:
        """Send a server's answers to the clients."""
        server = peer.endpoints.get(frame.endpoint)
        if isinstance(server, ServiceRecord):
            self._calls.reply(server, frame.entries)
        else:
            self._calls.late += len(frame.entries)

    def cancel(self, peer: Peer, frame: frames.Cancel) -> None:
        """Cancel calls of a client."""
        client = peer.endpoints.get(frame.endpoint)
        if isinstance(client, ClientRecord):
            self._calls.cancel(client, frame.calls)

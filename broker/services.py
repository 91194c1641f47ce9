"""Services: who answers whom, and every call that has no answer yet.

The broker gives each call an id of its own, so that no client can guess another's, and takes a reply only
from the server it chose: the one with the fewest calls pending; ties rotate. It keeps no timer: clients own
deadlines.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

from broker.deliveries import CancelCalls, Send, SendCalls
from broker.notices import Notices, type_difference
from broker.pool import Pool
from broker.records import ClientRecord, PendingCall, ServiceGroup, ServiceRecord
from proto import frames, limits
from proto.codec import encode
from proto.codes import NoticeKind, Status
from proto.errors import ErrorCode, ProtocolError
from proto.fragments import is_large
from proto.frames import ReplyEntry, RequestEntry

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from broker.deliveries import Delivery

EntryT = TypeVar("EntryT", RequestEntry, ReplyEntry)

TOO_LARGE = "with the broker's call id it is larger than a message may be"
GONE = "the server has gone"
SILENT = "this link was silent for too long"
STOPPING = "the broker is stopping"
NONE = "no server; wait for one with wait_for_service()"


class Services:
    """All services of one graph.

    Args:
        emit: Takes each delivery.
        max_pending: Unanswered calls of one link.
        max_bytes: Size of a frame that a link takes; our call ids may make one longer than it came.

    Attributes:
        closed: Whether new calls are refused, but for those that the answer to another may need.
        pending: Calls without an answer.
        calls: Requests routed to a server.
        refused: Requests answered here, because there was no server or too many were pending.
        late: Replies to calls that were no longer pending.
    """

    def __init__(self, emit: Callable[[Delivery], None], *, max_pending: int, max_bytes: int) -> None:
        self._emit = emit
        self._max_bytes = max_bytes
        self._max_pending = max_pending
        self._groups: dict[str, ServiceGroup] = {}
        self._notices = Notices(emit)
        self.closed = False
        self.pending = 0
        self._next_call = 0
        self._peers_changed: dict[ClientRecord | ServiceRecord, None] = {}
        self.calls = self.refused = self.late = 0

    # Declarations

    def join(self, endpoint: ClientRecord | ServiceRecord) -> None:
        """Match a client or server that is new or back."""
        group = self._groups.setdefault(endpoint.name, ServiceGroup(endpoint.name))
        if isinstance(endpoint, ClientRecord):
            group.clients[endpoint.key] = endpoint
            pairs = [(endpoint, server) for server in group.servers.values()]
        else:
            group.servers[endpoint.key] = endpoint
            endpoint.pool = group.pools.setdefault((endpoint.type_name, endpoint.type_hash), Pool())
            endpoint.pool.add(endpoint)
            pairs = [(client, endpoint) for client in group.clients.values()]
        self._notices.begin(endpoint)
        for client, server in pairs:
            if _same_type(client, server):
                self._count(client, 1)
                self._count(server, 1)
            else:
                self._incompatible(client, server)
        self._notices.end()

    def leave(self, endpoint: ClientRecord | ServiceRecord) -> None:
        """Take a client or server out: its calls end."""
        if isinstance(endpoint, ClientRecord):
            self._abandon(endpoint)
        else:
            self._fail_pending(endpoint)
        self._unmatch(endpoint)

    def retire(self, server: ServiceRecord) -> None:
        """Give a server no more requests; it may answer those it has."""
        self._unmatch(server)
        server.retired = True

    def _unmatch(self, endpoint: ClientRecord | ServiceRecord) -> None:
        group = self._groups.get(endpoint.name)
        if group is None or (endpoint.key not in group.clients and endpoint.key not in group.servers):
            return
        counterparts: Iterable[ClientRecord | ServiceRecord]
        if isinstance(endpoint, ClientRecord):
            del group.clients[endpoint.key]
            counterparts = group.servers.values()
        else:
            del group.servers[endpoint.key]
            self._leave_pool(group, endpoint)
            counterparts = group.clients.values()
        for other in counterparts:
            if _same_type(endpoint, other):
                self._count(other, -1)
        self._count(endpoint, -endpoint.peers)
        if not group.clients and not group.servers:
            del self._groups[endpoint.name]

    def _leave_pool(self, group: ServiceGroup, server: ServiceRecord) -> None:
        pool, server.pool = server.pool, None
        assert pool is not None
        pool.remove(server)
        if not pool:
            del group.pools[server.type_name, server.type_hash]

    def _abandon(self, client: ClientRecord) -> None:
        """End a client's calls at their servers, and tell it, in case it still listens."""
        calls = tuple(client.pending)
        self.cancel(client, calls)
        if client.peer.suspended:
            self._send_replies(client, [_answer(call, Status.UNAVAILABLE, SILENT) for call in calls])

    def _fail_pending(self, server: ServiceRecord) -> None:
        if server.pending and server.peer.suspended:  # it may be back, and should work for nobody then
            self._emit(CancelCalls(server.peer.id, server.id, list(server.pending)))
        failed: dict[ClientRecord, list[ReplyEntry]] = {}
        for pending in tuple(server.pending.values()):
            self._settle(pending)
            entry = _answer(pending.client_call, Status.UNAVAILABLE, GONE)
            failed.setdefault(pending.client, []).append(entry)
        for client, entries in failed.items():
            self._send_replies(client, entries)

    def _incompatible(self, client: ClientRecord, server: ServiceRecord) -> None:
        text = (
            f"'{client.name}' is not connected between the client {client.node_name} ({client.type_name})"
            f" and the server {server.node_name} ({server.type_name}):"
            f" {type_difference(client.type_name, server.type_name)}"
        )
        for endpoint in (client, server):
            self._notices.tell(endpoint, NoticeKind.INCOMPATIBLE_TYPE, text)

    def _count(self, endpoint: ClientRecord | ServiceRecord, change: int) -> None:
        if change:
            endpoint.set_peers(endpoint.peers + change)
            self._peers_changed[endpoint] = None

    def flush(self) -> None:
        """Tell every endpoint whose number of counterparts has changed."""
        if not self._peers_changed:
            return
        changed, self._peers_changed = self._peers_changed, {}
        for endpoint in changed:
            self._emit(Send(endpoint.peer.id, endpoint.matched_frame()))

    # Calls

    def request(self, client: ClientRecord, entries: tuple[RequestEntry, ...]) -> None:
        """Route a client's requests.

        Raises:
            ProtocolError: A call id is in use.
        """
        routed: dict[ServiceRecord, list[RequestEntry]] = {}
        refused: list[ReplyEntry] = []
        group = self._groups.get(client.name)
        pool = None if group is None else group.pools.get((client.type_name, client.type_hash))
        closed = self.closed and not client.peer.owed_calls
        for entry in entries:
            if entry.call in client.pending:
                raise ProtocolError(ErrorCode.UNEXPECTED, f"REQUEST: the call id {entry.call} is in use")
            if client.peer.pending_calls >= self._max_pending:
                text = f"{self._max_pending} calls of this link wait already"
                refused.append(_answer(entry.call, Status.OVERLOADED, text))
                continue
            server = None if pool is None or closed else pool.least_busy()
            if pool is None or server is None:
                refused.append(_answer(entry.call, Status.UNAVAILABLE, STOPPING if closed else NONE))
                continue
            call = self._open(client, entry.call, server)
            pool.moved(server)
            routed.setdefault(server, []).append(RequestEntry(call, *entry[1:]))
        self.refused += len(refused)
        if refused:
            self._send_replies(client, refused)
        for server, chosen in routed.items():
            self.calls += len(chosen)
            self._send_requests(server, chosen)

    def _send_requests(self, server: ServiceRecord, entries: list[RequestEntry]) -> None:
        raw = encode(frames.Request(server.id, tuple(entries)))
        if len(entries) > 1 and self._too_much(raw):
            for part in _cut(entries, len(raw)):
                self._send_requests(server, part)
        elif len(raw) > self._max_bytes:
            self._take_back(server.pending[entries[0].call])
        else:
            self._emit(SendCalls(server.peer.id, raw, (server.id, entries[0].call)))

    def _too_much(self, raw: bytes) -> bool:
        """Tell whether a frame is to be cut: a large call travels alone, so that it is taken back alone."""
        return is_large(raw) or len(raw) > self._max_bytes

    def _take_back(self, pending: PendingCall) -> None:
        self._settle(pending)
        answer = _answer(pending.client_call, Status.UNAVAILABLE, TOO_LARGE)
        self._send_replies(pending.client, [answer])

    def _open(self, client: ClientRecord, client_call: int, server: ServiceRecord) -> int:
        call = self._next_call = self._next_call + 1
        pending = PendingCall(call, client, client_call, server)
        self.pending += 1
        server.pending[call] = pending
        client.pending[client_call] = pending
        client.peer.pending_calls += 1
        server.peer.owed_calls += 1
        return call

    def _settle(self, pending: PendingCall) -> None:
        server = pending.server
        del server.pending[pending.call]
        server.peer.owed_calls -= 1
        if server.pool is not None:
            server.pool.moved(server)
        self.pending -= 1
        del pending.client.pending[pending.client_call]
        pending.client.peer.pending_calls -= 1

    def reply(self, server: ServiceRecord, entries: tuple[ReplyEntry, ...]) -> None:
        """Route a server's replies. One that nobody waits for is counted and forgotten."""
        answered: dict[ClientRecord, list[ReplyEntry]] = {}
        for entry in entries:
            pending = server.pending.get(entry.call)
            if pending is None:
                self.late += 1
                continue
            self._settle(pending)
            answered.setdefault(pending.client, []).append(ReplyEntry(pending.client_call, *entry[1:]))
        for client, chosen in answered.items():
            self._send_replies(client, chosen)

    def _send_replies(self, client: ClientRecord, entries: list[ReplyEntry]) -> None:
        for start in range(0, len(entries), limits.MAX_CALLS_PER_FRAME):
            self._send_reply(client, entries[start : start + limits.MAX_CALLS_PER_FRAME])

    def _send_reply(self, client: ClientRecord, entries: list[ReplyEntry]) -> None:
        raw = encode(frames.Reply(client.id, tuple(entries)))
        if len(entries) > 1 and self._too_much(raw):
            for part in _cut(entries, len(raw)):
                self._send_reply(client, part)
            return
        if len(raw) > self._max_bytes:
            answer = _answer(entries[0].call, Status.UNAVAILABLE, TOO_LARGE)
            raw = encode(frames.Reply(client.id, (answer,)))
        self._emit(SendCalls(client.peer.id, raw, (client.id, entries[0].call)))

    def cancel(self, client: ClientRecord, calls: tuple[int, ...]) -> None:
        """A client no longer wants these; unknown ones have just been answered."""
        unwanted: dict[ServiceRecord, list[int]] = {}
        for client_call in calls:
            pending = client.pending.get(client_call)
            if pending is not None:
                self._settle(pending)
                unwanted.setdefault(pending.server, []).append(pending.call)
        for server, its_calls in unwanted.items():
            self._emit(CancelCalls(server.peer.id, server.id, its_calls))


def _same_type(one: ClientRecord | ServiceRecord, other: ClientRecord | ServiceRecord) -> bool:
    return one.type_name == other.type_name and one.type_hash == other.type_hash


def _cut(entries: list[EntryT], size: int) -> list[list[EntryT]]:
    """Return entries, of this size together, in parts that would be half a frame if all were of one size."""
    half = min(size, limits.MAX_FRAME_BYTES) // 2
    count = max(1, len(entries) * half // size)
    return [entries[start : start + count] for start in range(0, len(entries), count)]


def _answer(call: int, status: Status, text: str) -> ReplyEntry:
    return ReplyEntry(call, status, more=False, attributes=None, body=text.encode())

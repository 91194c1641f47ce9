"""Clients: calls go out as entries, many to a frame, and every one of them ends."""

from __future__ import annotations

import asyncio
import math
import secrets
from typing import TYPE_CHECKING, Any, Final, Generic, TypeVar

import msgpack

from actors.callbacks.callback_task import CallbackTask, current_callback_task
from actors.callbacks.deadlines import Deadlines
from actors.callbacks.must_await import must_await
from actors.diagnostics.records import ClientDiagnostics
from actors.endpoints.context import Caller, NodeContext, in_flight
from actors.endpoints.entries import EntryBatch
from actors.endpoints.service_introspection import CallIdentity, EventKind, Introspectable, ServiceEvents
from actors.errors import CallFailed, RemoteError, ServiceOverloaded, ServiceTimeout, ServiceUnavailable
from actors.interfaces.codec import Codec, codec_for
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.message import Message, type_hash, type_name
from proto import frames, limits
from proto.codec import encode
from proto.codes import Status
from proto.frames import ReplyEntry, RequestEntry

if TYPE_CHECKING:
    from collections.abc import Iterator


Q = TypeVar("Q", bound=Message)
A = TypeVar("A", bound=Message)

MAX_PENDING: Final = 200_000
"""Calls of one client without an answer; one more fails as ServiceOverloaded."""

MAX_EARLY: Final = 1000
"""Calls of one client that wait for the node's first session; one more fails as ServiceOverloaded."""

MAX_UNSENT_BYTES: Final = 64 * 1024 * 1024
"""Above this much that a link has not taken yet, calls over it fail as ServiceOverloaded."""

_UNSERVED: Final[dict[int, type[ServiceUnavailable]]] = {
    Status.UNAVAILABLE: ServiceUnavailable,
    Status.OVERLOADED: ServiceOverloaded,
    Status.CANCELLED: ServiceUnavailable,
}


class CallFuture(asyncio.Future[A]):
    """The end of one call. Cancelling it cancels the call, at the server too."""

    def __init__(self, client: Client[Any, A], call: int, callback_task: CallbackTask | None) -> None:
        super().__init__(loop=client.context.link.loop)
        self._client = client
        self._call = call
        self._callback_task = callback_task

    def cancel(self, msg: Any | None = None) -> bool:
        """Give the call up; the server's handler is cancelled."""
        if not super().cancel(msg):
            return False
        self._client.give_up(self._call)
        return True

    def leave_callback_task(self) -> None:
        """The call is over for the turn it was made in."""
        if self._callback_task is not None:
            self._callback_task.call_ended()
            self._callback_task = None


class Client(Introspectable, Caller, Generic[Q, A]):
    """Calls one service. Made by `Node.create_client`.

    Attributes:
        srv_name: The full name of the service.
        gid: 16 bytes that name this client in service events.
        failed: Calls that have ended in an error so far, timeouts among them.
        timeouts: Calls whose deadline has passed so far.
        late: Replies that came when their call had ended already.
    """

    def __init__(
        self, context: NodeContext, srv_type: type, request_type: type[Q], response_type: type[A], name: str
    ) -> None:
        self._requests: Codec[Q] = codec_for(request_type)
        self._replies: Codec[A] = codec_for(response_type)
        super().__init__(context)
        self.srv_type = srv_type
        self.srv_name = name
        self._pending: dict[int, CallFuture[A]] = {}
        self._deadlines = Deadlines(self._expired)
        self.failed = self.timeouts = 0
        self._next_call = 0
        self._outgoing: EntryBatch[RequestEntry] = EntryBatch()
        self._early: dict[int, tuple[Q, bytes, float]] = {}
        """Calls that wait for the node's first session: request, its encoding, deadline in loop time."""
        self._cancelled: list[int] = []
        self.late = 0
        self.gid = secrets.token_bytes(limits.INSTANCE_BYTES)
        context.link.add(self)

    @property
    def pending(self) -> int:
        """Calls in flight."""
        return len(self._pending)

    def service_is_ready(self) -> bool:
        """Tell whether a server is there now."""
        return self.peers > 0

    @must_await
    async def wait_for_service(self, timeout_sec: float | None = None) -> bool:
        """Wait until a server of this service is there; the broker says so the moment it is.

        Returns:
            True when there is one; False when `timeout_sec` (None: no limit) has passed without.
        """
        self.context.require_loop()
        self.require_alive()
        with in_flight():
            try:
                async with asyncio.timeout(None if timeout_sec is None else max(0.0, timeout_sec)):
                    while not self.peers:
                        await self.context.link.changed()
                        self.require_alive()
            except TimeoutError:
                return False
        return True

    async def call(self, request: Q, timeout_sec: float | None = None) -> A:
        """Send a request and wait for the reply.

        Before the node's first session the call waits for that, too, within its deadline. Without a session
        later it fails at once.

        Args:
            request: The request.
            timeout_sec: Give up after this; None is the node's `default_call_timeout_sec`, `math.inf` never.

        Raises:
            TypeError: `request` is not of the service's request type; nothing was sent.
            InvalidMessageError: A field has a wrong type or is out of range, or the request is larger
                than the broker takes; nothing was sent.
            ServiceUnavailable: No server or no broker, or it went away before the reply.
            ServiceOverloaded: Too many calls wait already: here (200,000 of a client, 1,000 for the first
                session, or 64 MiB that have not left), in the broker or at the server.
            ServiceTimeout: No reply in time; the handler has been cancelled.
            RemoteError: The handler raised, or did not return a valid response.
        """
        return await self.call_async(request, timeout_sec)

    def call_async(self, request: Q, timeout_sec: float | None = None) -> asyncio.Future[A]:
        """Send a request; return a future of the reply. Arguments and errors as for `call`."""
        if self.destroyed:
            self.require_alive()
        body = self._requests.encode(request)
        link = self.context.link
        if len(body) > link.largest:
            link.require_fits(f"A request of '{self.srv_name}'", len(body))
        loop = self.context.require_loop()
        limit = self.context.default_call_timeout_sec if timeout_sec is None else timeout_sec
        if math.isnan(limit) or limit < 0:
            raise ValueError(f"timeout_sec must be zero or more, got {timeout_sec}")
        call = self._next_call = self._next_call + 1
        callback_task = current_callback_task.get()
        future: CallFuture[A] = CallFuture(self, call, callback_task)
        if callback_task is not None:
            callback_task.call_started()
        channel = link.channel
        if channel is None and (link.connections or self.context.stopping):
            self._fail(future, self._no_broker())
            return future
        most = MAX_EARLY if channel is None else MAX_PENDING
        unsent = self._early_bytes if channel is None else channel.outbox.urgent_bytes
        if len(self._pending) >= most or unsent >= MAX_UNSENT_BYTES:
            crowd = f"{len(self._pending)} calls of this client and {unsent} unsent bytes"
            self._fail(future, ServiceOverloaded(f"Service '{self.srv_name}': {crowd} wait already"))
            return future
        self._pending[call] = future
        if limit != math.inf:
            self._deadlines.add(call, loop.time() + limit)
        if channel is None:
            self._early[call] = request, body, loop.time() + limit
        else:
            self._send(call, request, body, limit)
        return future

    def _send(self, call: int, request: Q, body: bytes, limit: float) -> None:
        remaining_ms = None if limit == math.inf else math.ceil(min(limit * 1000, limits.MAX_U32))
        attributes = None
        if self._events is not None:
            attributes = self._tell_request(self._events, call, request)
        self._outgoing.send(RequestEntry(call, remaining_ms, attributes, body), self, self.context.link)

    @property
    def _early_bytes(self) -> int:
        return sum(len(body) for _, body, _ in self._early.values())

    def _no_broker(self) -> ServiceUnavailable:
        text = f"Service '{self.srv_name}': not connected to the broker at {self.context.link.place}"
        return ServiceUnavailable(text)

    def accepted(self, number: int) -> None:
        """Endpoint: the broker knows the client; what waited for the first session may go."""
        super().accepted(number)
        now = self.context.require_loop().time()
        early, self._early = self._early, {}
        for call, (request, body, deadline) in early.items():
            self._send(call, request, body, max(0.0, deadline - now))

    def retire(self) -> None:
        """The node stops: calls that wait for its first session fail, as nothing else would end them soon."""
        early, self._early = self._early, {}
        for call in early:
            self._deadlines.remove(call)
            self._fail(self._pending.pop(call), self._no_broker())

    def _tell_request(self, events: ServiceEvents, call: int, request: Q) -> frames.Options:
        """Publish that a request leaves; return the attributes by which the server tells of the same call."""
        identity = CallIdentity(self.gid, call)
        events.request(EventKind.REQUEST_SENT, identity, request)
        return identity.attributes()

    def flush_turn(self) -> None:
        """Put what this loop turn sent into the outbox. Called by the link."""
        channel = self.context.link.channel
        outgoing = self._outgoing.take()
        cancelled, self._cancelled = self._cancelled, []
        if channel is None or self.destroyed:
            return
        if cancelled:  # first: these make room for those
            channel.outbox.cancel_calls(self.id, cancelled)
        if outgoing:
            raw = encode(frames.Request(self.id, outgoing))
            channel.outbox.put_calls(raw, (self.id, outgoing[0].call))

    def replied(self, entry: ReplyEntry) -> None:
        """A call has ended at the server or the broker. Late replies are counted and ignored."""
        future = self._pending.pop(entry.call, None)
        if future is None:
            self.late += 1
            return
        self._deadlines.remove(entry.call)
        if entry.status == Status.OK:
            try:
                reply = self._replies.decode(entry.body)
            except InvalidMessageError as error:
                self._fail(future, RemoteError(type(error).__name__, str(error)))
                return
            if self._events is not None:
                identity = CallIdentity(self.gid, entry.call)
                self._events.response(EventKind.RESPONSE_RECEIVED, identity, reply)
            future.leave_callback_task()
            if not future.done():
                future.set_result(reply)
        else:
            self._fail(future, self._failure(entry))

    def _failure(self, entry: ReplyEntry) -> CallFailed:
        if entry.status in {Status.REMOTE_ERROR, Status.INVALID_REQUEST, Status.INVALID_REPLY}:
            return RemoteError(*_remote_error(entry.body))
        text = entry.body.decode("utf-8", "replace")
        failure = _UNSERVED.get(entry.status)
        if failure is None:
            return RemoteError(f"Status {entry.status}", text)
        return failure(f"Service '{self.srv_name}': {text}")

    def _fail(self, future: CallFuture[A], error: Exception) -> None:
        future.leave_callback_task()
        if not future.done():
            self.failed += 1
            future.set_exception(error)

    def _expired(self, call: int) -> None:
        future = self._pending.pop(call, None)
        if future is None:
            return
        self.timeouts += 1
        if self._early.pop(call, None) is not None:
            self._fail(future, self._no_broker())
        else:
            self._withdraw(call)
            self._fail(future, ServiceTimeout(f"Service '{self.srv_name}': no reply in time"))

    def give_up(self, call: int) -> None:
        """The caller no longer wants the reply."""
        future = self._pending.pop(call, None)
        if future is not None:
            self._deadlines.remove(call)
            future.leave_callback_task()
            self._withdraw(call)

    def _withdraw(self, call: int) -> None:
        """Take a request back that has not left; cancel one that has."""
        if self._early.pop(call, None) is None and not self._outgoing.take_back(call):
            self._cancelled.append(call)
            self.context.link.flush_later(self)

    def _take_pending(self) -> Iterator[CallFuture[A]]:
        pending, self._pending = self._pending, {}
        self._outgoing.take()
        self._early.clear()
        self._deadlines.clear()
        yield from pending.values()

    def destroy(self) -> None:
        """Cancel the calls in flight and take the client back."""
        if self.destroyed:
            return
        channel = self.context.link.channel
        if channel is not None:
            for call in self._pending:  # a large request that has not left whole need not travel
                channel.outbox.drop_call((self.id, call))
        for future in self._take_pending():
            future.leave_callback_task()
            future.cancel()
        super().destroy()

    def refused(self, code: int, text: str) -> None:
        """Endpoint: the broker will not have this client; its calls fail."""
        super().refused(code, text)
        for future in self._take_pending():
            self._fail(future, ServiceUnavailable(f"Service '{self.srv_name}': {text}"))

    def link_lost(self) -> None:
        """Endpoint: calls in flight fail at once."""
        super().link_lost()
        for future in self._take_pending():
            text = f"Service '{self.srv_name}': the link to the broker broke before the reply"
            self._fail(future, ServiceUnavailable(text))

    def diagnostics(self) -> ClientDiagnostics:
        """Say how it is doing."""
        return ClientDiagnostics(
            id=self.id,
            service=self.srv_name,
            matched=self.peers,
            pending=len(self._pending),
            calls=self._next_call,
            failed=self.failed,
            timeouts=self.timeouts,
            late=self.late,
        )

    def declaration(self) -> frames.Frame:
        """Endpoint: declare the client."""
        return frames.Client(
            self.id, self.context.id, self.srv_name, type_name(self.srv_type), type_hash(self.srv_type)
        )


def _remote_error(body: bytes) -> tuple[str, str]:
    """Return type and text of a remote error; a server in another language may get it wrong."""
    try:
        kind, text = msgpack.unpackb(body)
        return str(kind), str(text)
    except (ValueError, TypeError, msgpack.UnpackException):
        return "RemoteError", "the server sent an error that cannot be read"

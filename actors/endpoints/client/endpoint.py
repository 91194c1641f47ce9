"""The runtime's side of a client: calls are sent as entries, many to a frame, and each of them ends."""

from __future__ import annotations

import asyncio
import itertools
import math
import secrets
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar, Final

import msgpack

from actors.callbacks.callback_task import CallbackTask, current_callback_task
from actors.callbacks.deadlines import Deadlines
from actors.endpoints.client.refused_calls import RefusedCalls, overloaded
from actors.endpoints.entries import TIMED_OUT, EntryBatch, remaining_ms
from actors.endpoints.service_introspection import CallIdentity, EventKind, IntrospectedEndpoint
from actors.endpoints.thread_entries import MAX_ENTRY_BYTES, ThreadEntries
from actors.errors import (
    CallFailed,
    NodeDestroyed,
    RemoteError,
    ServiceOverloaded,
    ServiceTimeout,
    ServiceUnavailable,
)
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.message import Message, type_hash, type_name
from actors.session.thread_channel import ThreadChannel
from proto import limits
from proto.untrusted_text import peer_text
from proto.wire import frames
from proto.wire.codec import encode
from proto.wire.codes import Status
from proto.wire.fragments import is_large
from proto.wire.frames import ReplyEntry, RequestEntry

if TYPE_CHECKING:
    from actors.diagnostics.records import ClientDiagnostics
    from actors.endpoints.client.thread_call import ThreadCall
    from actors.endpoints.context import NodeContext
    from actors.endpoints.reply_order import HeldReplies
    from actors.interfaces.codec import Codec, EncodedCodec

MAX_PENDING: Final = 200_000
"""Calls of one client without an answer; one more fails as ServiceOverloaded."""

MAX_EARLY: Final = 1000
"""Calls of one client that wait for the node's first session; one more fails as ServiceOverloaded."""

MAX_UNSENT_BYTES: Final = 64 * 1024 * 1024
"""While more bytes than this wait to be sent on a link, calls over it fail as ServiceOverloaded."""

_UNSERVED: Final[dict[int, type[ServiceUnavailable]]] = {
    Status.UNAVAILABLE: ServiceUnavailable,
    Status.OVERLOADED: ServiceOverloaded,
    Status.CANCELLED: ServiceUnavailable,
}


class CallFuture(asyncio.Future[Any]):
    """The reply to one call. Cancelling it cancels the call, at the server too."""

    request: RequestEntry | None = None
    """What was sent, for as long as it may have to be sent again."""

    def __init__(
        self,
        client: ClientEndpoint,
        call: int,
        callback_task: CallbackTask | None,
        loop: asyncio.AbstractEventLoop,
    ) -> None:
        super().__init__(loop=loop)
        self._client = client
        self._call = call
        self._callback_task = callback_task

    def cancel(self, msg: Any | None = None) -> bool:
        """Give up the call; the server's handler is cancelled."""
        if not super().cancel(msg):
            return False
        self._client.give_up(self._call)
        return True

    def ended(self) -> None:
        """Free the request; end the call for the callback task that it was made in."""
        self.request = None
        if self._callback_task is not None:
            self._callback_task.call_ended()
            self._callback_task = None


class ClientEndpoint(IntrospectedEndpoint):
    """What the runtime calls on a client.

    Attributes:
        gid: 16 bytes that identify this client in service events.
        pending: Calls in flight, by number.
        failed: Calls that have ended in an error so far, timeouts included.
        timeouts: Calls whose deadline has passed so far.
        late: Replies that arrived after their call had ended.
        held: Replies that wait for messages, if they do.
    """

    kind: ClassVar = "client"

    def __init__(
        self, context: NodeContext, srv_type: type, replies: Codec[Any] | EncodedCodec, name: str
    ) -> None:
        self._replies = replies
        super().__init__(context, srv_type, name)
        self.gid = secrets.token_bytes(limits.INSTANCE_BYTES)
        self.pending: dict[int, CallFuture | ThreadCall] = {}
        self.failed = self.timeouts = self.late = 0
        self.held: HeldReplies | None = None
        self._deadlines = Deadlines(self._expired)
        self._numbers = itertools.count(1)  # other threads take them, too
        self._last_call = 0
        self._outgoing: EntryBatch[RequestEntry] = EntryBatch()
        self._threads: ThreadEntries[RequestEntry] | None = None
        self._early: dict[int, tuple[object, bytes, float]] = {}
        """Calls that wait for the node's first session: request, its encoding, deadline in loop time."""
        self._refused = RefusedCalls(
            context.link,
            lambda entry: self._outgoing.send(entry, self, context.link),
            self._deadlines.get,
        )
        self._cancelled: list[int] = []
        context.link.add(self)

    def call(self, request: object, body: bytes, limit: float) -> CallFuture:
        """Send a request, encoded as `body`; return the future of the reply, due within `limit` seconds."""
        context, pending = self.context, self.pending
        loop = context.require_loop()
        call = self._last_call = next(self._numbers)
        callback_task = current_callback_task.get()
        future = CallFuture(self, call, callback_task, loop)
        if callback_task is not None:
            callback_task.call_started()
        channel = context.link.channel
        if channel is not None:
            most, unsent = MAX_PENDING, channel.outbox.urgent_bytes
        elif context.link.connections or context.stopping:
            self._fail(future, self._no_broker())
            return future
        else:
            most, unsent = MAX_EARLY, sum(len(each) for _, each, _ in self._early.values())
        if len(pending) >= most or unsent >= MAX_UNSENT_BYTES:
            crowd = f"{len(pending)} calls of this client and {unsent} unsent bytes"
            self._fail(future, ServiceOverloaded(f"Service '{self.srv_name}': {crowd} wait already"))
            return future
        pending[call] = future
        if limit != math.inf:
            self._deadlines.add(call, loop.time() + limit)
        if channel is None:
            self._early[call] = request, body, loop.time() + limit
            return future
        if self._early:  # the session is open, but the client not accepted yet
            self._send_early()
        self._send(future, call, request, body, limit)
        return future

    def accept_threads(self) -> None:
        """Let other threads than the loop's call; before they do."""
        self._threads = ThreadEntries(
            self.context.link, self._outgoing, self, lambda entries: frames.Request(self.id, entries)
        )

    def call_in_thread(self, body: bytes, call: ThreadCall) -> bool:
        """Send an encoded request from another thread than the loop's.

        It overtakes the calls that this thread has left to the loop, and that have not begun there.

        Args:
            body: The request.
            call: The call, which gets the reply.

        Returns:
            Whether the call is made, or has failed. Otherwise the loop has to make it.
        """
        link, pending, threads = self.context.link, self.pending, self._threads
        channel = link.channel
        if threads is None or not isinstance(channel, ThreadChannel) or len(body) > MAX_ENTRY_BYTES:
            return False
        if not self.peers or self.destroyed or self._refused or self.service_events is not None:
            return False
        if len(pending) >= MAX_PENDING or channel.busy:
            return False
        call.number = self._last_call = next(self._numbers)
        entry = call.request = RequestEntry(call.number, None, None, body)
        pending[call.number] = call
        # The end of a session ends the calls in flight: from here on this one, too, unless it came before.
        if self.pending is pending and link.channel is channel:
            threads.add(entry, channel, last=len(pending) == 1)
            return True
        return pending.pop(call.number, None) is None

    def _send(
        self, future: CallFuture | ThreadCall, call: int, request: object, body: bytes, limit: float
    ) -> None:
        attributes = None
        if self.service_events is not None:
            identity = CallIdentity(self.gid, call)
            attributes = identity.attributes()  # the server publishes its events of the same call under them
            sent = request if isinstance(request, Message) else body
            self.service_events.request(EventKind.REQUEST_SENT, identity, sent)
        entry = future.request = RequestEntry(call, remaining_ms(limit), attributes, body)
        if self._refused and is_large(body):  # after those that wait, to keep the order
            if not self._refused.add(entry):
                self._deadlines.remove(call)
                self._fail(self.pending.pop(call), overloaded(self.srv_name))
            return
        if self._threads:  # to keep the order as well
            self._threads.flush()
        self._outgoing.send(entry, self, self.context.link)

    def _no_broker(self) -> ServiceUnavailable:
        text = f"Service '{self.srv_name}': not connected to the broker at {self.context.link.broker_urls}"
        return ServiceUnavailable(text)

    def accepted(self, number: int) -> None:
        """Send the calls that waited for the first session."""
        del number
        self._send_early()

    def _send_early(self) -> None:
        now = self.context.require_loop().time()
        early, self._early = self._early, {}
        for call, (request, body, deadline) in early.items():
            self._send(self.pending[call], call, request, body, max(0.0, deadline - now))

    def retire(self) -> None:
        """Fail calls that wait to be sent, as the node stops: nothing else would end them soon."""
        early, self._early = self._early, {}
        for call in early:
            self._deadlines.remove(call)
            self._fail(self.pending.pop(call), self._no_broker())
        for call in self._refused.pop_all():
            self._deadlines.remove(call)
            self._fail(self.pending.pop(call), overloaded(self.srv_name))

    def flush_turn(self) -> None:
        """Put the calls and cancellations of this loop turn into the outbox. Called by the link."""
        channel = self.context.link.channel
        outgoing = self._outgoing.peek_all()
        cancelled, self._cancelled = self._cancelled, []
        if channel is not None and not self.destroyed:
            if cancelled:  # first, as they make space for the calls
                channel.outbox.cancel_calls(self.id, cancelled)
            if outgoing:
                raw = encode(frames.Request(self.id, outgoing))
                channel.outbox.put_calls(raw, (self.id, outgoing[0].call))
        self._outgoing.pop_all()  # only now: a thread must see them here or in the outbox

    def replied(self, entries: tuple[ReplyEntry, ...]) -> None:
        """End calls with their replies. Late replies are counted and ignored."""
        for entry in entries:
            future = self.pending.pop(entry.call, None)
            if future is None:
                self.late += 1
                continue
            if entry.status != Status.OK:
                if self._refused.add_refused(future.request, entry):
                    self.pending[entry.call] = future
                else:
                    self._deadlines.remove(entry.call)
                    self._fail(future, self._failure(entry))
                continue
            self._deadlines.remove(entry.call)
            try:
                # A caller may wait for all of its calls, and keep their replies until then.
                reply = self._replies.decode_held(entry.body, len(self.pending))
            except InvalidMessageError as error:
                self._fail(future, RemoteError(type(error).__name__, peer_text(str(error)), self.srv_name))
                continue
            if self.service_events is not None:
                identity = CallIdentity(self.gid, entry.call)
                self.service_events.response(EventKind.RESPONSE_RECEIVED, identity, reply)
            future.ended()
            if entry.attributes is not None and self.held is not None:
                self.held.hold(entry.attributes, partial(_set_result, future, reply))
            elif not future.done():
                future.set_result(reply)

    def _failure(self, entry: ReplyEntry) -> CallFailed:
        if entry.status in {Status.REMOTE_ERROR, Status.INVALID_REQUEST, Status.INVALID_REPLY}:
            return RemoteError(*remote_error(entry.body), self.srv_name)
        text = self.refusal or peer_text(entry.body.decode("utf-8", "replace"))
        if entry.status == Status.CANCELLED and TIMED_OUT in (entry.attributes or ()):
            return ServiceTimeout(f"Service '{self.srv_name}': {text}")
        failure = _UNSERVED.get(entry.status)
        if failure is None:
            return RemoteError(f"Status {entry.status}", text, self.srv_name)
        return failure(f"Service '{self.srv_name}': {text}")

    def _fail(self, future: CallFuture | ThreadCall, error: Exception) -> None:
        future.ended()
        if not future.done():
            self.failed += 1
            future.set_exception(error)

    def _expired(self, call: int) -> None:
        future = self.pending.pop(call, None)
        if future is None:
            return
        self.timeouts += 1
        if self._early.pop(call, None) is not None:
            self._fail(future, self._no_broker())
        elif self._refused.remove(call):
            self._fail(future, overloaded(self.srv_name))
        else:
            self._withdraw(call)
            self._fail(future, ServiceTimeout(f"Service '{self.srv_name}': no reply in time"))

    def give_up(self, call: int) -> None:
        """End a call whose caller no longer wants the reply."""
        future = self.pending.pop(call, None)
        if future is not None:
            self._deadlines.remove(call)
            future.ended()
            self._withdraw(call)

    def _withdraw(self, call: int) -> None:
        """Take back a request that has not been sent; cancel one that has."""
        if self._early.pop(call, None) is not None or self._refused.remove(call):
            return
        if self._threads:
            self._threads.flush()
        if not self._outgoing.withdraw(call):
            self._cancelled.append(call)
            self.context.link.flush_later(self)

    def _pop_pending(self) -> list[CallFuture | ThreadCall]:
        pending, self.pending = self.pending, {}
        self._outgoing.pop_all()
        if self._threads:
            self._threads.clear()
        self._early.clear()
        self._refused.pop_all()
        self._deadlines.clear()
        return list(pending.values())

    def destroy(self) -> None:
        """Take the client out of service; calls in flight raise NodeDestroyed."""
        if self.destroyed:
            return
        self.context.link.require_thread()
        channel = self.context.link.channel
        if channel is not None:
            # The rest of a large request need not be sent. A copy: a thread may add a call meanwhile.
            for call in tuple(self.pending):
                channel.outbox.drop_call((self.id, call))
        # Not cancelled: in a task that nobody cancelled, CancelledError would look like a cancellation, and a
        # TaskGroup would swallow it.
        for future in self._pop_pending():
            self._fail(future, NodeDestroyed(f"Service '{self.srv_name}': the client has been destroyed"))
            if isinstance(future, CallFuture) and not future.cancelled():
                future.exception()  # if nobody awaits it, asyncio must not report what the caller did himself
        if self.held is not None:
            self.held.release_all()  # they have arrived
        super().destroy()

    def refused(self, code: int, text: str) -> None:
        """Fail all calls."""
        super().refused(code, text)
        for future in self._pop_pending():
            self._fail(future, ServiceUnavailable(f"Service '{self.srv_name}': {text}"))

    def session_ended(self) -> None:
        """Fail calls in flight at once."""
        super().session_ended()
        for future in self._pop_pending():
            text = f"Service '{self.srv_name}': the link to the broker broke before the reply"
            self._fail(future, ServiceUnavailable(text))

    def declaration(self) -> frames.Frame:
        """Declare the client."""
        return frames.Client(
            self.id, self.context.id, self.srv_name, type_name(self.srv_type), type_hash(self.srv_type)
        )

    def diagnostics(self) -> ClientDiagnostics:
        """Return its state and counts."""
        from actors.diagnostics.records import ClientDiagnostics  # noqa: PLC0415 - seldom needed

        return ClientDiagnostics(
            id=self.id,
            service=self.srv_name,
            matched=self.peers,
            pending=len(self.pending),
            calls=self._last_call,
            failed=self.failed,
            timeouts=self.timeouts,
            late=self.late,
        )


def _set_result(future: CallFuture | ThreadCall, reply: Any) -> None:
    if not future.done():
        future.set_result(reply)


def remote_error(body: bytes) -> tuple[str, str]:
    """Return type and text of a remote error; a server in another language may send something else."""
    try:
        kind, text = msgpack.unpackb(body)
        return peer_text(str(kind)), peer_text(str(text))
    except (ValueError, TypeError, RecursionError, msgpack.UnpackException):
        return "RemoteError", "the server sent an error that cannot be read"

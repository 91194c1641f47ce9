"""Services: requests come in, go through the mailbox to the handler, and always end in a reply."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any, Final, Generic, TypeVar, cast

import msgpack

from actors.callbacks.callback_task import CallbackTask
from actors.callbacks.functions import ENDS_PROGRAM, as_coroutine, takes
from actors.diagnostics.records import ServiceDiagnostics
from actors.endpoints.context import NodeContext, Server
from actors.endpoints.entries import EntryBatch
from actors.endpoints.service.request_queue import MAX_QUEUED, RequestQueue
from actors.endpoints.service_introspection import CallIdentity, EventKind, Introspectable
from actors.errors import error_text
from actors.interfaces.codec import Codec, codec_for
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.message import Message, definition, type_hash, type_name
from proto import frames
from proto.codec import encode
from proto.codes import Status
from proto.frames import ReplyEntry, RequestEntry

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.callbacks.mailbox import Share

Q = TypeVar("Q", bound=Message)
A = TypeVar("A", bound=Message)

MAX_RUNNING: Final = 1000
"""Handlers of one service that are suspended at the same time; more requests wait."""

STOPPING: Final = "the node is stopping"

MAX_ERROR_TEXT: Final = 4000
"""Characters of an exception's text that travel to the caller."""


class Service(Introspectable, Server, Generic[Q, A]):
    """Serves requests. Made by `Node.create_service`.

    The callback is `(request, response) -> response` or `(request) -> response`, `def` or `async def`. What
    it raises reaches the caller as RemoteError and is logged here. A handler whose caller has given up is
    cancelled.

    Attributes:
        srv_name: The full name of the service.
        served: Requests answered so far, errors included.
        calls: Requests handed to the callback so far.
        errors: Requests answered with an error so far.
    """

    def __init__(
        self,
        context: NodeContext,
        srv_type: type,
        request_type: type[Q],
        response_type: type[A],
        name: str,
        *,
        callback: Callable[..., Any],
        concurrent: bool,
    ) -> None:
        self._requests: Codec[Q] = codec_for(request_type)
        self._replies: Codec[A] = codec_for(response_type)
        self._response_type = response_type
        self._with_response = takes(callback, (1, 2), "service") == 2
        super().__init__(context)
        self.srv_type = srv_type
        self.srv_name = name
        self.posted = False
        self.served = 0
        self.calls = self.errors = 0
        self.timing = context.watch.of(callback, f"the service '{name}'")
        self._callback = callback
        self._concurrent = concurrent
        self._waiting = RequestQueue()
        self._running: dict[int, CallbackTask] = {}
        """Handlers whose callers wait, by call."""
        self._turns = 0
        """Handlers under way, those included that nobody waits for any more and that ignore it."""
        self._outgoing: EntryBatch[ReplyEntry] = EntryBatch()
        context.link.add(self)

    @property
    def pending(self) -> int:
        """Requests that wait or are being handled."""
        return len(self._waiting.entries) + len(self._running)

    def requested(self, entries: tuple[RequestEntry, ...]) -> None:
        """Requests came."""
        if self.context.stopping:
            for entry in entries:
                self._reply_text(entry.call, Status.UNAVAILABLE, STOPPING)
            return
        put = self._waiting.put
        for entry in entries:
            refusal = put(entry)
            if refusal is not None:
                self._reply_text(entry.call, Status.OVERLOADED, refusal)
        self.context.mailbox.post(self)

    def cancelled(self, calls: tuple[int, ...]) -> None:
        """Callers have given up."""
        for call in calls:
            if not self._waiting.remove(call):
                callback_task = self._running.get(call)
                if callback_task is not None:
                    callback_task.cancel()

    def has_work(self) -> bool:
        """Source: whether a handler could run now."""
        return bool(self._waiting.entries) and self._turns < MAX_RUNNING and not self.destroyed

    def dispatch(self, share: Share) -> CallbackTask | None:
        """Source: run the handler for what waits, until it returns something to await."""
        while self.has_work():
            callback_task = self._handle(self._waiting.take())
            if callback_task is not None:
                if not self._concurrent:
                    return callback_task
                self.context.mailbox.run_beside(callback_task)
            if self._waiting.entries and share.used:
                break
        return None

    def _handle(self, entry: RequestEntry) -> CallbackTask | None:
        """Run the handler for a request; return a turn if it returned something to await."""
        call = entry.call
        try:
            request = self._requests.decode(entry.body)
        except InvalidMessageError as error:
            self._reply_error(call, Status.INVALID_REQUEST, error)
            return None
        self.calls += 1
        if self._events is not None:
            identity = CallIdentity.of(entry.attributes, call)
            self._events.request(EventKind.REQUEST_RECEIVED, identity, request)
        try:
            if self._with_response:
                result = self._callback(request, self._response_type())
            else:
                result = self._callback(request)
        except ENDS_PROGRAM:
            raise
        except BaseException as error:  # noqa: BLE001 - the user's: logged, counted, sent to the caller
            self._raised(call, error)
            return None
        coroutine = as_coroutine(result)
        if coroutine is None:
            self._reply(call, result, entry.attributes)
            return None
        return self._callback_task(call, coroutine, entry.attributes)

    def _callback_task(self, call: int, coroutine: Any, attributes: frames.Options | None) -> CallbackTask:
        def ended(result: object, error: BaseException | None) -> None:
            self._turns -= 1
            if self._running.get(call) is not callback_task:
                self._ended_in_vain(error)
            else:
                del self._running[call]
                if error is None:
                    self._reply(call, result, attributes)
                elif callback_task.cancelled and isinstance(error, asyncio.CancelledError):
                    self._reply_text(call, Status.CANCELLED, "the handler was cancelled")
                else:
                    self._raised(call, error)
            if self.has_work():
                self.context.mailbox.post(self)
            elif self.context.stopping:
                self._leave_if_done()

        callback_task = CallbackTask(
            self.context.mailbox, coroutine, ended, timing=self.timing, beside=self._concurrent
        )
        self._running[call] = callback_task
        self._turns += 1
        return callback_task

    def _raised(self, call: int, error: BaseException) -> None:
        self._reply_error(call, Status.REMOTE_ERROR, error)
        self.context.callback_failed(self.timing.what, error)

    def _ended_in_vain(self, error: BaseException | None) -> None:
        """A handler whose call was abandoned has ended: its call number may be another call's by now."""
        if error is not None and not isinstance(error, asyncio.CancelledError):
            self.context.callback_failed(self.timing.what, error)

    def _reply(self, call: int, response: object, attributes: frames.Options | None) -> None:
        try:
            body = self._replies.encode(cast("A", response))
            if len(body) > self.context.link.largest:
                self.context.link.require_fits(f"A response of '{self.srv_name}'", len(body))
        except (TypeError, InvalidMessageError) as error:
            self._reply_error(call, Status.INVALID_REPLY, error)
            self.context.callback_failed(
                f"{self.timing.what} did not return a valid {type_name(self._response_type)}; it", error
            )
            return
        self._send(_entry(call, Status.OK, body))
        if self._events is not None:
            identity = CallIdentity.of(attributes, call)
            self._events.response(EventKind.RESPONSE_SENT, identity, cast("A", response))

    def _reply_error(self, call: int, status: Status, error: BaseException) -> None:
        self.errors += 1
        body = msgpack.packb([type(error).__name__, error_text(error)[:MAX_ERROR_TEXT]])
        self._send(_entry(call, status, body))

    def _reply_text(self, call: int, status: Status, text: str) -> None:
        self.errors += 1
        self._send(_entry(call, status, text.encode()))

    def _send(self, entry: ReplyEntry) -> None:
        self.served += 1
        self._outgoing.send(entry, self, self.context.link)

    def flush_turn(self) -> None:
        """Put what this loop turn answered into the outbox. Called by the link."""
        outgoing = self._outgoing.take()
        channel = self.context.link.channel
        if outgoing and channel is not None and not self.destroyed:
            raw = encode(frames.Reply(self.id, outgoing))
            channel.outbox.put_calls(raw, (self.id, outgoing[0].call))

    def _abandon(self) -> None:
        """Nobody waits for these replies any more."""
        self._waiting.clear()
        self._outgoing.take()
        running, self._running = self._running, {}
        for callback_task in running.values():
            callback_task.cancel()

    def retire(self) -> None:
        """The node stops: refuse what waits and what comes; leave with the last handler that runs.

        The broker is told, so that it gives new requests to other servers.
        """
        channel = self.context.link.channel
        if channel is not None and self._running:
            channel.send(frames.Retire(self.id))
        while self._waiting.entries:
            call = self._waiting.take().call
            self._reply_text(call, Status.UNAVAILABLE, STOPPING)
        self._leave_if_done()

    def _leave_if_done(self) -> None:
        if not self._running:
            self.destroy()

    def destroy(self) -> None:
        """Serve nothing more; handlers that run are cancelled, their callers see ServiceUnavailable."""
        if self.destroyed:
            return
        self.flush_turn()
        link = self.context.link
        link.remove(self, announce=False)
        channel = link.channel
        if channel is not None:
            farewell = encode(frames.Undeclare(self.id))
            if not channel.outbox.put_after_calls(self.id, farewell):
                channel.send(frames.Retire(self.id))  # until the replies made so far have left
            channel.flush_soon()
        super().destroy()
        self._abandon()

    def link_lost(self) -> None:
        """Endpoint: the callers have been told that the link broke."""
        super().link_lost()
        self._abandon()

    def diagnostics(self) -> ServiceDiagnostics:
        """Say how it is doing."""
        return ServiceDiagnostics(
            id=self.id,
            service=self.srv_name,
            waiting=len(self._waiting.entries),
            waiting_bytes=self._waiting.size,
            queue_limit=MAX_QUEUED,
            running=self._turns,
            served=self.served,
            errors=self.errors,
            callback=self.timing.diagnostics(self.calls),
        )

    def declaration(self) -> frames.Frame:
        """Endpoint: declare the service."""
        return frames.Service(
            self.id,
            self.context.id,
            self.srv_name,
            type_name(self.srv_type),
            type_hash(self.srv_type),
            definition(self.srv_type),
        )


def _entry(call: int, status: Status, body: bytes) -> ReplyEntry:
    return ReplyEntry(call, status, more=False, attributes=None, body=body)

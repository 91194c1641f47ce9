"""The runtime's side of a service: requests go through the mailbox to the handler.

Each request ends in a reply.
"""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any, ClassVar, Final, cast

from actors.callbacks.callback_future import CallbackFuture, is_own_future
from actors.callbacks.callback_task import CallbackTask
from actors.callbacks.functions import ENDS_PROGRAM, as_coroutine, takes
from actors.endpoints.service.late_reply import LateReply
from actors.endpoints.service.replies import Replies
from actors.endpoints.service.request_queue import MAX_QUEUED, RequestQueue
from actors.endpoints.service_introspection import CallIdentity, EventKind, IntrospectedEndpoint
from actors.endpoints.thread_entries import MAX_ENTRY_BYTES
from actors.errors import CallFailed
from actors.interfaces.codec import EncodedCodec, codec_for
from actors.interfaces.errors import InvalidMessageError, MessageBudgetError
from actors.interfaces.message import declared_type, definition, type_name
from proto.wire import frames
from proto.wire.codec import encode
from proto.wire.codes import Status
from proto.wire.frames import ReplyEntry

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.callbacks.callback_future import LateCallback
    from actors.callbacks.source import Share
    from actors.diagnostics.records import ServiceDiagnostics
    from actors.endpoints.context import NodeContext
    from actors.endpoints.thread_entries import ThreadEntries
    from proto.wire.frames import RequestEntry

MAX_RUNNING: Final = 1000
"""Handlers of one service that are suspended at the same time; more requests wait."""

STOPPING: Final = "the node is stopping"
_NO_RESPONSE: Final = "the handler returned None: end it with `return response`"


class DeclaredService(IntrospectedEndpoint):
    """A service that the broker knows."""

    kind: ClassVar = "service"

    def declaration(self) -> frames.Frame:
        """Declare the service."""
        return frames.Service(
            self.id,
            self.context.id,
            self.srv_name,
            *declared_type(self.srv_type),
            None if self.standard else definition(self.srv_type),
        )

    def diagnostics(self) -> ServiceDiagnostics:
        """Return its state and counts."""
        raise NotImplementedError


class ServiceEndpoint(DeclaredService):
    """What the runtime calls on a service.

    Attributes:
        waiting: Requests that have not been handed to the callback.
        running: Suspended handlers whose callers wait, by call.
        replies: Sends the replies.
        reply_attributes: Returns the attributes of the response that is about to be sent.
        calls: Requests handed to the callback so far.
        posted, timing, concurrent: See `CallbackSource`.
    """

    reply_attributes: Callable[[], frames.Options | None] | None = None

    def __init__(
        self,
        context: NodeContext,
        srv_type: type,
        request_type: type[Any],
        response_type: type[Any],
        name: str,
        *,
        callback: Callable[..., Any],
        concurrent: bool,
        replaced: DeclaredService | None = None,
        raw: bool = False,
    ) -> None:
        self._requests = EncodedCodec() if raw else codec_for(request_type)
        replies = EncodedCodec() if raw else codec_for(response_type)
        self.replies = Replies(self, context.link, replies, name)
        self._response_type = response_type
        self._result_type = bytes if raw else response_type
        # A response of bytes cannot be filled in.
        arguments = (1,) if raw else (1, 2)
        self._with_response = replaced is None and takes(callback, arguments, "service") == 2
        super().__init__(context, srv_type, name)
        self.posted = False
        self.calls = 0
        self.timing = context.watch.of(callback, "the service", name)
        self.waiting = RequestQueue(MAX_QUEUED)
        self.running: dict[int, CallbackTask | LateCallback] = {}
        self._callback = callback
        self.concurrent = concurrent
        self._suspended: set[CallbackTask | LateCallback] = set()
        """Suspended handlers, including those whose callers have given up."""
        self._threads: ThreadEntries[ReplyEntry] | None = None
        """Replies from other threads, if there are any."""
        self._going_on = False
        """Whether the loop will look at what has waited for late replies."""
        if replaced is None:
            context.link.add(self)
        else:
            self.id, self.peers, self.standard = replaced.id, replaced.peers, replaced.standard
            del context.endpoints[replaced]
            context.link.endpoints[self.id] = self

    def cancel_all_late(self) -> None:
        """Cancel the requests whose late replies have not come."""
        for each in tuple(self._suspended):
            if isinstance(each, LateReply):
                each.cancel()

    def requested(self, entries: tuple[RequestEntry, ...]) -> None:
        """Queue requests for the callback."""
        if self.context.stopping:
            for entry in entries:
                self.replies.send_text(entry.call, Status.UNAVAILABLE, STOPPING)
            return
        put = self.waiting.put
        for entry in entries:
            refusal = put(entry)
            if refusal is not None:
                self.replies.send_text(entry.call, Status.OVERLOADED, refusal)
        self.context.mailbox.post(self)

    def cancelled(self, calls: tuple[int, ...]) -> None:
        """Cancel the handlers of calls whose callers have given up."""
        for call in calls:
            if not self.waiting.remove(call):
                callback_task = self.running.get(call)
                if callback_task is not None:
                    callback_task.cancel()

    def has_work(self) -> bool:
        """CallbackSource: whether a handler could run now."""
        return bool(self.waiting.entries) and len(self._suspended) < MAX_RUNNING and not self.destroyed

    def dispatch(self, share: Share) -> CallbackTask | None:
        """CallbackSource: run the handler for what waits, until it returns something to await."""
        while self.has_work():
            callback_task = self._handle(self.waiting.pop())
            if callback_task is not None:
                if not self.concurrent:
                    return callback_task
                self.context.mailbox.run_concurrently(callback_task)
            if self.waiting.entries and share.used:
                break
        return None

    def _handle(self, entry: RequestEntry) -> CallbackTask | None:
        """Run the handler for a request; return a callback task if it returned something to await."""
        call = entry.call
        try:
            # Handlers that are suspended keep their requests.
            request = self._requests.decode_held(entry.body, len(self._suspended))
        except InvalidMessageError as error:
            if isinstance(error, MessageBudgetError):
                self.context.log.warning(
                    f"Refused a request for '{self.srv_name}': {error}", throttle_duration_sec=1.0
                )
            self.replies.send_error(call, Status.INVALID_REQUEST, error)
            return None
        self.calls += 1
        if self.service_events is not None:
            identity = CallIdentity.of(entry.attributes, call)
            self.service_events.request(EventKind.REQUEST_RECEIVED, identity, request)
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
        # Nearly every plain handler returns a response: whether that may be awaited need not be asked.
        if type(result) is self._result_type:
            self._reply(call, result, entry.attributes)
            return None
        if isinstance(result, LateReply):
            self._reply_later(result, entry)
            return None
        # Without a task: it need not be run, and there may be thousands of requests a second.
        awaited = result if self.concurrent and is_own_future(result) else as_coroutine(result)
        if awaited is None:
            self._reply(call, result, entry.attributes)
            return None
        return self._suspend(call, awaited, entry.attributes)

    def send_late(self, late: LateReply, body: bytes) -> None:
        """Send the encoded response to a request, unless it has ended; in any thread."""
        link, running, threads = self.context.link, self.running, self._threads
        channel = link.channel
        # From here on nobody else answers it. The loop may run between any two of these steps.
        if threads is None or not self._end_late(late):
            return
        extras = self.service_events is not None or self.reply_attributes is not None
        if extras or len(body) > MAX_ENTRY_BYTES:
            link.post(self._send_late, late, body)
            return
        # Otherwise the call was abandoned, and its number may be another call's by now.
        if running.get(late.call) is late:
            del running[late.call]
            self.replies.sent += 1
            entry = ReplyEntry(late.call, Status.OK, more=False, attributes=None, body=body)
            threads.add(entry, channel, last=not (running or self.waiting.entries))
        self.context.mailbox.running.pop(late, None)
        # After them: the loop may have waited for this handler.
        if (self.context.stopping or self.waiting.entries) and not self._going_on:
            self._going_on = True
            link.post(self._after_late, late)

    def _end_late(self, late: LateReply) -> bool:
        """End a request that gets its reply; return whether it had not ended."""
        try:
            self._suspended.remove(late)
        except KeyError:
            return False
        late.end()
        return True

    def _send_late(self, late: LateReply, body: bytes) -> None:
        if self.running.get(late.call) is late:
            del self.running[late.call]
            self._reply(late.call, body, late.attributes, body)
        self._after_late(late)

    def fail_late(self, late: LateReply, error: BaseException) -> None:
        """Answer a request with an error, unless it has ended; in any thread.

        One that ends the program cancels it.
        """
        self.context.link.post(self._fail_late, late, error)

    def cancel_late(self, late: LateReply) -> None:
        """Answer that a request was cancelled, unless it has ended; in the loop."""
        self._fail_late(late, None)

    def _fail_late(self, late: LateReply, error: BaseException | None) -> None:
        if not self._end_late(late):
            return
        if self.running.get(late.call) is late:
            del self.running[late.call]
            if isinstance(error, Exception):
                self._raised(late.call, error)
            else:
                self.replies.send_text(late.call, Status.CANCELLED, "the handler was cancelled")
        self._after_late(late)

    def _after_late(self, late: LateReply) -> None:
        self._going_on = False
        self.context.mailbox.task_ended(late)
        self._go_on()

    def _go_on(self) -> None:
        """Begin what has waited for the end of a handler."""
        if self.has_work():
            self.context.mailbox.post(self)
        elif self.context.stopping:
            self._destroy_if_done()

    def _suspend(self, call: int, awaited: Any, attributes: frames.Options | None) -> CallbackTask | None:
        """Reply when a coroutine or a future has ended; return the callback task of a coroutine."""

        def ended(result: object, error: BaseException | None) -> None:
            self._suspended.discard(callback)
            if self.running.get(call) is not callback:
                # The call was abandoned, and its number may be another call's by now.
                if error is not None and not isinstance(error, asyncio.CancelledError):
                    self.context.callback_failed(self.timing.what, error)
            else:
                del self.running[call]
                if error is None:
                    self._reply(call, result, attributes)
                elif callback.cancelled and isinstance(error, asyncio.CancelledError):
                    self.replies.send_text(call, Status.CANCELLED, "the handler was cancelled")
                else:
                    self._raised(call, error)
            self._go_on()

        mailbox = self.context.mailbox
        callback: CallbackTask | CallbackFuture
        if asyncio.isfuture(awaited):
            callback = self.running[call] = CallbackFuture(mailbox, awaited, ended, self.timing.name)
            mailbox.running[callback] = None
            self._suspended.add(callback)
            return None
        callback = callback_task = self.running[call] = CallbackTask(mailbox, awaited, ended, self.timing)
        self._suspended.add(callback)
        return callback_task

    def _reply_later(self, late: LateReply, entry: RequestEntry) -> None:
        if self._threads is None:
            self._threads = self.replies.for_threads()
        late.begin(self, self.timing.name, entry.call, entry.attributes)
        self.running[entry.call] = late
        self._suspended.add(late)
        self.context.mailbox.running[late] = None
        late.begun()  # the response may be there at once

    def _raised(self, call: int, error: BaseException) -> None:
        # A raw handler forwards the call, and this is how that has ended.
        if isinstance(error, CallFailed) and self._result_type is bytes:
            self.replies.pass_on(call, error)
            return
        self.replies.send_error(call, Status.REMOTE_ERROR, error)
        self.context.callback_failed(self.timing.what, error)

    def _reply(
        self, call: int, response: object, attributes: frames.Options | None, body: bytes | None = None
    ) -> None:
        try:
            if response is None:
                raise TypeError(_NO_RESPONSE)
            self.replies.send(call, response, self.reply_attributes and self.reply_attributes(), body)
        except (TypeError, InvalidMessageError) as error:
            self.replies.send_error(call, Status.INVALID_REPLY, error)
            self.context.callback_failed(
                f"{self.timing.what} did not return a valid {type_name(self._response_type)}; it", error
            )
            return
        if self.service_events is not None:
            identity = CallIdentity.of(attributes, call)
            self.service_events.response(EventKind.RESPONSE_SENT, identity, cast("Any", response))

    def _abandon(self) -> None:
        """Cancel all handlers: no caller waits for these replies any more."""
        self.waiting.clear()
        self.replies.discard()
        if self._threads:
            self._threads.clear()
        running, self.running = self.running, {}
        for callback_task in tuple(running.values()):
            callback_task.cancel()

    def retire(self) -> None:
        """Refuse requests because the node stops; destroy the service when the last running handler ends.

        RETIRE lets the broker give new requests to other servers.
        """
        channel = self.context.link.channel
        if channel is not None and self.running:
            channel.send(frames.Retire(self.id))
        while self.waiting.entries:
            self.replies.send_text(self.waiting.pop().call, Status.UNAVAILABLE, STOPPING)
        self._destroy_if_done()

    def _destroy_if_done(self) -> None:
        if not self.running:
            self.destroy()

    def destroy(self) -> None:
        """Take the service out of service: handlers are cancelled, their callers get ServiceUnavailable."""
        if self.destroyed:
            return
        self.context.link.require_thread()
        if self._threads:
            self._threads.flush()
        self.replies.flush_turn()
        link = self.context.link
        link.remove(self, announce=False)
        channel = link.channel
        if channel is not None:
            undeclare = encode(frames.Undeclare(self.id))
            if not channel.outbox.put_after_calls(self.id, undeclare):
                channel.send(frames.Retire(self.id))  # until the replies made so far have been sent
            channel.flush_soon()
        super().destroy()
        self.context.leaves_after(self)
        self._abandon()

    def session_ended(self) -> None:
        """Abandon all calls: the broker reports the broken link to their callers."""
        super().session_ended()
        self._abandon()

    def diagnostics(self) -> ServiceDiagnostics:
        """Return its state and counts."""
        from actors.diagnostics.records import ServiceDiagnostics  # noqa: PLC0415 - seldom needed

        return ServiceDiagnostics(
            id=self.id,
            service=self.srv_name,
            waiting=len(self.waiting.entries),
            waiting_bytes=self.waiting.size,
            queue_limit=MAX_QUEUED,
            running=len(self._suspended),
            served=self.replies.sent,
            errors=self.replies.errors,
            callback=self.timing.diagnostics(self.calls),
        )

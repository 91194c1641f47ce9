"""A service's replies on their way out: encoded, counted, and collected over a loop turn."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import msgpack

from actors.endpoints.entries import TIMED_OUT, EntryBatch
from actors.endpoints.thread_entries import ThreadEntries
from actors.errors import (
    CallFailed,
    RemoteError,
    ServiceOverloaded,
    ServiceTimeout,
    ServiceUnavailable,
    error_text,
)
from proto import limits
from proto.wire import frames
from proto.wire.codec import encode
from proto.wire.codes import Status
from proto.wire.frames import ReplyEntry

if TYPE_CHECKING:
    from actors.endpoints.endpoint import Endpoint
    from actors.interfaces.codec import Codec, EncodedCodec
    from actors.session.link import Link


class Replies:
    """The replies of one service.

    Args:
        endpoint: The service's.
        link: The node's.
        codec: Encodes its responses.
        name: The service's, for messages.

    Attributes:
        sent: Requests answered so far, errors included.
        errors: Requests answered with an error so far.
    """

    __slots__ = ("_codec", "_endpoint", "_link", "_name", "_outgoing", "errors", "sent")

    def __init__(self, endpoint: Endpoint, link: Link, codec: Codec[Any] | EncodedCodec, name: str) -> None:
        self.sent = self.errors = 0
        self._endpoint = endpoint
        self._link = link
        self._codec = codec
        self._name = name
        self._outgoing: EntryBatch[ReplyEntry] = EntryBatch()

    def send(
        self,
        call: int,
        response: Any,
        attributes: frames.Options | None = None,
        body: bytes | None = None,
    ) -> None:
        """Send a response, with attributes for the client's runtime.

        Args:
            call: The call's number.
            response: The response.
            attributes: The attributes.
            body: The response as bytes, if it is encoded already.

        Raises:
            TypeError, InvalidMessageError: It is not a valid response, or too large; nothing was sent.
        """
        if body is None:
            body = self._codec.encode(response)
        if len(body) > self._link.largest:
            self._link.require_fits(f"A response of '{self._name}'", len(body))
        self.sent += 1
        entry = ReplyEntry(call, Status.OK, more=False, attributes=attributes, body=body)
        self._outgoing.send(entry, self, self._link)

    def for_threads(self) -> ThreadEntries[ReplyEntry]:
        """Return what sends replies of other threads than the loop's, which are counted by who adds them."""
        return ThreadEntries(
            self._link, self._outgoing, self, lambda entries: frames.Reply(self._endpoint.id, entries)
        )

    def send_error(self, call: int, status: Status, error: BaseException) -> None:
        """Send an exception's type and text."""
        body = msgpack.packb([type(error).__name__, error_text(error)[: limits.MAX_ERROR_TEXT]])
        self._refuse(call, status, body)

    def send_text(self, call: int, status: Status, text: str) -> None:
        """Send the reason why a request was not handled."""
        self._refuse(call, status, text.encode())

    def pass_on(self, call: int, error: CallFailed) -> None:
        """Let the client's call end as another one has, that was made for it."""
        if isinstance(error, RemoteError):
            self._refuse(call, Status.REMOTE_ERROR, msgpack.packb([error.type_name, error.text]))
        elif isinstance(error, ServiceOverloaded):
            self.send_text(call, Status.OVERLOADED, error_text(error))
        elif isinstance(error, ServiceUnavailable):
            self.send_text(call, Status.UNAVAILABLE, error_text(error))
        elif isinstance(error, ServiceTimeout):
            self._refuse(call, Status.CANCELLED, error_text(error).encode(), {TIMED_OUT: True})
        else:
            self.send_error(call, Status.REMOTE_ERROR, error)

    def _refuse(
        self, call: int, status: Status, body: bytes, attributes: frames.Options | None = None
    ) -> None:
        self.sent += 1
        self.errors += 1
        self._outgoing.send(
            ReplyEntry(call, status, more=False, attributes=attributes, body=body), self, self._link
        )

    def flush_turn(self) -> None:
        """Put the replies of this loop turn into the outbox. Called by the link."""
        outgoing = self._outgoing.pop_all()
        endpoint, channel = self._endpoint, self._link.channel
        if outgoing and channel is not None and not endpoint.destroyed:
            raw = encode(frames.Reply(endpoint.id, outgoing))
            channel.outbox.put_calls(raw, (endpoint.id, outgoing[0].call))

    def discard(self) -> None:
        """Discard replies that have not been sent."""
        self._outgoing.pop_all()

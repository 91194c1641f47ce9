"""Calls that the broker refused because other calls of this node wait for the server: they are sent again.

The broker limits the bytes of a node's calls that wait for one server's link (max_queued_call_bytes). A
client cannot keep this limit itself: it knows neither which server the broker chooses, nor when a server has
taken a request. To count all requests without a reply would allow only one large call at a time to a server
that works on many, and could hold back a call on which the reply to another depends. So the client sends
refused calls again until their deadlines; no server has received them. It does so after a delay, not after a
reply, since the reply may depend on the refused call, and replies to small calls do not show that there is
space.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.endpoints.entries import ENTRY_OVERHEAD_BYTES, remaining_ms
from actors.errors import ServiceOverloaded
from proto import limits
from proto.queues.queued_calls import WAITING_BYTES
from proto.wire.codes import Status

if TYPE_CHECKING:
    import asyncio
    from collections.abc import Callable

    from actors.session.link import Link
    from proto.wire.frames import ReplyEntry, RequestEntry

MAX_REFUSED: Final = 1000
"""Calls of one client that wait to be sent again; one more fails as ServiceOverloaded."""

MAX_REFUSED_BYTES: Final = 64 * 1024 * 1024
"""Bytes of one client's calls that wait to be sent again; one more fails as ServiceOverloaded."""

_MIN_DELAY_SEC: Final = 0.01
_MAX_DELAY_SEC: Final = 1.0


class RefusedCalls:
    """The calls of one client that wait to be sent again, the oldest first.

    Args:
        link: The node's link.
        send: Sends a request.
        deadline: Returns the deadline of a call, in loop time.
    """

    __slots__ = (
        "_backs_off",
        "_deadline",
        "_delay_sec",
        "_last_resent",
        "_link",
        "_send",
        "_timer",
        "_waiting",
    )

    def __init__(
        self, link: Link, send: Callable[[RequestEntry], None], deadline: Callable[[int], float]
    ) -> None:
        self._link = link
        self._send = send
        self._deadline = deadline
        self._waiting: dict[int, RequestEntry] = {}
        self._last_resent = 0
        self._timer: asyncio.TimerHandle | None = None
        self._delay_sec = _MIN_DELAY_SEC
        self._backs_off = False
        """Whether the next delay is longer: calls sent again were refused, or have not left yet."""

    def __len__(self) -> int:
        return len(self._waiting)

    def add_refused(self, request: RequestEntry | None, reply: ReplyEntry) -> bool:
        """Keep a call if the broker refused it because others of this node wait; return whether it did."""
        if reply.status != Status.OVERLOADED or WAITING_BYTES not in (reply.attributes or ()):
            return False
        self._backs_off = True
        return request is not None and self.add(request)

    def add(self, request: RequestEntry) -> bool:
        """Keep a call; return False if too many wait, unless it has waited before."""
        waiting, loop = self._waiting, self._link.loop
        if loop is None or (request.call > self._last_resent and self._is_full(len(request.body))):
            return False
        waiting[request.call] = request
        if self._timer is None:
            self._timer = loop.call_later(self._delay_sec, self._resend)
        return True

    def _is_full(self, size: int) -> bool:
        waiting = self._waiting.values()
        return len(waiting) >= MAX_REFUSED or (
            bool(waiting) and sum(len(each.body) for each in waiting) + size > MAX_REFUSED_BYTES
        )

    def remove(self, call: int) -> bool:
        """Forget a call; return whether it waited."""
        return self._waiting.pop(call, None) is not None

    def pop_all(self) -> list[int]:
        """Forget all calls; return their numbers."""
        calls = sorted(self._waiting)
        self._waiting.clear()
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        self._delay_sec, self._backs_off = _MIN_DELAY_SEC, False
        return calls

    def _resend(self) -> None:
        """Send the oldest calls again: one large or several small ones."""
        self._timer = None
        channel, loop = self._link.channel, self._link.loop
        if not self._waiting or channel is None or loop is None:
            self.pop_all()
            return
        self._delay_sec = min(2 * self._delay_sec, _MAX_DELAY_SEC) if self._backs_off else _MIN_DELAY_SEC
        self._timer = loop.call_later(self._delay_sec, self._resend)
        # While something is unsent, the last call may not have reached the broker, which may refuse it.
        self._backs_off = channel.outbox.urgent_bytes > 0
        if self._backs_off and self._delay_sec < _MAX_DELAY_SEC:
            return
        size = 0
        for call in sorted(self._waiting):
            request = self._waiting[call]
            size += len(request.body) + ENTRY_OVERHEAD_BYTES
            if size > limits.CALLS_FLUSH_BYTES and size > len(request.body) + ENTRY_OVERHEAD_BYTES:
                break
            del self._waiting[call]
            self._last_resent = call
            remaining = remaining_ms(max(0.0, self._deadline(call) - loop.time()))
            self._send(request._replace(remaining_ms=remaining))


def overloaded(service: str) -> ServiceOverloaded:
    """Return the error of a call that was not sent again."""
    text = "too many bytes of this node's calls wait: make fewer at once, or raise the broker's"
    return ServiceOverloaded(f"Service '{service}': {text} --max-queued-call-bytes")

"""Requests that wait for one server's link, counted for each client: the broker limits each client's share.

A server that reads slowly is not at fault if clients call it faster than it reads. So the broker refuses the
calls of a client whose share is full instead of closing the server's link. The calls of others still pass.

The outbox of the server's link subtracts a frame from its share when the frame is sent or dropped. A share
that is empty may be forgotten: its client gets a new one with the next call.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from proto.limits import FRAME_OVERHEAD_BYTES

if TYPE_CHECKING:
    from proto.wire.frames import Buffer

WAITING_BYTES: Final = "waiting_bytes"
"""Attribute of a refused call, if other calls of the same link wait for the server: their bytes."""

_FORGET_SHARES = 64
"""Shares that are kept before the empty ones are forgotten."""


class QueuedCalls:
    """The requests that wait for one server's link.

    Args:
        max_share_bytes: Bytes that may wait from one client.
        max_bytes: Bytes that may wait from all clients together.

    Attributes:
        bytes: Bytes that wait, from all clients.
    """

    __slots__ = ("_forget_at", "_shares", "bytes", "max_bytes", "max_share_bytes")

    def __init__(self, max_share_bytes: int, max_bytes: int) -> None:
        self.max_share_bytes = max_share_bytes
        self.max_bytes = max_bytes
        self.bytes = 0
        self._shares: dict[int, CallShare] = {}
        self._forget_at = _FORGET_SHARES

    def share(self, client: int) -> CallShare:
        """Return the share of the client link with this number."""
        share = self._shares.get(client)
        if share is None:
            # At twice the number that stayed last time: a search for each new client would cost its square.
            if len(self._shares) >= self._forget_at:
                self._shares = {number: each for number, each in self._shares.items() if each.bytes}
                self._forget_at = max(_FORGET_SHARES, 2 * len(self._shares))
            share = self._shares[client] = CallShare(self)
        return share


class CallShare:
    """The requests of one client that wait for one server's link.

    Attributes:
        all: The requests of all clients.
        bytes: Bytes that wait, from this client.
    """

    __slots__ = ("all", "bytes")

    def __init__(self, queued: QueuedCalls) -> None:
        self.all = queued
        self.bytes = 0

    def admit(self, raw: Buffer) -> bool:
        """Return whether another frame of requests may wait; if so, count it.

        A share grows up to its limit, but never beyond what is free, so that a few greedy clients leave
        something for others. If nothing of the client waits, one larger frame may take half of what is free.
        """
        every, size = self.all, len(raw) + FRAME_OVERHEAD_BYTES
        free = every.max_bytes - every.bytes
        held = self.bytes + size
        too_much = held > free or held > every.max_share_bytes
        if too_much and (self.bytes or (size > free // 2 and every.bytes)):
            return False
        self.bytes = held
        every.bytes += size
        return True

    def add(self, raw: Buffer) -> None:
        """Count a frame that is queued whatever the limits are: a CANCEL makes space, so it must pass."""
        size = len(raw) + FRAME_OVERHEAD_BYTES
        self.bytes += size
        self.all.bytes += size

    def remove(self, size: int) -> None:
        """Subtract a frame that is sent or dropped, with its overhead."""
        self.bytes -= size
        self.all.bytes -= size

"""The TLS of one connection, without its socket."""

from __future__ import annotations

import ssl
from contextlib import suppress
from typing import TYPE_CHECKING, Final, cast

from proto.wire.fragments import ByteTotal

if TYPE_CHECKING:
    from collections.abc import Callable

    from proto.aio.read_budget import ReadBudget
    from proto.wire.frames import Buffer

SHARE_RECORDS: Final = 500
"""Records that one connection may have decrypted in one loop turn. They may be of one byte, and each costs
microseconds."""


class Cipher:
    """TLS: bytes in, bytes out. Errors are `ssl.SSLError`.

    Args:
        context: Verifies the other end.
        host: The broker's name; None at the broker.
        budget: Counts what handshakes and decryption take.
        total: Counts the buffers of several connections; None for a count of its own.

    Attributes:
        share: Records that may still be decrypted in this loop turn.
        tls: The state of OpenSSL.
        ended: Whether the peer has sent `close_notify`.
    """

    __slots__ = (
        "_budget",
        "_incoming",
        "_largest_input",
        "_largest_output",
        "_outgoing",
        "_partial",
        "_read",
        "_total",
        "ended",
        "share",
        "tls",
    )

    def __init__(
        self, context: ssl.SSLContext, host: str | None, budget: ReadBudget | None, total: ByteTotal | None
    ) -> None:
        self._total = total or ByteTotal()
        self._largest_input = self._largest_output = 0
        self._budget = budget
        self._incoming = ssl.MemoryBIO()
        self._outgoing = ssl.MemoryBIO()
        self.tls = context.wrap_bio(
            self._incoming, self._outgoing, server_side=host is None, server_hostname=host
        )
        self._read = cast("Callable[[int, memoryview], int]", self.tls.read)  # with a buffer: a number
        self._partial = True
        """Whether what is left of the input is less than a record."""
        self.ended = False
        self.share = SHARE_RECORDS

    @property
    def has_input(self) -> bool:
        """Whether there may be something to decrypt."""
        return not (self._partial or self.ended) and bool(self._incoming.pending or self.tls.pending())

    @property
    def held_bytes(self) -> int:
        """Size of its buffers."""
        return self._largest_input + self._largest_output

    def release(self) -> None:
        """Note that the connection has ended, and with it its buffers."""
        self._total.bytes -= self.held_bytes
        self._largest_input = self._largest_output = 0

    def receive(self, data: memoryview) -> None:
        """Take encrypted bytes."""
        self._incoming.write(data)
        self._partial = False
        size = self._incoming.pending
        if size > self._largest_input:  # OpenSSL never makes a buffer smaller
            self._total.bytes += size - self._largest_input
            self._largest_input = size

    def take(self) -> bytes:
        """Return the encrypted bytes to send."""
        size = self._outgoing.pending
        if size > self._largest_output:
            self._total.bytes += size - self._largest_output
            self._largest_output = size
        return self._outgoing.read() if size else b""

    def handshake(self) -> bool:
        """Continue the handshake; return whether it is over."""
        began = self._clock()
        try:
            self.tls.do_handshake()
        except ssl.SSLWantReadError:
            return False
        finally:
            self._spend(began)
        return True

    def encrypt(self, data: Buffer) -> None:
        """Encrypt bytes."""
        view = memoryview(data)
        while view:
            view = view[self.tls.write(view) :]

    def decrypt(self, buffer: memoryview) -> int:
        """Decrypt what there is, fits into a buffer and is within the share; return the number of bytes."""
        began = self._clock()
        filled = 0
        try:
            while filled < len(buffer) and self.share and self.has_input:
                self.share -= 1
                size = self._read(len(buffer) - filled, buffer[filled:])
                self.ended = not size
                filled += size
        except ssl.SSLWantReadError:
            self._partial = True
        self._spend(began)
        return filled

    def _clock(self) -> float:
        return 0.0 if self._budget is None else self._budget.clock()

    def _spend(self, began: float) -> None:
        budget = self._budget
        if budget is not None:
            budget.spend(budget.clock() - began)

    def finish(self) -> None:
        """Send `close_notify`."""
        with suppress(OSError):  # SSLWantReadError: the peer has not sent its own, and need not
            self.tls.unwrap()

"""A broker's channel: handles received frames within the read budget, and keeps the rest for later."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from proto.aio.channel import Channel
from proto.aio.read_budget import SHARE_FRAMES, SHARE_SEC
from proto.wire.receiver import PARTS

if TYPE_CHECKING:
    import asyncio

    from proto.aio.channel import ChannelHandler
    from proto.aio.read_budget import ReadBudget
    from proto.wire.fragments import ByteTotal, Reassembler
    from proto.wire.session import Role

CONTENDED_READ_BYTES: Final = 64 * 1024
"""Bytes that a connection may read at once while others wait for the budget: the rest of a share must be
kept, which costs a copy and memory."""


class BudgetedChannel(Channel):
    """A channel that shares a read budget with others.

    While received bytes wait for the budget, nothing more is read: the peer's kernel, and at last the peer,
    waits instead of the broker's memory. They are discarded if the connection ends. The handler gets all
    frames, PING and ERROR included, and must answer or close.

    Args:
        role: Which end of the link this is.
        handler: Gets the received frames and the events of the connection.
        loop: The event loop that owns the transport.
        budget: The budget.
        reassembler: Joins the fragments of the peer's large messages.
        received: Counts the buffers of received bytes of all channels of the broker.

    Attributes:
        frames_received: Frames handled so far.
        waiting: Whether received bytes wait for the budget.
    """

    __slots__ = ("_budget", "_share_ended", "_until", "frames_received", "waiting")

    def __init__(
        self,
        role: Role,
        handler: ChannelHandler,
        *,
        loop: asyncio.AbstractEventLoop,
        budget: ReadBudget,
        reassembler: Reassembler | None = None,
        received: ByteTotal | None = None,
    ) -> None:
        super().__init__(role, handler, loop=loop, reassembler=reassembler, received=received)
        self.frames_received = 0
        self.waiting = False
        self._budget = budget
        self._until = 0.0
        """When the current share ends."""
        self._share_ended = False
        """Whether it has ended early."""

    @property
    def kept_bytes(self) -> int:
        """Size of the buffer of received bytes that wait for the budget."""
        return 0 if self._receiver is None else self._receiver.kept_bytes

    @property
    def held_bytes(self) -> int:
        """Size of all buffers of received bytes, those of TLS included; not of incomplete messages."""
        tls: int = self.extra_info("tls_bytes") or 0
        return tls + (0 if self._receiver is None else self._receiver.held_bytes)

    def get_buffer(self, sizehint: int) -> memoryview:  # noqa: ARG002
        """Called by asyncio."""
        assert self._receiver is not None
        buffer = self._receiver.buffer()
        if self._budget.contended:
            buffer = buffer[:CONTENDED_READ_BYTES]
        self._offered = len(buffer)
        return buffer

    def buffer_updated(self, nbytes: int) -> None:
        """Called by asyncio: handle a share of the received frames, unless the budget is exhausted."""
        budget = self._budget
        if budget.exhausted:
            # asyncio has read already; the bytes must leave the scratch buffer, which the next channel uses.
            self._put_off(nbytes)
            return
        began = budget.clock()
        self._until = began + SHARE_SEC
        try:
            Channel.buffer_updated(self, nbytes)
        finally:
            budget.spend(budget.clock() - began)
        if self._in_a_row and budget.contended:  # the loop would read on at once
            self._pause_for_a_turn()

    def _put_off(self, nbytes: int) -> None:
        """Keep what was read for a later loop turn."""
        if self.connected:
            assert self._receiver is not None
            self.bytes_received += nbytes
            self._receiver.received(nbytes)
            if self._receiver.has_unprocessed:
                self._wait()

    def _handle_frames(self, nbytes: int) -> None:
        """Pass the frames of one share to the handler, from what was received just now or (0) is kept."""
        receiver, handle = self._receiver, self._handler.frame_received
        assert receiver is not None
        if nbytes:
            receiver.received(nbytes)
        else:
            self.waiting = False
        self._share_ended = False
        left = SHARE_FRAMES
        try:
            while (
                receiver.has_unprocessed and self.connected and (frame := receiver.next_frame()) is not None
            ):
                left -= 1
                if type(frame) not in PARTS:
                    handle(frame)
                # The clock is read only if there is another frame: a peer that sends one now and then pays
                # nothing.
                if receiver.has_unprocessed:
                    ended = not left or self._share_ended or self._budget.clock() >= self._until
                    if ended and self.connected:
                        self._wait()
                    if ended:
                        return
        finally:
            self.frames_received += SHARE_FRAMES - left

    def end_share(self) -> None:
        """End the share after the frame that is being handled, because it costs much more than others."""
        self._share_ended = True

    def _wait(self) -> None:
        assert self._receiver is not None
        assert self._transport is not None
        self._receiver.keep()  # the scratch buffer is for the next connection
        self.waiting = True
        self._in_a_row = 0
        self._transport.pause_reading()
        self._budget.wait(self)

    def go_on_reading(self) -> None:
        """Called by the budget: handle a share of the kept bytes; read on in the turn after the last."""
        if not self.connected:
            self.waiting = False
            if self._receiver is not None:  # closing; afterwards there is nothing left to discard
                self._receiver.discard()
            return
        try:
            self.buffer_updated(0)
        except BaseException:
            self.abort()  # as the event loop does after an error in buffer_updated
            raise
        if not self.waiting:
            self._pause_for_a_turn()

    def _pause_for_a_turn(self) -> None:
        """Read on in the next loop turn, so that this connection gets only one share in this one."""
        if self.connected:
            assert self._transport is not None
            self._reading_paused = True
            self._transport.pause_reading()
            self._continue_soon()

"""Large messages of one link in shared memory, where the broker is on this host (docs/protocol.md §6.10).

The link's publishers write into one arena, which is made for each session when the first large message is
published: what an earlier broker's readers may still read is never written again. What is received from
other processes is copied out at once; references are released together.
"""

from __future__ import annotations

import asyncio
import sys
from typing import TYPE_CHECKING, Final

from proto import limits
from proto.aio.arena import (
    ARENA_BYTES,
    Arena,
    ArenaError,
    host_identity,
    read_token,
    reader,
)
from proto.aio.session_proof import connection_ends, session_proof
from proto.errors import ErrorCode, ProtocolError
from proto.queues.extents import PAGE_BYTES
from proto.untrusted_text import peer_text
from proto.wire import frames
from proto.wire.codes import Capability
from proto.wire.frames import Batch
from proto.wire.references import AHEAD_BYTES, MIN_REFERENCE_BYTES, References, release_frames

if TYPE_CHECKING:
    from collections.abc import Callable

    from proto.aio.channel import Channel
    from proto.wire.frames import Buffer, Options
    from proto.wire.references import Slot

MIN_BYTES: Final = 16 * 1024
"""Messages from this size on are worth it, also one by one."""

SLOT_BYTES: Final = 1024 * 1024
"""Messages up to this size together are put into one slot, and sent as one batch."""

RELEASE_BYTES: Final = AHEAD_BYTES // 2
"""References to this much are released together, so that the broker seldom has to wait for it."""

RELEASE_AFTER_SEC: Final = 0.05
"""After this time fewer are released, too; not much earlier, since it wakes the broker and the publisher."""

MEMORY_SHARE: Final = 8
"""An arena takes at most this part (an eighth) of the memory of the machine, or of its container."""

NEVER: Final = sys.maxsize


class SharedMemory:
    """The shared memory of one link.

    Args:
        enabled: Whether to use it where the broker does.
        min_bytes: Size from which on messages go there; `MIN_REFERENCE_BYTES` if it is less.
        warn: Logs a warning.

    Attributes:
        min_bytes: The same while the broker takes references, otherwise a size that no message has.
        host: What HELLO says of this host; None for nothing.
        written: Messages written to shared memory.
        full: Messages that found no space there.
        received: Messages received by reference.
        stale: Those of them whose slots had been used again, because the link had ended before.
        problem: Why the broker or this node could not open an arena, or make one; "" if nothing failed.
    """

    def __init__(
        self,
        *,
        enabled: bool = True,
        min_bytes: int = MIN_BYTES,
        warn: Callable[[str], object] = lambda _: None,
    ) -> None:
        self.host = host_identity() if enabled else None
        self.min_bytes = NEVER
        self.written = self.full = self.received = self.stale = 0
        self.problem = ""
        self._wanted = max(min_bytes, MIN_REFERENCE_BYTES)
        self._warn = warn
        self._warned = False
        self._channel: Channel | None = None
        self._references: References | None = None
        self._arena: Arena | None = None
        self._readers: dict[int, Callable[[frames.Reference], Buffer | None]] = {}
        """By the broker's id, what gives the payloads in the arenas that this link reads."""
        self._sent_before = 0
        """Messages sent by reference in earlier sessions."""
        self._number = 0
        """The number of the next REFERENCE frame that is received."""
        self._released: list[int] = []
        self._released_bytes = 0
        """Size of their messages."""
        self._release_due: asyncio.TimerHandle | None = None

    @property
    def active(self) -> bool:
        """Whether the broker of this session takes references."""
        return self._references is not None

    @property
    def sent(self) -> int:
        """Messages that a broker has got by reference."""
        return self._sent_before + (0 if self._references is None else self._references.sent)

    def begin(self, channel: Channel, capabilities: frozenset[str], welcome: Options) -> None:
        """Begin a session with a broker.

        Args:
            channel: The connection.
            capabilities: What the broker can do.
            welcome: The options of its WELCOME.
        """
        self.problem = ""
        if self.host is None or Capability.SHARED_MEMORY not in capabilities:
            return
        process, number = welcome.get("secret_process"), welcome.get("secret_descriptor")
        session = welcome.get("session")
        if not (isinstance(process, int) and isinstance(number, int) and isinstance(session, int)):
            return
        try:
            secret = read_token(process, number)
        except ArenaError as error:
            self._failed(str(error))
            return
        # A broker opens arenas only for clients that could read this secret: those of its own user. The proof
        # names the connection, so that it is worth nothing on another one.
        ends = connection_ends(channel.extra_info, client=True)
        channel.send(frames.Proof(session_proof(secret, session & limits.MAX_U64, ends)))
        self._channel = channel
        self._number = 0
        self.min_bytes = self._wanted
        self._references = channel.outbox.transfers.references = References(self._announce)

    def end(self) -> None:
        """End the session. What is in queues stays valid, and leaves as bytes in the next one."""
        self._stop_writing()
        self._sent_before = self.sent
        self._channel = self._references = None
        self._readers.clear()
        self._release()  # sends nothing, as there is no channel any more

    def _stop_writing(self) -> None:
        self.min_bytes = NEVER
        if self._arena is not None:
            self._arena.close()
            self._arena = None

    def _failed(self, problem: str) -> None:
        """Note why messages go as bytes."""
        self.problem = problem
        self._warn_once(problem)

    def _warn_once(self, problem: str) -> None:
        if not self._warned:
            self._warned = True
            self._warn(f"Some large messages do not pass through shared memory, but as bytes: {problem}")

    # This link publishes

    def put(self, message: Buffer, behind: Slot | None = None) -> Slot | None:
        """Write a message of at least `min_bytes` bytes to shared memory.

        Args:
            message: The encoded message.
            behind: A slot that this has returned before, to be used again if that can hold the message, too.

        Returns:
            The slot in which the message is the last one; None if there is no space.
        """
        arena = self._arena
        if arena is None:
            try:
                arena = self._arena = Arena(_arena_bytes())
            except ArenaError as error:
                self._failed(str(error))
                self._stop_writing()
                return None
        slot = behind
        # Behind the message before it, if the broker has not been told of that yet: one reference for both.
        if (
            slot is None
            or slot.arena is not arena.announcement
            or slot.size + len(message) > SLOT_BYTES
            or not arena.extend(slot, message)
        ):
            slot = arena.put(message)
        if slot is None:
            self.full += 1
            self._warn_once(
                f"its {arena.announcement.size >> 20} MiB have no space, because readers are slow or keep"
                " messages, or the system has no memory left"
            )
        else:
            self.written += 1
        return slot

    def _announce(self, arena: frames.Arena) -> None:
        if self._channel is not None and self._arena is not None and arena is self._arena.announcement:
            self._channel.send(arena)

    def mapped(self, frame: frames.Mapped) -> None:
        """Send references from now on, or nothing but bytes if the broker could not open the arena."""
        if self._references is None:
            return
        if frame.problem:
            self._failed(f"the broker: {peer_text(frame.problem)}")
            self._stop_writing()
        self._references.opened(frame.id, usable=not frame.problem)

    def released(self, frame: frames.Release) -> None:
        """Let go of slots that the broker and its readers do not need any more."""
        if self._references is not None:
            self._references.released(frame.numbers)

    # This link receives

    def arena_announced(self, frame: frames.Arena) -> None:
        """Open another client's arena, and answer."""
        problem = ""
        try:
            self._readers[frame.id] = reader(frame)
        except ArenaError as error:
            problem = str(error)
            self._failed(problem)
        if self._channel is not None:
            self._channel.send(frames.Mapped(frame.id, problem))

    def unmapped(self, frame: frames.Unmap) -> None:
        """Forget another client's arena."""
        self._readers.pop(frame.id, None)

    def receive(self, frame: frames.Reference) -> Batch | None:
        """Return the messages of a reference as a batch, or None if their slot has been used again.

        Raises:
            ProtocolError: This link has not opened its arena, or it is not in there.
        """
        read = self._readers.get(frame.arena)
        if read is None:
            raise ProtocolError(ErrorCode.UNKNOWN_ID, f"REFERENCE to arena {frame.arena}, which is not open")
        # The broker numbers references in the order in which it sends them; only the numbers travel back.
        self._released.append(self._number)
        self._number += 1
        self._released_bytes += frame.size
        self.received += frame.length
        payload = read(frame)
        if payload is None:
            self.stale += frame.length
            return None
        return Batch(*frame[:6], payload, b"")

    def read_finished(self) -> None:
        """Release what has been copied: at once if it is much, otherwise soon."""
        if not self._released:
            return
        if self._released_bytes >= RELEASE_BYTES:
            self._release()
        elif self._release_due is None:
            self._release_due = asyncio.get_running_loop().call_later(RELEASE_AFTER_SEC, self._release)

    def _release(self) -> None:
        if self._release_due is not None:
            self._release_due.cancel()
            self._release_due = None
        if self._channel is not None:
            for release in release_frames(self._released):
                self._channel.send(release)
        self._released.clear()
        self._released_bytes = 0


def _arena_bytes() -> int:
    """Return the size of an arena. A process that fills the memory of its container is killed."""
    from proto.aio.machine_memory import memory_bytes  # noqa: PLC0415 - it needs pathlib, few nodes need it

    return max(PAGE_BYTES, min(ARENA_BYTES, memory_bytes() // MEMORY_SHARE))

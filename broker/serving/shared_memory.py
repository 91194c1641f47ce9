"""Forwards large messages of clients on the broker's host, which stay in their publisher's shared memory.

The broker maps the arena of each such client once. A REFERENCE becomes a batch like any other; only that its
message is a slot of the arena. Each link that can read the arena gets a reference, too, and all others get
bytes. A slot that no queue and no reader holds any more is released to its publisher, once in a loop turn.
"""

from __future__ import annotations

import hmac
from functools import partial
from itertools import count
from typing import TYPE_CHECKING, Final

from proto.aio.arena import ARENA_BYTES, Arena, ArenaError, host_identity, open_arena, owner_process
from proto.aio.session_proof import connection_ends, session_proof
from proto.errors import ErrorCode, ProtocolError
from proto.queues.extents import PAGE_BYTES
from proto.untrusted_text import peer_text
from proto.wire import frames
from proto.wire.references import (
    AHEAD_BYTES,
    References,
    SharedBatch,
    Slot,
    check_inside,
    release_frames,
    shared_batch,
)

MAX_ARENAS: Final = 256
"""Arenas that the broker maps; it needs a descriptor for each. Those of links that have ended count while
a message in them is held."""

MAX_TOTAL_BYTES: Final = MAX_ARENAS * ARENA_BYTES
"""Total size of the mapped arenas. It is limited because one held message keeps all memory of its arena, and
because to read where nothing was written makes the kernel provide memory, too: what an arena takes at the
moment says nothing."""

if TYPE_CHECKING:
    import asyncio
    from collections.abc import Callable, Iterable

    from proto.aio.channel import Channel


class OpenArena:
    """The arena of one client, mapped by the broker.

    Args:
        arena: As the client announced it, with an id of the broker's.
        memory: All of it.
        owner: The process that has it.

    Attributes:
        arena, memory, owner: As given.
        ended: Whether its link has ended, so that nobody can open it any more.
        slots: How many slots are held.
        readers: The links that have been told of it, because a message for them was in it.
    """

    def __init__(self, arena: frames.Arena, memory: memoryview, owner: int) -> None:
        self.arena = arena
        self.memory = memory
        self.owner = owner
        self.ended = False
        self.slots = 0
        self.readers: dict[LinkMemory, None] = {}


class SharedMemory:
    """Shared memory of all links of a broker: their arenas, and the secret that clients must read.

    Args:
        enabled: Whether messages may travel by reference.
        descriptors: How many descriptors arenas may take; `MAX_ARENAS` at most.
        max_bytes: Total size that arenas may have; `MAX_TOTAL_BYTES` at most.

    Attributes:
        arenas: The arenas of all clients, by the broker's ids.
        received: Messages received by reference.
        sent: Messages sent by reference, to links that have ended.
        copied: Messages received by reference and sent as bytes, to links that have ended.
        refused: Arenas that the broker or a client could not open.
    """

    def __init__(self, *, enabled: bool, descriptors: int, max_bytes: int = MAX_TOTAL_BYTES) -> None:
        self.identity = host_identity() if enabled else None
        self.arenas: dict[int, OpenArena] = {}
        self.received = self.sent = self.copied = self.refused = 0
        self._numbers = count(1)
        self._max_arenas = min(MAX_ARENAS, descriptors)
        self._max_bytes = max_bytes
        self._secret: Arena | None = None
        """An arena of the broker whose token clients must have read. Only processes of the broker's user can,
        so a client that knows it is on this host and may share memory. Made for the first client that needs
        it."""

    def offer(self, host: object) -> dict[str, frames.Scalar]:
        """Return the options of WELCOME for a client with this host identity; none for other hosts."""
        if self.identity is None or host != self.identity:
            return {}
        if self._secret is None:
            try:
                self._secret = Arena(2 * PAGE_BYTES)
            except ArenaError:
                self.refused += 1
                return {}
        secret = self._secret.announcement
        return {"secret_process": secret.process, "secret_descriptor": secret.descriptor}

    def proves(self, proof: bytes, session: int, ends: bytes) -> bool:
        """Return whether the client of a session, on a connection with these ends, can read the secret."""
        token = b"" if self._secret is None else self._secret.announcement.token
        return bool(token) and hmac.compare_digest(proof, session_proof(token, session, ends))

    def close(self) -> None:
        """Close the secret, so that no client can read it any more."""
        if self._secret is not None:
            self._secret.close()
            self._secret = None

    def open(self, arena: frames.Arena) -> OpenArena:
        """Map a client's arena, and give it an id of the broker's.

        Raises:
            ArenaError: It cannot be opened, another link has it, or there are too many: in all, or of its
                process, which may have as much as it leaves to others.
        """
        known = self.arenas.values()
        # An arena belongs to one link: it ends with that link, and its size counts once.
        if any(other.arena.token == arena.token for other in known):
            raise ArenaError("another link has this arena")
        free = self._max_arenas - len(known)
        free_bytes = min(self._max_bytes, MAX_TOTAL_BYTES) - sum(other.arena.size for other in known)
        owner = owner_process(arena)
        sizes = [other.arena.size for other in known if other.owner == owner]
        if not free or arena.size > free_bytes or len(sizes) > free or sum(sizes) > free_bytes:
            raise ArenaError(
                f"too many arenas: the broker has mapped {len(known)}, {len(sizes)} of this process"
            )
        opened = OpenArena(arena._replace(id=next(self._numbers)), open_arena(arena), owner)
        self.arenas[opened.arena.id] = opened
        return opened

    def counts(self, links: Iterable[LinkMemory | None]) -> dict[str, int]:
        """Return the numbers for the statistics, with those of these links, which have not ended."""
        references = [link.references for link in links if link is not None]
        return {
            "shared_received": self.received,
            "shared_sent": self.sent + sum(each.sent for each in references),
            "shared_copied": self.copied + sum(each.copied for each in references),
            "refused_arenas": self.refused,
        }

    def forget(self, opened: OpenArena) -> None:
        """Remove an arena that nothing refers to any more, and let its readers do the same."""
        del self.arenas[opened.arena.id]
        for reader in opened.readers:
            reader.close_arena(opened.arena.id)


class LinkMemory:
    """Shared memory on the link of one client that has the broker's host identity.

    Anybody can claim that identity, and the broker would open any arena of its user for them. So it opens and
    announces none before the client has proved that it can open them itself.

    Args:
        channel: Its connection.
        session: The number of its session.
        shared: What all links share.
        loop: The broker's event loop.
        sent: Called when frames have been sent that nobody has counted; limits what waits.
        warn: Logs what goes wrong, within limits.

    Attributes:
        references: What the client gets by reference.
        received_bytes: Size of the messages that it has sent by reference.
    """

    def __init__(
        self,
        channel: Channel,
        session: int,
        shared: SharedMemory,
        loop: asyncio.AbstractEventLoop,
        *,
        sent: Callable[[], None],
        warn: Callable[[str], None],
    ) -> None:
        self._channel = channel
        self._session = session
        self._proved = False
        self._shared = shared
        self._loop = loop
        self._sent = sent
        self._warn = warn
        self._own: OpenArena | None = None
        """The client's arena."""
        self._own_id: int | None = None
        """The client's id of it, also if it could not be opened; None before ARENA."""
        self._count = 0
        """REFERENCE frames received."""
        self._released: list[int] = []
        """Those that nothing holds any more."""
        self.references = References(self._announce, AHEAD_BYTES)
        self.received_bytes = 0

    def prove(self, frame: frames.Proof) -> None:
        """Share memory with the client from now on, if its proof is right."""
        ends = connection_ends(self._channel.extra_info, client=False)
        if self._shared.proves(frame.proof, self._session, ends):
            self._proved = True
            self._channel.outbox.transfers.references = self.references
        else:
            self._failed("it cannot read the broker's secret, or connects through a proxy")

    # The client publishes

    def open(self, frame: frames.Arena) -> None:
        """Map the client's arena, and answer.

        Raises:
            ProtocolError: It has announced one already.
        """
        if self._own_id is not None:
            raise ProtocolError(ErrorCode.UNEXPECTED, "ARENA: this link has one already")
        self._own_id = frame.id
        problem = ""
        try:
            if not self._proved:
                raise ArenaError("this link has not proved that it may share memory")
            self._own = self._shared.open(frame)
        except ArenaError as error:
            problem = str(error)
            self._failed(problem)
        self._channel.send(frames.Mapped(frame.id, problem))

    def batch(self, frame: frames.Reference) -> SharedBatch:
        """Return the batch that the client has sent by reference.

        Raises:
            ProtocolError: It is not in the client's arena.
        """
        own = self._own
        if own is None or frame.arena != self._own_id:
            raise ProtocolError(ErrorCode.UNKNOWN_ID, f"this link has no arena with the id {frame.arena}")
        check_inside(frame, len(own.memory))
        number, self._count = self._count, self._count + 1
        self._shared.received += frame.length
        self.received_bytes += frame.size
        own.slots += 1
        release = partial(self._release, own, number)
        slot = Slot(own.arena, own.memory, frame.offset, frame.generation, release)
        return shared_batch(slot, frame[:6], frame.start, frame.size)

    def _release(self, arena: OpenArena, number: int, _: Slot) -> None:
        arena.slots -= 1
        if not arena.ended:
            if not self._released:
                self._loop.call_soon(self._send_released)
            self._released.append(number)
        elif not arena.slots:
            self._shared.forget(arena)

    def _send_released(self) -> None:
        released, self._released = self._released, []
        if self._channel.connected:
            for release in release_frames(released):
                self._channel.send(release)
            self._sent()

    # The client reads

    def _announce(self, arena: frames.Arena) -> None:
        """Let the client open an arena in which there is a message for it."""
        opened = self._shared.arenas[arena.id]
        opened.readers[self] = None
        if not opened.ended:  # otherwise nobody can open it any more
            self._channel.send(arena)

    def opened(self, frame: frames.Mapped) -> None:
        """Send references to an arena from now on, if the client could open it."""
        known = self.references.opened(frame.id, usable=not frame.problem)
        if known and frame.problem:
            self._failed(peer_text(frame.problem))

    def released(self, frame: frames.Release) -> None:
        """Let go of slots that the client has read, and let its outbox serve the queues that wait for that.

        Raises:
            ProtocolError: The client has not got these references, or has released them.
        """
        self.references.released(frame.numbers)
        outbox = self._channel.outbox
        if not self.references.full:
            blocked, outbox.blocked = outbox.blocked, {}
            for queue in blocked:
                queue.blocked = False
                outbox.schedule(queue)

    def _failed(self, problem: str) -> None:
        self._shared.refused += 1
        self._warn(problem)

    def close_arena(self, arena: int) -> None:
        """Let the client forget an arena."""
        if self.references.closed(arena) and self._channel.connected:
            self._channel.send(frames.Unmap(arena))

    def end(self) -> None:
        """End the use of shared memory: others can no longer open its arena, and it reads no others."""
        shared, references, own = self._shared, self.references, self._own
        shared.sent += references.sent
        shared.copied += references.copied
        for arena in references.arenas:
            if (known := shared.arenas.get(arena)) is not None:
                known.readers.pop(self, None)
        self.references = References(lambda _: None)  # not in a cycle with this object
        self._own = None
        if own is not None:
            own.ended = True
            if not own.slots:
                shared.forget(own)

"""Counts the memory that a broker holds for all its links, and frees some when it is too much.

It counts what waits for links, latched messages, incomplete messages, and buffers: of received bytes that
wait to be handled, of incomplete large frames, and of TLS. A message that waits for many links counts for
each of them, so nothing is refused before the process really uses too much memory, too.
The order, for a limit of `max_bytes`:

    above 7/8   parts of new large messages are discarded, and large calls are refused as OVERLOADED
    above it    the links with most waiting messages lose the oldest half of them, from KEEP_LAST queues;
                if that is not enough, the link that holds most is closed
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Protocol

from proto.errors import ErrorCode

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable

    from broker.serving.link import Link
    from broker.serving.mesh_access import MeshOutbox
    from proto.queues.outbox import Outbox
    from proto.wire.fragments import ByteTotal, ReassemblyTotal

MUCH_BYTES: Final = 16 * 1024 * 1024
"""When a link that held at least this much ends, freed memory is returned to the system."""


class Holder(Protocol):
    """Holds frames that have not been sent: a link, or a mesh."""

    held_bytes: int
    """The bytes at the last `count`."""

    @property
    def outbox(self) -> Outbox:
        """The frames that wait."""
        ...


class MemoryGuard:
    """Counts the memory of one run of a broker.

    Args:
        max_bytes: The limit.
        resident: Returns the memory that the process uses, or None if that is unknown.
        reassembly: The bytes of incomplete messages.
        latched: The bytes of latched messages.
        received: The bytes of buffers for received bytes and for TLS.

    Attributes:
        freed: Whether links that held at least `MUCH_BYTES` have ended, or long work for brokers of a mesh;
            the periodic check resets it.
        queued_bytes: Bytes that wait for links.
        full: Whether large messages and calls are refused; set by `relieve`.
        closed: Links closed because they held most.
    """

    def __init__(
        self,
        max_bytes: int,
        resident: Callable[[], int | None],
        reassembly: ReassemblyTotal,
        latched: ByteTotal,
        received: ByteTotal,
    ) -> None:
        self.max_bytes = max_bytes
        self.queued_bytes = 0
        self.full = self.freed = False
        self.closed = 0
        self._enough = max_bytes - max_bytes // 8
        self._check_above = self._enough
        self._resident = resident
        self._reassembly = reassembly
        self._latched = latched
        self._received = received
        self._closing: Link | None = None

    @property
    def held_bytes(self) -> int:
        """Bytes held in all."""
        return self.queued_bytes + self._reassembly.bytes + self._latched.bytes + self._received.bytes

    @property
    def needs_relief(self) -> bool:
        """Whether to call `relieve`."""
        # Not `held_bytes`: this is asked after every read.
        held = self.queued_bytes + self._reassembly.bytes + self._latched.bytes + self._received.bytes
        return held > self._check_above or self.full

    def count(self, holder: Holder) -> None:
        """Count again the bytes that wait for a link, or for a mesh."""
        outbox = holder.outbox
        held = outbox.held_bytes + outbox.urgent_bytes + outbox.ordered_bytes
        self.queued_bytes += held - holder.held_bytes
        holder.held_bytes = held

    def end(self, link: Link) -> None:
        """Note that a link ends, before it leaves its graph."""
        self.count(link)
        if _memory(link) >= MUCH_BYTES:
            self.freed = True

    def relieve(self, links: Iterable[Link], meshes: Collection[MeshOutbox] = ()) -> None:
        """Free memory in the stated order, if the process really uses too much.

        Args:
            links: All links.
            meshes: The graphs' meshes, which count like links. A mesh cannot be closed: at worst, everything
                that waits for it is dropped.
        """
        held = self.held_bytes
        # Reading /proc costs microseconds, so it is asked only if the count is over the limit.
        resident = self._resident() if held > self._enough else 0
        self.full = held > self._enough and (resident is None or resident > self._enough)
        self._reassembly.refusing = self.full
        if not self.full:
            self._closing = None
        # If messages are only counted several times, look again when there are considerably more.
        self._check_above = self._enough if self.full else max(self._enough, held + self.max_bytes // 16)
        if self.full and held > self.max_bytes:
            self._drop([*links, *meshes])
            if self.held_bytes > self.max_bytes:
                self._close(links, meshes)

    def _drop(self, holders: Iterable[Holder]) -> None:
        for holder in sorted(holders, key=lambda holder: holder.outbox.held_bytes, reverse=True):
            if self.held_bytes <= self._enough:
                break
            # Half, so that a burst does not empty one link while others keep everything.
            holder.outbox.drop_from_fullest(holder.outbox.held_bytes // 2)
            self.count(holder)

    def _close(self, links: Iterable[Link], meshes: Collection[MeshOutbox]) -> None:
        if self._closing is not None and self._closing.router is not None:
            return  # what it holds is about to be freed
        most = max((link for link in links if link.channel.connected), key=_memory, default=None)
        mesh = max(meshes, key=lambda mesh: mesh.held_bytes, default=None)
        if mesh is not None and (most is None or mesh.held_bytes > _memory(most)):
            mesh.drop_all(f"the broker holds {self.held_bytes} bytes (--max-broker-bytes)")
            self.count(mesh)
            return
        if most is None:
            return
        self._closing = most
        self.closed += 1
        over = f"the broker holds {self.held_bytes} bytes, over its limit of {self.max_bytes}"
        text = f"{over} (--max-broker-bytes), and this link holds most: {_memory(most)}"
        most.fail(ErrorCode.LIMIT, text)
        most.channel.reassembler.clear()


def _memory(link: Link) -> int:
    """Return the bytes held for a link: frames that wait for it, and frames that it has sent."""
    peer = None if link.router is None else link.router.peer(link.peer)
    received = link.channel.reassembler.held_bytes + link.channel.held_bytes
    return link.held_bytes + received + (0 if peer is None else peer.latched_bytes)

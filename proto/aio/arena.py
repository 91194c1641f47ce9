"""Shared memory on one host: arenas, which their owner writes and others of the same user read.

An arena is a memfd. It has no name in a file system and ends with the last process that has it. Others open
it as `/proc/<process>/fd/<number>`, which the kernel allows to the same user only. Seals keep its size, so
that a mapping never fails later, and (Linux 5.1) keep everybody else from writing. The random token at its
start proves that the descriptor still belongs to it, and not to a later file.
"""

from __future__ import annotations

import errno
import hashlib
import mmap
import os
import secrets
import sys
import weakref
from functools import cache, partial
from itertools import count
from typing import TYPE_CHECKING, Any, Final

from proto import limits
from proto.aio.forks import drop_in_children
from proto.errors import CallboardError
from proto.queues.extents import PAGE_BYTES, Extents, rounded
from proto.wire import frames
from proto.wire.codec import ARRAY_HEAD_BYTES, array_head
from proto.wire.references import SLOT_HEAD_BYTES, Slot, begin_slot, copy_payload

if sys.platform == "linux":
    import fcntl

if TYPE_CHECKING:
    from collections.abc import Callable

    from proto.wire.frames import Buffer

ARENA_BYTES: Final = 64 * 1024 * 1024
"""Size of an arena. It takes memory only where messages have been."""

MAX_ARENA_BYTES: Final = 2 * ARENA_BYTES
"""The largest arena of others that is mapped: one held message keeps all of its memory."""

BACKED_BYTES: Final = 1024 * 1024
"""How much memory is reserved at a time. Without a reservation, a write on a system without free memory would
kill the process (SIGBUS)."""

NAME: Final = "callboard"
_LINK: Final = f"/memfd:{NAME}"
"""The target of an arena's link in /proc."""

_KEPT_SIZE: Final = 0x0002 | 0x0004
"""F_SEAL_SHRINK and F_SEAL_GROW."""
_FINAL: Final = 0x0001
"""F_SEAL_SEAL."""
_READ_ONLY: Final = 0x0010
"""F_SEAL_FUTURE_WRITE, which Python does not name before 3.13."""

_NEVER_EXECUTED: Final = 0x0008
"""MFD_NOEXEC_SEAL, without which some systems create no memory file."""

SUPPORTED: Final = sys.platform == "linux" and hasattr(os, "memfd_create") and hasattr(fcntl, "F_ADD_SEALS")
"""Whether this platform has sealed memory files."""

_numbers: Final = count(1)
_own: Final[weakref.WeakValueDictionary[bytes, Arena]] = weakref.WeakValueDictionary()
"""The arenas of this process by token: other nodes in it need not open them."""


class ArenaError(CallboardError):
    """Shared memory cannot be made or opened; messages travel as bytes."""


@cache
def host_identity() -> bytes | None:
    """Return 16 bytes that are equal for processes that may open each other's arenas, or None.

    They are a hash of the host's boot, the namespaces of processes and users, and the user.
    """
    if not SUPPORTED:
        return None
    try:
        with open("/proc/sys/kernel/random/boot_id", "rb") as file:  # noqa: PTH123 - read once, at the start
            parts = [file.read(64)]
        parts += [os.readlink(f"/proc/self/ns/{name}").encode() for name in ("pid", "user")]  # noqa: PTH115
    except OSError:
        return None
    parts.append(str(os.geteuid()).encode())
    return hashlib.blake2b(b" ".join(parts), digest_size=limits.INSTANCE_BYTES).digest()


class Arena:
    """An arena of this process, with slots for messages.

    Args:
        size: Its size in bytes.

    Raises:
        ArenaError: The system does not provide it.

    Attributes:
        announcement: What others need to open it; its id is unique in this process.
        memory: All of it, for readers.
    """

    def __init__(self, size: int) -> None:
        self._descriptor = -1
        if not SUPPORTED:
            raise ArenaError("this platform has no sealed memory files")
        size = rounded(size)
        try:
            self._descriptor = descriptor = _create()
            os.fchmod(descriptor, 0o400)
            os.ftruncate(descriptor, size)
            mapping = mmap.mmap(descriptor, size)
            _seal(descriptor)
            os.posix_fallocate(descriptor, 0, PAGE_BYTES)
        except OSError as error:
            self.close()
            raise ArenaError(f"no shared memory: {error.strerror}") from error
        token = secrets.token_bytes(limits.INSTANCE_BYTES)
        self._writable = memoryview(mapping)
        self.memory = self._writable.toreadonly()
        self._backed = PAGE_BYTES
        self._writable[: len(token)] = token
        self._extents = Extents(PAGE_BYTES, size)
        self._released: list[tuple[int, int]] = []
        """Slots that nothing holds any more. Freed at the next `put`, because the last holder may be
        collected in the middle of an allocation."""
        self._release = partial(_add_extent, self._released)
        self._slots: dict[int, weakref.ref[Slot]] = {}
        """The last slot at each offset, for readers in this process."""
        self._kept: set[Slot] = set()
        """Slots that forked children may still read in place: they are not used again."""
        self._generation = secrets.randbits(63)
        """The generation of the newest slot. It starts at a random number, so that bytes of an older message
        are not mistaken for it."""
        self._process = os.getpid()
        self.announcement = frames.Arena(next(_numbers), self._process, descriptor, size, token)
        _own[token] = self
        drop_in_children(self)

    @property
    def inherited(self) -> bool:
        """Whether this process is a forked child: it has the same memory, but does not hold its slots."""
        return os.getpid() != self._process

    def put(self, message: Buffer) -> Slot | None:
        """Write a message into a free slot; return None if there is no space for it."""
        if self.inherited:
            return None
        message = memoryview(message).cast("B")
        size = SLOT_HEAD_BYTES + len(message)
        self._free_released()
        offset = self._extents.allocate(size)
        if offset is None:
            return None
        if offset + size > self._backed and not self._back(offset + size):
            self._extents.free(offset, size)
            return None
        self._generation += 1
        begin_slot(self._writable[offset:], self._generation)
        slot = Slot(self.announcement, self.memory, offset, self._generation, self._release)
        self._slots[offset] = weakref.ref(slot)
        self._append(slot, message)
        return slot

    def extend(self, slot: Slot, message: Buffer) -> bool:
        """Add a message to those in a slot that nothing refers to yet; return whether it fits behind them."""
        if self.inherited:
            return False
        message = memoryview(message).cast("B")
        self._free_released()
        end = SLOT_HEAD_BYTES + slot.size
        if not self._extents.extend(slot.offset, end, end + len(message)):
            return False
        start, stop = slot.offset + end, slot.offset + end + len(message)
        if stop > self._backed and not self._back(stop):
            self._extents.free(rounded(start), rounded(stop) - rounded(start))
            return False
        self._append(slot, message)
        return True

    def _append(self, slot: Slot, message: Buffer) -> None:
        """Write a message behind those in a slot, and how many there are in front of them."""
        first = slot.offset + SLOT_HEAD_BYTES
        start = first + slot.size
        self._writable[start : start + len(message)] = message
        slot.size += len(message)
        slot.length += 1
        self._writable[first - ARRAY_HEAD_BYTES : first] = array_head(slot.length)

    def read(self, reference: frames.Reference) -> Buffer | None:
        """Return the payload of a batch in this arena to a reader in this process.

        It is no copy if the batch is all of a slot: the slot is held as long as the payload or a part of it.

        Args:
            reference: The REFERENCE that the reader has received.

        Returns:
            None if the slot is used for other messages by now.

        Raises:
            ProtocolError: It is not within the arena.
        """
        known = self._slots.get(reference.offset)
        slot, holder_type = None if known is None else known(), _holder_type(len(self.memory))
        wanted = reference.generation, reference.start, reference.length, reference.size
        if (
            slot is None
            or holder_type is None
            or wanted != (slot.generation, SLOT_HEAD_BYTES, slot.length, slot.size)
        ):
            return copy_payload(self.memory, reference)
        holder = holder_type.from_buffer(self._writable)
        holder.slot = slot
        slot.in_place = True
        first = slot.offset + SLOT_HEAD_BYTES
        return memoryview(holder).cast("B")[first - ARRAY_HEAD_BYTES : first + slot.size].toreadonly()

    def keep_for_child(self) -> None:
        """Keep the slots that are read in place, before a fork: the child may read them at any later time."""
        slots = (known() for known in tuple(self._slots.values()))
        self._kept.update(slot for slot in slots if slot is not None and slot.in_place)

    def _free_released(self) -> None:
        while self._released:
            self._extents.free(*self._released.pop())

    @property
    def used_bytes(self) -> int:
        """How much of it slots take."""
        self._free_released()
        return len(self.memory) - PAGE_BYTES - self._extents.free_bytes

    def _back(self, end: int) -> bool:
        """Ask the system for memory up to `end`; return whether it provides it."""
        start = self._backed
        length = min(-(-(end - start) // BACKED_BYTES) * BACKED_BYTES, len(self.memory) - start)
        try:
            os.posix_fallocate(self._descriptor, start, length)
        except OSError:
            return False
        self._backed = start + length
        return True

    def descriptors(self) -> tuple[int, ...]:
        """DescriptorOwner: the memory file."""
        return () if self._descriptor < 0 else (self._descriptor,)

    def close(self) -> None:
        """Close the memory file, so that no process can open it any more; slots stay valid."""
        descriptor, self._descriptor = self._descriptor, -1
        if descriptor >= 0:
            os.close(descriptor)

    def __del__(self) -> None:
        """Close it."""
        self.close()


def _own_arenas() -> list[Arena]:
    """Return the arenas of this process; other threads may make some meanwhile."""
    return [own for known in _own.valuerefs() if (own := known()) is not None]


def _before_fork() -> None:
    for own in _own_arenas():
        own.keep_for_child()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(before=_before_fork)


def _add_extent(released: list[tuple[int, int]], slot: Slot) -> None:
    released.append((slot.offset, SLOT_HEAD_BYTES + slot.size))


@cache
def _holder_type(size: int) -> Any:
    """Return the type of objects whose views keep them alive, of this size; None if Python lacks ctypes."""
    try:
        from ctypes import c_ubyte  # noqa: PLC0415 - optional, and few programs need it
    except ImportError:  # pragma: no cover
        return None
    return c_ubyte * size


def _create() -> int:
    flags = os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING
    try:
        return os.memfd_create(NAME, flags | _NEVER_EXECUTED)
    except OSError as error:
        if error.errno != errno.EINVAL:  # before Linux 6.3
            raise
        return os.memfd_create(NAME, flags)


def _seal(descriptor: int) -> None:
    add: Callable[[int], object] = partial(fcntl.fcntl, descriptor, fcntl.F_ADD_SEALS)
    try:
        add(_KEPT_SIZE | _READ_ONLY | _FINAL)
    except OSError:  # before Linux 5.1
        add(_KEPT_SIZE | _FINAL)


def read_token(process: int, number: int) -> bytes:
    """Return the token of the arena that is a process's descriptor with this number.

    Raises:
        ArenaError: It cannot be read, for example because it is another user's.
    """
    for own in _own_arenas():
        if (own.announcement.process, own.announcement.descriptor) == (process, number) and own.descriptors():
            return own.announcement.token
    path = f"/proc/{process}/fd/{number}"
    try:
        descriptor = _open(path)
        try:
            token = os.pread(descriptor, limits.INSTANCE_BYTES, 0)
        finally:
            os.close(descriptor)
    except OSError as error:
        raise ArenaError(f"cannot open {path}: {error.strerror}") from error
    if len(token) != limits.INSTANCE_BYTES:
        raise ArenaError(f"{path} is not an arena")
    return token


def _open(path: str) -> int:
    """Return a descriptor of the memory file at this path in /proc, to read."""
    if not os.readlink(path).startswith(_LINK):  # noqa: PTH115 - nodes start without pathlib
        raise ArenaError(f"{path} is not an arena")
    return os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)


def owner_process(arena: frames.Arena) -> int:
    """Return the number of the process that has an arena; the announcement may name one of its threads.

    Raises:
        ArenaError: There is no such process.
    """
    try:
        with open(f"/proc/{arena.process}/status", "rb") as file:  # noqa: PTH123 - nodes start without pathlib
            content = file.read()
    except OSError as error:
        raise ArenaError(f"cannot open /proc/{arena.process}: {error.strerror}") from error
    return int(content.partition(b"\nTgid:")[2].split(maxsplit=1)[0])


def open_arena(arena: frames.Arena) -> memoryview:
    """Return the memory of another process's arena, or of this one's, to read.

    Args:
        arena: As announced.

    Raises:
        ArenaError: It cannot be opened, or is not what was announced.
    """
    own = _own.get(arena.token)
    if own is not None:
        return own.memory
    if not SUPPORTED or not PAGE_BYTES <= arena.size <= MAX_ARENA_BYTES:
        raise ArenaError(f"an arena of {arena.size} bytes is not supported")
    path = f"/proc/{arena.process}/fd/{arena.descriptor}"
    try:
        descriptor = _open(path)
        try:
            status = os.fstat(descriptor)
            seals = fcntl.fcntl(descriptor, fcntl.F_GET_SEALS)
            if seals & _KEPT_SIZE != _KEPT_SIZE or (status.st_size, status.st_uid) != (
                arena.size,
                os.geteuid(),
            ):
                raise ArenaError(f"{path} is not as announced")
            if os.fstatvfs(descriptor).f_bsize != mmap.PAGESIZE:
                # Where such a page is missing and none is free, reading it ends the process.
                raise ArenaError(f"{path} has huge pages")
            memory = memoryview(mmap.mmap(descriptor, arena.size, access=mmap.ACCESS_READ))
        finally:
            os.close(descriptor)
    except (OSError, ValueError) as error:
        raise ArenaError(f"cannot open {path}: {getattr(error, 'strerror', None) or error}") from error
    if bytes(memory[: len(arena.token)]) != arena.token:
        raise ArenaError(f"{path} is another arena")
    return memory


def reader(arena: frames.Arena) -> Callable[[frames.Reference], Buffer | None]:
    """Return a function that reads the payload of a batch in an arena; it copies those of other processes.

    Args:
        arena: As announced.

    Raises:
        ArenaError: It cannot be opened, or is not what was announced.
    """
    own = _own.get(arena.token)
    # A forked child has the parent's arena in `_own`, but does not hold its slots: it must copy, too.
    return partial(copy_payload, open_arena(arena)) if own is None or own.inherited else own.read

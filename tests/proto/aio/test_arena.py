"""Arenas: what one process writes, another one of the same user reads, and nothing else can be opened."""

from __future__ import annotations

import ctypes
import errno
import fcntl
import gc
import itertools
import mmap
import os
import pickle
import stat
import subprocess
import sys
from array import array
from pathlib import Path

import pytest

from proto.aio import arena as arenas
from proto.aio.arena import Arena, ArenaError, host_identity, open_arena, read_token, reader
from proto.queues.extents import PAGE_BYTES
from proto.wire import frames
from proto.wire.codec import array_head
from proto.wire.ends import ends_to_bytes
from proto.wire.references import SLOT_HEAD_BYTES, Slot, copy_payload

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="arenas are memfds")

F_SEAL_FUTURE_WRITE = 0x0010
"""linux/fcntl.h; `fcntl` does not name it."""
SIZE = 16 * PAGE_BYTES
MESSAGE = bytes(range(256)) * 20

OPEN = """
import pickle, sys
from proto.aio.arena import ArenaError, host_identity, open_arena
from proto.wire.references import copy_payload
identity, reference, announcements = pickle.load(sys.stdin.buffer)
assert identity == host_identity()
for announcement in announcements:
    try:
        print(copy_payload(open_arena(announcement), reference).hex())
    except ArenaError as error:
        print(error)
"""


@pytest.fixture
def arena() -> Arena:
    """Return a small arena."""
    return Arena(SIZE)


def reference_to(arena: Arena, message: bytes) -> frames.Reference:
    """Put a message into an arena and return a reference to it, whose slot is released."""
    slot = arena.put(message)
    assert slot is not None
    assert content(slot) == message
    return reference(slot)


def reference(slot: Slot, ends: bytes | None = None) -> frames.Reference:
    """Return a reference to all of a slot."""
    head = 1, 0, 0, slot.length, ends, None
    return frames.Reference(*head, slot.arena.id, slot.offset, SLOT_HEAD_BYTES, slot.size, slot.generation)


def content(slot: Slot) -> bytes:
    """Return the messages in a slot."""
    start = slot.offset + SLOT_HEAD_BYTES
    return bytes(slot.memory[start : start + slot.size])


def elsewhere(reference: frames.Reference, *announcements: frames.Arena) -> list[str]:
    """Open arenas in another process; return the payload, or the error, for each."""
    given = pickle.dumps((host_identity(), reference, announcements))
    done = subprocess.run([sys.executable, "-c", OPEN], input=given, capture_output=True, check=True)
    return done.stdout.decode().splitlines()


@pytest.mark.processes
def test_another_process_reads_what_was_announced_and_nothing_else(arena: Arena) -> None:
    """The right announcement opens the arena; a wrong size, token or number opens nothing."""
    before, right = reference_to(arena, MESSAGE), arena.announcement
    null = os.open(os.devnull, os.O_RDONLY)
    payload, *errors = elsewhere(
        before,
        right,
        right._replace(size=SIZE - PAGE_BYTES),
        right._replace(token=bytes(16)),
        right._replace(descriptor=null),
        right._replace(descriptor=1_000_000),
        right._replace(process=4_000_000),
        right._replace(size=2**40),
    )
    os.close(null)
    assert bytes.fromhex(payload) == b"\xdd\0\0\0\1" + MESSAGE
    wanted = ("not as announced", "another arena", "not an arena", "No such", "No such", "not supported")
    assert len(errors) == len(wanted)
    assert all(text in error for text, error in zip(wanted, errors, strict=True))


def test_an_unsealed_file_is_not_an_arena() -> None:
    """A file that its owner could cut would end the process that reads it."""
    descriptor = os.memfd_create("callboard", os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
    os.ftruncate(descriptor, SIZE)
    try:
        with pytest.raises(ArenaError, match="not as announced"):
            open_arena(frames.Arena(1, os.getpid(), descriptor, SIZE, bytes(16)))
    finally:
        os.close(descriptor)


def test_huge_pages_of_a_pool_are_refused() -> None:
    """A process that reads one that is missing ends if the pool is empty, whatever the seals."""
    token, size = bytes(16), 2**21
    try:
        descriptor = os.memfd_create("callboard", os.MFD_HUGETLB | os.MFD_ALLOW_SEALING)
    except OSError:
        pytest.skip("this kernel has no huge pages")
    try:
        os.ftruncate(descriptor, size)
        fcntl.fcntl(descriptor, fcntl.F_ADD_SEALS, fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_GROW)
        with pytest.raises(ArenaError, match="huge pages"):
            open_arena(frames.Arena(1, os.getpid(), descriptor, size, token))
    finally:
        os.close(descriptor)


@pytest.mark.parametrize("size", [0, PAGE_BYTES - 1])
def test_less_than_a_page_is_not_an_arena(size: int) -> None:
    """Nothing is opened for it."""
    with pytest.raises(ArenaError, match=f"an arena of {size} bytes is not supported"):
        open_arena(frames.Arena(1, os.getpid(), 0, size, bytes(16)))


@pytest.mark.skipif(sys.platform != "linux" or os.geteuid() != 0, reason="needs root")
@pytest.mark.processes
def test_a_file_of_another_user_is_not_an_arena(arena: Arena) -> None:
    """Root could open it; its content would be another user's."""
    (descriptor,) = arena.descriptors()
    process, announcement = os.getpid(), arena.announcement
    os.fchown(descriptor, 54321, 54321)
    (error,) = elsewhere(reference_to(arena, MESSAGE), announcement)
    assert error == f"/proc/{process}/fd/{descriptor} is not as announced"


@pytest.mark.processes
def test_processes_of_one_host_know_each_other() -> None:
    """By a hash of 16 bytes, which says nothing about the host."""
    identity = host_identity()
    assert identity is not None
    assert len(identity) == 16
    program = "from proto.aio.arena import host_identity; print(host_identity().hex())"
    found = subprocess.run([sys.executable, "-c", program], capture_output=True, check=True, timeout=60)
    assert found.stdout.decode().strip() == identity.hex()


def test_only_its_user_may_open_it(arena: Arena) -> None:
    """Its mode allows to read, to the user alone."""
    (descriptor,) = arena.descriptors()
    assert stat.S_IMODE(os.fstat(descriptor).st_mode) == 0o400


def test_nobody_else_can_punch_holes_into_it(arena: Arena) -> None:
    """Not even its owner: a reader whose system has no memory left would end at one."""
    (descriptor,) = arena.descriptors()
    if not fcntl.fcntl(descriptor, fcntl.F_GET_SEALS) & F_SEAL_FUTURE_WRITE:
        pytest.skip("before Linux 5.1")
    keep_size, punch_hole = 1, 2
    fallocate = ctypes.CDLL(None, use_errno=True).fallocate64
    fallocate.argtypes = (ctypes.c_int, ctypes.c_int, ctypes.c_int64, ctypes.c_int64)
    assert fallocate(descriptor, keep_size | punch_hole, 0, PAGE_BYTES) == -1
    assert ctypes.get_errno() == errno.EPERM


def test_nobody_else_can_write_or_cut_it(arena: Arena) -> None:
    """Its own process can neither map it to write again, nor change its size."""
    (descriptor,) = arena.descriptors()
    with pytest.raises(OSError, match="not permitted"):
        mmap.mmap(descriptor, SIZE)
    for size in (0, 2 * SIZE):
        with pytest.raises(OSError, match="not permitted"):
            os.ftruncate(descriptor, size)
    with pytest.raises(TypeError):
        open_arena(arena.announcement)[PAGE_BYTES] = 1


@pytest.mark.processes
def test_a_closed_arena_cannot_be_opened_and_keeps_its_messages(arena: Arena) -> None:
    """Its descriptor is gone; slots and mappings stay valid."""
    slot = arena.put(MESSAGE)
    assert slot is not None
    announcement = arena.announcement
    arena.close()
    assert arena.descriptors() == ()
    assert "No such" in elsewhere(reference(slot), announcement)[0]
    assert content(slot) == MESSAGE


def test_space_is_used_again_when_a_slot_is_not_held(arena: Arena) -> None:
    """A full arena takes nothing; the space of a released slot is used by the next message."""
    held = [arena.put(bytes([each]) * 3 * PAGE_BYTES) for each in range(4)]
    assert [slot is None for slot in held] == [False, False, False, True]
    assert arena.put(bytes(20 * PAGE_BYTES)) is None
    offset = held[1] and held[1].offset
    held[1] = None
    again = arena.put(b"new" * PAGE_BYTES)
    assert again is not None
    assert again.offset == offset


def test_a_reader_notices_that_a_slot_was_used_again(arena: Arena) -> None:
    """A reference from before has another generation, also if the new message is as large."""
    memory = open_arena(arena.announcement)
    before = reference_to(arena, MESSAGE)
    assert copy_payload(memory, before) == b"\xdd\0\0\0\1" + MESSAGE
    after = reference_to(arena, MESSAGE[::-1])
    assert after.offset == before.offset
    assert copy_payload(memory, before) is None
    assert copy_payload(memory, after) == b"\xdd\0\0\0\1" + MESSAGE[::-1]


def test_messages_share_a_slot_while_there_is_space_behind_them(arena: Arena) -> None:
    """All of them are read together; the space is free again when nothing holds the slot."""
    space = arena.used_bytes
    slot = arena.put(b"a" * PAGE_BYTES)
    assert slot is not None
    assert arena.extend(slot, b"b" * 10)
    assert arena.extend(slot, b"c" * PAGE_BYTES)
    assert (slot.length, content(slot)) == (3, b"a" * PAGE_BYTES + b"b" * 10 + b"c" * PAGE_BYTES)
    other = arena.put(MESSAGE)
    assert other is not None
    assert not arena.extend(slot, bytes(3 * PAGE_BYTES))
    assert (slot.length, content(other)) == (3, MESSAGE)
    del slot, other
    assert arena.used_bytes == space == 0


def test_a_message_is_added_where_a_released_slot_was(arena: Arena) -> None:
    """The memory behind a slot is free again as soon as nobody holds it."""
    slot, next_slot = arena.put(bytes(PAGE_BYTES)), arena.put(bytes(PAGE_BYTES))
    assert slot is not None
    assert not arena.extend(slot, bytes(2 * PAGE_BYTES))
    del next_slot
    assert arena.extend(slot, bytes(2 * PAGE_BYTES))


def test_memory_is_asked_for_once(arena: Arena, monkeypatch: pytest.MonkeyPatch) -> None:
    """What the system has provided is not asked for with each message."""
    asked: list[tuple[int, int]] = []
    monkeypatch.setattr(arenas, "BACKED_BYTES", 4 * PAGE_BYTES)
    monkeypatch.setattr(os, "posix_fallocate", lambda _, start, length: asked.append((start, length)))
    slots = [arena.put(MESSAGE) for _ in range(4)]
    assert all(slots)
    assert all(one[0] + one[1] == other[0] for one, other in itertools.pairwise(asked))
    assert len(asked) < len(slots)


def test_no_message_is_added_where_the_system_has_no_memory(
    arena: Arena, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The slot stays as it is, and takes no space for the message."""
    monkeypatch.setattr(arenas, "BACKED_BYTES", PAGE_BYTES)
    slot = arena.put(MESSAGE)
    assert slot is not None
    used = arena.used_bytes

    def full(descriptor: int, start: int, length: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "posix_fallocate", full)
    assert arena.put(MESSAGE) is None
    assert not arena.extend(slot, bytes(PAGE_BYTES))
    assert (content(slot), slot.length, arena.used_bytes) == (MESSAGE, 1, used)


def test_a_reader_in_this_process_gets_the_memory_itself(arena: Arena) -> None:
    """Read-only, and not used again before it lets go of all that it has got; of a part it gets a copy."""
    slot = arena.put(MESSAGE)
    assert slot is not None
    assert arena.extend(slot, MESSAGE)
    sent = reference(slot, ends_to_bytes(array("I", [len(MESSAGE), 2 * len(MESSAGE)])))
    read = reader(arena.announcement)
    payload = read(sent)
    assert isinstance(payload, memoryview)
    assert payload.readonly
    assert bytes(payload) == array_head(2) + MESSAGE + MESSAGE
    part = read(sent._replace(length=1, ends=None, start=SLOT_HEAD_BYTES + len(MESSAGE), size=len(MESSAGE)))
    assert part == array_head(1) + MESSAGE
    view = payload[-1:]
    del payload, slot
    assert arena.used_bytes
    assert bytes(view) == MESSAGE[-1:]
    del view
    assert not arena.used_bytes
    assert read(sent) == array_head(2) + MESSAGE + MESSAGE  # nothing has been written there since
    assert reference_to(arena, MESSAGE).offset == sent.offset
    assert read(sent) is None


def test_numbers_in_a_later_message_are_no_generation(arena: Arena) -> None:
    """A larger one that begins before an earlier slot has its own bytes where that began."""
    slots = [arena.put(MESSAGE) for _ in range(2)]
    second = slots[1]
    assert second is not None
    sent = reference(second)
    del slots, second
    for number in range(20):
        larger = arena.put(array("Q", [number] * (SIZE // 16)).tobytes())
        assert larger is not None
        assert larger.offset < sent.offset < larger.offset + larger.size
        assert copy_payload(arena.memory, sent) is None
        del larger


@pytest.mark.processes
def test_a_forked_child_writes_nothing(arena: Arena) -> None:
    """It has the same memory, in which the parent's messages are, but not the descriptor."""
    (descriptor,) = arena.descriptors()
    slot = arena.put(MESSAGE)  # further ones need no more memory of the system
    assert slot is not None
    before = bytes(arena.memory)
    process = os.fork()
    if not process:
        is_null = os.fstat(descriptor).st_rdev == Path(os.devnull).stat().st_rdev
        refused = arena.put(MESSAGE) is None and not arena.extend(slot, MESSAGE)
        arena.close()
        os._exit(0 if is_null and refused else 1)
    assert os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]) == 0
    assert bytes(arena.memory) == before
    assert elsewhere(reference(slot), arena.announcement) == [(array_head(1) + MESSAGE).hex()]
    assert arena.extend(slot, MESSAGE)
    assert arena.put(MESSAGE) is not None


def test_a_forked_child_copies_the_messages_of_its_parent(arena: Arena) -> None:
    """The slot is held by an object of the parent, not by the child's copy of it."""
    slot = arena.put(MESSAGE)
    assert slot is not None
    process = os.fork()
    if not process:
        payload = reader(arena.announcement)(reference(slot))
        os._exit(0 if payload == array_head(1) + MESSAGE and isinstance(payload, bytes) else 1)
    assert os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]) == 0
    assert isinstance(reader(arena.announcement)(reference(slot)), memoryview)


def test_what_is_read_in_place_stays_in_forked_children(arena: Arena) -> None:
    """They have the view, but nothing of theirs holds the slot, so it is not used again."""
    slot = arena.put(MESSAGE)
    assert slot is not None
    payload, offset = reader(arena.announcement)(reference(slot)), slot.offset
    assert isinstance(payload, memoryview)
    reading, writing = os.pipe()
    process = os.fork()
    if not process:
        os.read(reading, 1)
        os._exit(0 if bytes(payload) == array_head(1) + MESSAGE else 1)
    del payload, slot
    following = arena.put(bytes(len(MESSAGE)))
    os.write(writing, b".")
    assert os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]) == 0
    assert following is not None
    assert following.offset != offset
    os.close(reading)
    os.close(writing)


@pytest.mark.processes
def test_the_token_is_read_by_processes_of_the_same_user(arena: Arena, tmp_path: Path) -> None:
    """Another process finds it where the arena is, and nothing in other files or numbers."""
    told, (own,) = arena.announcement, arena.descriptors()
    code = f"from proto.aio.arena import read_token; print(read_token({told.process}, {own}).hex())"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True)
    assert done.stdout.decode().strip() == told.token.hex()
    assert read_token(told.process, own) == told.token
    with (tmp_path / "file").open("wb") as file:
        for number in (file.fileno(), 2**31 - 1):
            with pytest.raises(ArenaError):
                read_token(os.getpid(), number)


@pytest.mark.filterwarnings("error::pytest.PytestUnraisableExceptionWarning")
def test_a_platform_without_sealed_memory_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is left to close."""
    monkeypatch.setattr(arenas, "SUPPORTED", False)
    with pytest.raises(ArenaError, match="no sealed memory"):
        Arena(SIZE)
    gc.collect()


@pytest.mark.parametrize("name", ["pid", "user"])
def test_processes_of_another_namespace_have_another_identity(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They may not open each other's arenas."""
    identity, read = host_identity(), os.readlink
    monkeypatch.setattr(os, "readlink", lambda path: "other" if path.endswith(name) else read(path))
    host_identity.cache_clear()
    try:
        assert host_identity() not in {identity, None}
    finally:
        host_identity.cache_clear()

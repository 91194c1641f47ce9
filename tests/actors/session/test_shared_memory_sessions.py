"""One link's shared memory, session after session: what it writes, announces and releases."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any
from unittest import mock

import pytest

from actors.session.shared_memory import RELEASE_BYTES, SLOT_BYTES, SharedMemory
from proto.aio.arena import Arena
from proto.errors import ErrorCode, ProtocolError
from proto.queues.extents import PAGE_BYTES
from proto.wire import frames
from proto.wire.codes import Capability
from proto.wire.references import SLOT_HEAD_BYTES, References, Slot

if TYPE_CHECKING:
    from collections.abc import Callable

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="arenas are memfds")

SMALL = bytes(2 * PAGE_BYTES)
MIB = bytes(1024 * 1024)


class Session:
    """A session with a broker that records what it is sent.

    Args:
        memory: The link's.
    """

    def __init__(self, memory: SharedMemory) -> None:
        self._secret = Arena(2 * PAGE_BYTES)
        self._channel = mock.Mock()
        self._channel.extra_info.return_value = None
        secret = self._secret.announcement
        welcome = {"session": 1, "secret_process": secret.process, "secret_descriptor": secret.descriptor}
        memory.begin(self._channel, frozenset({Capability.SHARED_MEMORY}), welcome)
        assert memory.active

    @property
    def references(self) -> References:
        """What the link sends by reference."""
        found: References = self._channel.outbox.transfers.references
        return found

    def sent(self, kind: type[Any]) -> list[Any]:
        """Return the frames of a type that the link has sent."""
        all_sent = [call.args[0] for call in self._channel.send.call_args_list]
        return [frame for frame in all_sent if isinstance(frame, kind)]


def put(memory: SharedMemory, message: bytes, behind: Slot | None = None) -> Slot:
    """Return the slot in which a message is; there must be space."""
    slot = memory.put(message, behind)
    assert slot is not None
    return slot


def test_a_slot_of_an_earlier_session_is_not_used_again() -> None:
    """The new arena has another message at the same place."""
    memory = SharedMemory()
    Session(memory)
    old = put(memory, SMALL)
    memory.end()
    Session(memory)
    new = put(memory, SMALL)
    assert new.offset == old.offset
    assert put(memory, SMALL, old) is not old
    assert (old.length, new.length) == (1, 1)


def test_an_arena_of_an_earlier_session_is_not_announced() -> None:
    """Nobody could open it; what is in there leaves as bytes."""
    memory = SharedMemory()
    Session(memory)
    old = put(memory, SMALL)
    memory.end()
    session = Session(memory)
    new = put(memory, SMALL)
    assert not session.references.allows(old)
    assert not session.references.allows(new)
    assert session.sent(frames.Arena) == [new.arena]


def test_a_slot_takes_no_more_than_its_limit() -> None:
    """Further messages of the loop turn go into another one."""
    memory = SharedMemory()
    message = bytes(SLOT_BYTES // 2)
    slot = put(memory, message)
    assert put(memory, message, slot) is slot
    assert put(memory, SMALL, slot) is not slot
    assert slot.size == SLOT_BYTES


def reading(memory: SharedMemory) -> tuple[Arena, Callable[[bytes], None]]:
    """Let a link open another one's arena; return that, and what lets the link read a message in it."""
    others = Arena(4 * RELEASE_BYTES)
    memory.arena_announced(others.announcement)

    def read(message: bytes) -> None:
        slot = others.put(message)
        assert slot is not None
        head = 1, 0, 1, 1, None, None
        reference = frames.Reference(
            *head, slot.arena.id, slot.offset, SLOT_HEAD_BYTES, len(message), slot.generation
        )
        batch = memory.receive(reference)
        assert batch is not None
        assert bytes(batch.payload).endswith(message)
        memory.read_finished()

    return others, read


async def test_much_is_released_at_once_and_little_later() -> None:
    """Again and again: what was released does not count any more."""
    memory = SharedMemory()
    session = Session(memory)
    _, read = reading(memory)
    times = RELEASE_BYTES // len(MIB)
    for _ in range(2 * times + 1):
        read(MIB)
    released = [frame.numbers for frame in session.sent(frames.Release)]
    assert released == [tuple(range(times)), tuple(range(times, 2 * times))]
    memory.end()


async def test_an_arena_that_is_unmapped_is_closed() -> None:
    """The broker does not refer to it any more."""
    memory = SharedMemory()
    Session(memory)
    others, read = reading(memory)
    read(SMALL)
    memory.unmapped(frames.Unmap(others.announcement.id))
    with pytest.raises(ProtocolError) as caught:
        read(SMALL)
    assert caught.value.code is ErrorCode.UNKNOWN_ID
    memory.end()

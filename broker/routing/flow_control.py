"""Flow control: the credit that KEEP_ALL subscriptions grant a publisher (docs/protocol.md §6.5)."""

from __future__ import annotations

from heapq import heapify, heappop, heappush, heapreplace
from typing import TYPE_CHECKING, Final

from proto.errors import ErrorCode, ProtocolError
from proto.limits import MAX_U64
from proto.queues.batches import message_bytes
from proto.wire.ends import ends_from_bytes

if TYPE_CHECKING:
    from proto.wire.frames import Batch

HOLD: Final = 0
"""The key of the limit that stops a publisher when the broker stops; keys of subscriptions begin at 1."""


class Minimum:
    """The minimum of many numbers that only rise; a change costs O(log n)."""

    def __init__(self) -> None:
        self._numbers: dict[int, int] = {}
        self._heap: list[tuple[int, int]] = []
        """Numbers and keys. An entry may be too low or of a removed key: `get` corrects it at the top."""

    def add(self, key: int, number: int) -> None:
        """Add a number."""
        self._numbers[key] = number
        heappush(self._heap, (number, key))
        if len(self._heap) > 2 * len(self._numbers) + 8:
            self._heap = [(each, owner) for owner, each in self._numbers.items()]
            heapify(self._heap)

    def rise(self, key: int, number: int) -> None:
        """Raise a number, unless it is higher already."""
        self._numbers[key] = max(self._numbers[key], number)

    def number(self, key: int) -> int:
        """Return the number of a key."""
        return self._numbers[key]

    def remove(self, key: int) -> None:
        """Remove a number."""
        del self._numbers[key]

    def get(self) -> int | None:
        """Return the minimum, or None if there is no number."""
        heap, numbers = self._heap, self._numbers
        while heap:
            number, key = heap[0]
            now = numbers.get(key)
            if now == number:
                return number
            if now is None:
                heappop(heap)
            else:
                heapreplace(heap, (now, key))
        return None


class CreditLimits:
    """The limits that subscriptions set one publisher, in the publisher's own numbers.

    A limit that does not fit into a frame becomes the greatest that does: no publisher gets that far.
    """

    def __init__(self) -> None:
        self._sequences = Minimum()
        self._sizes = Minimum()
        self._bases: dict[int, int] = {}
        """The publisher's bytes when the subscription was attached."""

    def add(self, subscription: int, sequence_limit: int, byte_limit: int, byte_base: int) -> None:
        """Add a subscription; its byte limits count from `byte_base`."""
        self._bases[subscription] = byte_base
        self._sequences.add(subscription, min(sequence_limit, MAX_U64))
        self._sizes.add(subscription, min(byte_base + byte_limit, MAX_U64))

    def grant(self, subscription: int, sequence_limit: int, byte_limit: int) -> None:
        """Raise a subscription's limits; ignore an unknown one."""
        base = self._bases.get(subscription)
        if base is not None:
            self._sequences.rise(subscription, min(sequence_limit, MAX_U64))
            self._sizes.rise(subscription, min(base + byte_limit, MAX_U64))

    def remove(self, subscription: int) -> bool:
        """Remove a subscription; return False if it has no limits."""
        if self._bases.pop(subscription, None) is None:
            return False
        self._sequences.remove(subscription)
        self._sizes.remove(subscription)
        return True

    def used_up(self, subscription: int, sequence: int, size: int) -> bool:
        """Return whether a subscription's limits allow no message of this number, after so many bytes."""
        if subscription not in self._bases:
            return False
        return self._sequences.number(subscription) <= sequence or self._sizes.number(subscription) <= size

    def least(self) -> tuple[int, int] | None:
        """Return the least limits, sequence and bytes; None if there is no limit."""
        sequence, size = self._sequences.get(), self._sizes.get()
        return None if sequence is None or size is None else (sequence, size)


class PublisherCredit:
    """The credit of one publisher.

    Attributes:
        bytes: Bytes of its messages since its declaration, which byte limits count.
        limits: The limits that its subscriptions set.
        limit: The least of them, as sent to the publisher: sequence and bytes; None if unlimited.
        unconfirmed: CREDIT frames that ended an unlimited time and that the publisher has not echoed yet.
    """

    __slots__ = ("_greatest", "bytes", "limit", "limits", "unconfirmed")

    def __init__(self) -> None:
        self.bytes = 0
        self.limits = CreditLimits()
        self.limit: tuple[int, int] | None = None
        self.unconfirmed = 0
        self._greatest: tuple[int, int] | None = None
        """The greatest limit sent since it was unlimited; None while it is unlimited."""

    def update(self) -> bool:
        """Set the limit to the least of all; return whether it has changed and is to be sent."""
        limit = self.limits.least()
        if limit == self.limit:
            return False
        self.limit = limit
        if limit is None:
            self._greatest = None
            return True
        if self._greatest is None:
            self.unconfirmed += 1
        sequence, size = self._greatest or limit
        self._greatest = max(sequence, limit[0]), max(size, limit[1])
        return True

    def confirm(self) -> None:
        """Note that the publisher has echoed a CREDIT; it must keep the limit once all are confirmed."""
        if self.unconfirmed:
            self.unconfirmed -= 1

    def used_up(self, next_sequence: int) -> bool:
        """Return whether the publisher, whose next number is given, has to wait for credit."""
        return self.limit is not None and (next_sequence >= self.limit[0] or self.bytes >= self.limit[1])

    def exceeded(self, next_sequence: int) -> bool:
        """Return whether the publisher, whose next number is given, is beyond its present limit."""
        return self.limit is not None and (next_sequence > self.limit[0] or self.bytes > self.limit[1])

    def check(self, topic: str, next_sequence: int, batch: Batch) -> None:
        """Check that a batch stays within the greatest limit that the publisher was sent.

        A message may be sent while the number after the last one sent is below the sequence limit, so that
        numbers that the publisher dropped use no credit, and while the bytes sent before it are below the
        byte limit.

        Raises:
            ProtocolError: It does not.
        """
        if self.unconfirmed or self._greatest is None:
            return
        sequence_limit, byte_limit = self._greatest
        number, before = next_sequence, self.bytes
        if batch.ends is not None:
            number = batch.first_sequence + batch.length - 1
            before += ends_from_bytes(batch.ends[-8:-4])[0] if len(batch.ends) >= 8 else 0
        if number >= sequence_limit or before >= byte_limit:
            text = (
                f"publisher on '{topic}' went beyond its credit: message {number} of {sequence_limit},"
                f" byte {self.bytes + message_bytes(batch)} of {byte_limit}"
            )
            raise ProtocolError(ErrorCode.CREDIT, text)
